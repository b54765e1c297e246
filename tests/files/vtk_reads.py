#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
# Reads an exported .vti with VTK's own reader (ParaView's), beside the result's volume.vdb with OpenVDB's Python module: the same bits at
# the same places; and draws it.
#   xvfb-run -a /usr/bin/python3 vtk_reads.py /ABS/flame.vti /ABS/volume.vdb /ABS/picture.png
import sys

import numpy as np
import pyopenvdb
import vtk
from vtk.util.numpy_support import vtk_to_numpy

VTI, VDB, PICTURE = sys.argv[1:]


def read(path):
    reader = vtk.vtkXMLImageDataReader()
    failed = []
    reader.AddObserver("ErrorEvent", lambda *_: failed.append(path))
    reader.SetFileName(path)
    reader.Update()
    image = reader.GetOutput()
    if failed or image.GetNumberOfPoints() == 0:
        raise SystemExit(f"VTK can't read {path}")
    return image


def compare(image, grid):
    """Values in VTK's order, the first axis fastest; the corners' places."""
    size = image.GetDimensions()
    if tuple(grid.metadata["emberlock_dimensions"]) != size:
        raise SystemExit(f"{grid.name}: {size} points")
    three = isinstance(grid, pyopenvdb.Vec3SGrid)
    values = np.zeros(size + ((3,) if three else ()), np.float32)
    grid.copyToArray(values)
    expected = values.transpose((2, 1, 0) + ((3,) if three else ())).reshape((-1,) + ((3,) if three else ()))
    array = image.GetPointData().GetArray(grid.name)
    if array is None or not np.array_equal(vtk_to_numpy(array), expected):
        raise SystemExit(f"{grid.name}: other values")
    for corner in ((0, 0, 0), tuple(n - 1 for n in size)):
        there = image.GetPoint(image.ComputePointId(corner))
        if not np.allclose(there, grid.transform.indexToWorld(corner), rtol=0, atol=1e-9):
            raise SystemExit(f"{grid.name}: point {corner} is at {there}")
    unit = array.GetInformation().Get(vtk.vtkDataArray.UNITS_LABEL())
    if unit != grid.metadata["unit"]:
        raise SystemExit(f"{grid.name}: unit {unit}")
    print(f"SAME {grid.name}: {array.GetNumberOfTuples()} points of {array.GetNumberOfComponents()}, {unit}")


def draw(image):
    image.GetPointData().SetActiveScalars("flame")
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetSampleDistance(image.GetSpacing()[0] / 2)
    colours = vtk.vtkColorTransferFunction()
    for share, rgb in ((0, (0.5, 0, 0)), (0.1, (0.9, 0.3, 0)), (0.4, (1, 0.8, 0.3)), (1, (1, 1, 0.9))):
        colours.AddRGBPoint(share, *rgb)
    opacity = vtk.vtkPiecewiseFunction()
    opacity.AddPoint(0, 0)
    opacity.AddPoint(0.3, 0.5)
    opacity.AddPoint(1, 0.9)
    look = vtk.vtkVolumeProperty()
    look.SetColor(colours)
    look.SetScalarOpacity(opacity)
    look.SetInterpolationTypeToLinear()
    look.SetScalarOpacityUnitDistance(image.GetSpacing()[0])
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    scene = vtk.vtkRenderer()
    scene.AddVolume(volume)
    camera = scene.GetActiveCamera()
    camera.SetPosition(1, -1, 0.3)
    camera.SetFocalPoint(0, 0, 0)
    camera.SetViewUp(0, 0, 1)
    scene.ResetCamera()
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(300, 400)
    window.AddRenderer(scene)
    window.Render()
    grab = vtk.vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    brightest = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).max()
    if brightest < 100:
        raise SystemExit("nothing is to be seen")
    png = vtk.vtkPNGWriter()
    png.SetFileName(PICTURE)
    png.SetInputConnection(grab.GetOutputPort())
    png.Write()
    print(f"DRAWN {PICTURE}, up to {brightest} of 255")


image = read(VTI)
for named in pyopenvdb.readAllGridMetadata(VDB):
    compare(image, pyopenvdb.read(VDB, named.name))
field = image.GetFieldData()
print("FROM", [field.GetAbstractArray(name).GetValue(0) for name in ("program", "input", "up")])
draw(image)
