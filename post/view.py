"""The view of all pictures in 3-D, by one rule.

Up is the coordinate axis nearest to the mean normal of the sheet at the start, the last one of
several that are as near. The next axis (x, if up is y or z) runs to the right, and the eye is in
front, above and a little to the left. The projection is parallel.
"""
import numpy as np

EYE = (-0.35, 0.55, 0.8)     # to the right, up and to the front


class View:
    """Axes of the screen: `right`, `up` and `to_eye` are perpendicular to each other. `above` -1
    looks from below."""

    def __init__(self, up_axis, above=1):
        upright = np.eye(3)[up_axis]
        across = np.eye(3)[1 if up_axis == 0 else 0]
        self.up_axis, self.above = up_axis, above
        self.to_eye = EYE @ np.array([across, above * upright, np.cross(across, upright)])
        self.to_eye /= np.linalg.norm(self.to_eye)
        self.right = np.cross(upright, self.to_eye)
        self.right /= np.linalg.norm(self.right)
        self.up = np.cross(self.to_eye, self.right)

    def project(self, points):
        """Places on the screen and towards the eye."""
        return points @ np.array([self.right, self.up, self.to_eye]).T


def view_of(results, above=1):
    """The view by the rule, or that from below."""
    normal = sum(mean_normal(patch) for patch in results.patches)
    size = np.round(np.abs(normal) / np.abs(normal).max(), 3)
    return View(int(np.flatnonzero(size == 1)[-1]), above)


def mean_normal(patch):
    """Sum of the normals of the mid-surface at the start, by area."""
    n = patch.n_elements
    places = np.arange(n[0] + 1), np.arange(n[1] + 1), [0.5 * n[2]]
    points = (patch.sample("Points", 0, *places) - patch.sample("displacement", 0, *places))[0]
    one, other = points[1:, 1:] - points[:-1, :-1], points[1:, :-1] - points[:-1, 1:]
    return np.cross(one, other).sum(axis=(0, 1))
