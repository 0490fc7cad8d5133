"""Grids of `ffrobot view` as VTK reads them."""

import pytest


@pytest.fixture(scope="session")
def read():
    """Read a .vtkhdf file with VTK: for each time step its time, points, point data and cell data."""
    hdf = pytest.importorskip("vtkmodules.vtkIOHDF")
    numpy_support = pytest.importorskip("vtkmodules.util.numpy_support")

    def arrays(data):
        found = [data.GetArray(i) for i in range(data.GetNumberOfArrays())]
        return {array.GetName(): numpy_support.vtk_to_numpy(array).copy() for array in found}

    def steps(path):
        reader = hdf.vtkHDFReader()
        reader.SetFileName(str(path))
        reader.UpdateInformation()
        for step in range(reader.GetNumberOfSteps()):
            reader.SetStep(step)
            reader.Update()
            grid = reader.GetOutputDataObject(0)
            points = numpy_support.vtk_to_numpy(grid.GetPoints().GetData()).copy()
            yield reader.GetTimeValue(), grid, points, arrays(grid.GetPointData()), arrays(grid.GetCellData())

    return lambda path: list(steps(path))
