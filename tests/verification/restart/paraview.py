"""The result of a run that failed, by the reader that ParaView has: every frame opens. Skipped,
with exit code 77, where Python has no VTK.

Usage: paraview.py PROGRAM PROJECT
"""
import sys

try:
    from vtkmodules.vtkIOHDF import vtkHDFReader
except ImportError:
    print("skipped: no VTK for Python, so the frames of a failed run are not read by its reader")
    sys.exit(77)
import h5py

from common import PROJECT, igaform, run_all


def all_frames_of_a_failed_run_open(folder):
    igaform(folder, PROJECT / "input/stability/pull.key", "--set", "strain=-1.2", "--set",
            "rate=-50000", "--threads", "1", "--out", "a.h5", code=2)
    with h5py.File(folder / "a.h5") as file:
        assert file["provenance"].attrs["status"] == b"failed"
        n_frames = len(file["frames/is_failed"])
    assert n_frames > 1
    reader = vtkHDFReader()
    reader.SetFileName(str(folder / "a.h5"))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == n_frames, (reader.GetNumberOfSteps(), n_frames)
    for frame in range(n_frames):
        reader.SetStep(frame)
        reader.Update()
        grid = reader.GetOutputDataObject(0)
        assert grid.GetNumberOfCells() > 0 and grid.GetNumberOfPoints() > 0
        points = grid.GetPointData()
        assert points.GetNumberOfArrays() > 0
        for i in range(points.GetNumberOfArrays()):
            assert points.GetArray(i).GetNumberOfTuples() == grid.GetNumberOfPoints()


if __name__ == "__main__":
    run_all(all_frames_of_a_failed_run_open)
