"""Which faces are seen from a direction, by rays from points just off each face."""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import mutable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

from post.cad.facets import facets_of

ALONG = 0.02         # sine between a face and the view that makes it a wall along the view
OFF = 1e-4           # of the diagonal: how far off the face a ray starts
RAYS = 100           # of a face, spread over it
CORNERS = 50         # facets of a face from whose corners there are more,
NEAR = 0.99          # so near to the corners
SPREAD = np.array([0.7548776662466927, 0.5698402909980532])   # of points: powers of 1/1.3247...


def seen(faces, everything, towards, diagonal):
    """Indices of the faces that are seen, and of those among them that are walls along the view.

    A face is seen if from one of its points nothing lies in the way towards the eye; `everything`
    may lie in the way. Of a solid, the outside counts; of a loose face, both sides.
    """
    facets = facets_of(everything, diagonal)
    place = {face.number: i for i, face in enumerate(everything)}
    towards = np.asarray(towards)
    normals = facets.normals
    areas = np.linalg.norm(normals, axis=1)
    unit = normals / np.maximum(areas, 1e-300)[:, None]
    locator = locator_of(facets)
    found, walls = [], []
    for i, face in enumerate(faces):
        mine = np.flatnonzero((facets.owners == place[face.number]) & (areas > 0))
        if not len(mine):
            continue
        rays = starts(facets.corners[mine], unit[mine], areas[mine], face.is_solid, towards,
                      OFF * diagonal)
        if any(is_free(locator, start, towards, 2 * diagonal) for start in rays):
            found.append(i)
            if np.abs(unit[mine] @ towards).max() < ALONG:
                walls.append(i)
    return found, walls


def starts(corners, normals, areas, is_solid, towards, off):
    """Points spread over the facets that are turned to the eye or lie along the view, just off
    them on that side."""
    slopes = normals @ towards
    if not is_solid:
        normals = np.where((slopes < 0)[:, None], -normals, normals)
        slopes = np.abs(slopes)
    turned = np.flatnonzero(slopes > -ALONG)
    if not len(turned):
        return np.zeros((0, 3))
    sums = np.cumsum(areas[turned])
    which = turned[np.searchsorted(sums, (np.arange(RAYS) + 0.5) / RAYS * sums[-1])]
    a, b = (np.arange(1, RAYS + 1)[:, None] * SPREAD % 1).T
    a, b = np.where(a + b > 1, 1 - a, a), np.where(a + b > 1, 1 - b, b)
    shares = np.column_stack([a, b, 1 - a - b])
    some = turned[::-(-len(turned) // CORNERS)]
    which = np.concatenate([which, np.repeat(some, 3)])
    near = NEAR * np.eye(3) + (1 - NEAR) / 3
    shares = np.concatenate([shares, np.tile(near, (len(some), 1))])
    points = np.einsum("ab,abc->ac", shares, corners[which])
    return points + normals[which] * np.minimum(off, 0.02 * np.sqrt(areas[which]))[:, None]


def locator_of(facets):
    mesh = vtkPolyData()
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(facets.points), deep=True))
    mesh.SetPoints(points)
    cells = np.column_stack([np.full(len(facets.triangles), 3), facets.triangles]).ravel()
    array = vtkCellArray()
    array.ImportLegacyFormat(numpy_to_vtkIdTypeArray(cells.astype(np.int64), deep=True))
    mesh.SetPolys(array)
    locator = vtkStaticCellLocator()
    locator.SetDataSet(mesh)
    locator.BuildLocator()
    return locator


def is_free(locator, start, towards, reach):
    where, inner = [0.0] * 3, [0.0] * 3
    return not locator.IntersectWithLine(start, start + reach * towards, 1e-12 * reach,
                                         mutable(0.0), where, inner, mutable(0), mutable(0))
