"""A certified volume as VTK's data."""

from __future__ import annotations

from typing import Any, Iterable

from . import _core


def multiblock(boxes: Iterable[Any], unit: str, epsilon_abs: float) -> Any:
    """A vtkMultiBlockDataSet of (origin, spacing, extent, samples [z, y, x])."""
    try:
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkStringArray
        from vtkmodules.vtkCommonDataModel import vtkImageData, vtkMultiBlockDataSet
    except ImportError:
        raise ImportError("to_vtk needs VTK: pip install 'vdvr[vtk]'") from None
    result = vtkMultiBlockDataSet()
    for number, (origin, spacing, extent, samples) in enumerate(boxes):
        image = vtkImageData()
        image.SetExtent([int(e) for e in extent])
        image.SetOrigin(origin)
        image.SetSpacing(spacing)
        density = numpy_to_vtk(samples.ravel(), deep=True)
        density.SetName("density")
        image.GetPointData().SetScalars(density)
        result.SetBlock(number, image)
    bound = vtkDoubleArray()
    bound.SetName("epsilon_abs")
    bound.InsertNextValue(epsilon_abs)
    length = vtkStringArray()
    length.SetName("unit")
    length.InsertNextValue(unit)
    result.GetFieldData().AddArray(bound)
    result.GetFieldData().AddArray(length)
    return result
