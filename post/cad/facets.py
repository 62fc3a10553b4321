"""Faces as triangles, for pictures and for what is seen."""
from dataclasses import dataclass

import numpy as np

from post.cad.occ import compound_of

BEND = 0.3             # radians between neighbouring facets
DEFLECTION = 1e-3      # of the diagonal of all faces


@dataclass
class Facets:
    """Triangles of faces; the normals of those of solids point outwards."""
    points: np.ndarray       # (points, 3)
    triangles: np.ndarray    # (triangles, 3)
    owners: np.ndarray       # index of the face of each triangle

    @property
    def corners(self):
        return self.points[self.triangles]

    @property
    def normals(self):
        """Not of unit length: twice the area."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)


def facets_of(faces, diagonal):
    """Triangulate the faces of a model."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_REVERSED
    from OCP.TopLoc import TopLoc_Location
    compound = compound_of(face.shape for face in faces)
    BRepMesh_IncrementalMesh(compound, DEFLECTION * diagonal, False, BEND, False)
    points, triangles, owners, n = [np.zeros((0, 3))], [np.zeros((0, 3), int)], [], 0
    for i, face in enumerate(faces):
        location = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face.shape, location)
        if mesh is None:
            continue
        own = np.array([[p.X(), p.Y(), p.Z()] for p in (
            mesh.Node(k + 1).Transformed(location.Transformation())
            for k in range(mesh.NbNodes()))])
        cells = np.array([mesh.Triangle(k + 1).Get() for k in range(mesh.NbTriangles())]) - 1
        if face.shape.Orientation() == TopAbs_REVERSED:
            cells = cells[:, ::-1]
        points.append(own)
        triangles.append(cells + n)
        owners += [i] * len(cells)
        n += len(own)
    return Facets(np.concatenate(points), np.concatenate(triangles), np.array(owners, int))
