# SPDX-License-Identifier: Apache-2.0
# Opens exported .vti with ParaView, one or a sequence, as File > Open does, beside the results' volume.vdb with OpenVDB's Python module:
# the same arrays, ranges, places and values between key points; and draws the last one.
#   pvbatch paraview_reads.py /ABS/picture.png /ABS/flame_0000.vti /ABS/frame-0/volume.vdb [/ABS/flame_0001.vti ...]
import sys

import numpy as np
import pyopenvdb
from paraview import servermanager, simple
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkPNGReader

PICTURE, FILES = sys.argv[1], sys.argv[2:]
VTIS, VDBS = FILES[::2], FILES[1::2]
ADDED = {"flame"}  # by export; and "temperature_told" to a temperature


def grids_of(vdb):
    """Of each grid its values [x, y, z, component] and its transform."""
    grids = {}
    for named in pyopenvdb.readAllGridMetadata(vdb):
        grid = pyopenvdb.read(vdb, named.name)
        three = isinstance(grid, pyopenvdb.Vec3SGrid)
        values = np.zeros(tuple(grid.metadata["emberlock_dimensions"]) + ((3,) if three else ()), np.float32)
        grid.copyToArray(values)
        grids[grid.name] = values.reshape(values.shape[:3] + (-1,)), grid.transform
    return grids


def compare(source, grids):
    arrays = source.PointData
    expected = set(grids) | ADDED | ({"temperature_told"} if "temperature" in grids else set())
    if set(arrays.keys()) != expected:
        raise SystemExit(f"arrays {sorted(arrays.keys())}, not {sorted(expected)}")
    emission, transform = grids["emission"]
    last = [n - 1 for n in emission.shape[:3]]
    corners = np.array([transform.indexToWorld(corner) for corner in ((0, 0, 0), tuple(last))])
    bounds = source.GetDataInformation().GetBounds()
    if not np.allclose(np.reshape(bounds, (3, 2)).T, corners, rtol=0, atol=1e-9):
        raise SystemExit(f"bounds {bounds}, not {corners}")
    # Amid eight key points, the brightest one of them: what lies half an edge off is seen.
    brightest = np.unravel_index(emission.sum(-1).argmax(), emission.shape[:3])
    cell = [int(min(i, n - 1)) for i, n in zip(brightest, last)]
    probed = probe(source, transform.indexToWorld(tuple(i + 0.5 for i in cell)))
    for name, (values, _) in grids.items():
        for c in range(values.shape[-1]):
            seen = arrays[name].GetRange(c)
            if seen != (values[..., c].min(), values[..., c].max()):
                raise SystemExit(f"{name}[{c}]: range {seen}, not {values[..., c].min()} to {values[..., c].max()}")
        mean = values[tuple(slice(i, i + 2) for i in cell)].mean((0, 1, 2), dtype=np.float64)
        if not np.allclose(probed[name], mean, rtol=1e-5, atol=0):
            raise SystemExit(f"{name}: {probed[name]} at {cell}, not {mean}")
        print(f"SAME {name}: ranges, and {probed[name]} within cell {cell}")


def probe(source, place):
    """Of each array its value there."""
    point = simple.ProbeLocation(Input=source, ProbeType="Fixed Radius Point Source")
    point.ProbeType.Center = place
    point.ProbeType.NumberOfPoints = 1
    point.ProbeType.Radius = 0
    point.UpdatePipeline(simple.GetAnimationScene().AnimationTime)
    data = servermanager.Fetch(point).GetPointData()
    return {data.GetArrayName(i): np.array(data.GetArray(i).GetTuple(0)) for i in range(data.GetNumberOfArrays())}


def draw(source):
    simple._DisableFirstRenderCameraReset()
    view = simple.CreateView("RenderView")
    view.ViewSize = [300, 400]
    view.UseColorPaletteForBackground = 0
    view.Background = [0, 0, 0]
    view.OrientationAxesVisibility = 0
    shown = simple.Show(source, view)
    shown.SetRepresentationType("Volume")
    simple.ColorBy(shown, ("POINTS", "flame"))
    shown.RescaleTransferFunctionToDataRange(True)
    simple.GetColorTransferFunction("flame").ApplyPreset("Black-Body Radiation", True)
    shown.ScalarOpacityUnitDistance = source.GetDataInformation().GetBounds()[5] / 100
    bounds = np.reshape(source.GetDataInformation().GetBounds(), (3, 2))
    view.CameraFocalPoint = list(bounds.mean(1))
    view.CameraPosition = list(bounds.mean(1) + 1.5 * np.ptp(bounds, 1).max() * np.array([0.7, -0.7, 0.2]))
    view.CameraViewUp = [0, 0, 1]
    simple.Render(view)
    simple.SaveScreenshot(PICTURE, view)
    reader = vtkPNGReader()
    reader.SetFileName(PICTURE)
    reader.Update()
    brightest = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars()).max()
    if brightest < 100:
        raise SystemExit("nothing is to be seen")
    print(f"DRAWN {PICTURE}, up to {brightest} of 255")


source = simple.OpenDataFile(VTIS if len(VTIS) > 1 else VTIS[0])
scene = simple.GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
times = list(getattr(source, "TimestepValues", [])) or [0]
if len(times) != len(VTIS):
    raise SystemExit(f"{len(times)} times of {len(VTIS)} files")
for time, vdb in zip(times, VDBS):
    scene.AnimationTime = time
    source.UpdatePipeline(time)
    compare(source, grids_of(vdb))
draw(source)
