# SPDX-License-Identifier: Apache-2.0
# Renders an exported .vdb with Blender's Cycles, as docs/open_volumes.md tells people to set it up:
#   blender -b --factory-startup --python-exit-code 1 -P blender.py -- '{"volume": "/ABS/flame.vdb", "picture": "/ABS/out.exr", ...}'
# `material` is "emission" (what Emberlock reconstructed, in shares of white) or "principled" (temperature and density by their plain
# names). With `expected`, an EXR of `emberlock render`, it fails where the pictures differ by more than `most` (RMS over the range,
# of the pixels that have over 1 % of the brightest one's light).
import json
import os
import sys

import bpy
import numpy as np

sys.path.append(os.path.dirname(os.path.abspath(__file__)))
import blender_shared as shared  # noqa: E402

ask = json.loads(sys.argv[sys.argv.index("--") + 1])


def principled_material(nodes, links, output):
    """As Blender has it for a new volume, but for the glow; the grids' names are its defaults."""
    principled = nodes.new("ShaderNodeVolumePrincipled")
    names = [principled.inputs[f"{what} Attribute"].default_value for what in ("Density", "Temperature")]
    if names != ["density", "temperature"]:
        raise RuntimeError(f"this Blender's Principled Volume reads {names}")
    principled.inputs["Temperature"].default_value = 1  # it multiplies the grid, which is in K
    principled.inputs["Blackbody Intensity"].default_value = 1
    links.new(principled.outputs[0], output.inputs["Volume"])


def compare(seen, expected):
    both = (shared.pixels(expected), seen)
    if both[0].shape != both[1].shape or both[0].max() <= 0:
        raise RuntimeError("the pictures are of other sizes, or there is nothing in the expected one")
    scale = both[0].max() - both[0].min()
    off = (both[1] - both[0]) / scale
    lit = off[both[0].max(axis=2) > 0.01 * both[0].max()]
    rms = np.sqrt(np.mean(lit**2))
    print(f"AGREEMENT {100 * rms:.3f} % of the range (RMS over the {100 * lit.size / off.size:.0f} % of the pixels that are lit, all channels), "
          f"{100 * np.sqrt(np.mean(off**2)):.3f} % over all pixels, worst {100 * np.abs(off).max():.2f} %, "
          f"light {100 * (both[1].sum() / both[0].sum() - 1):+.3f} %")
    return rms


for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
make = {"emission": shared.emission_material, "principled": principled_material}[ask["material"]]
shared.give_material(shared.load_volume(ask["volume"], ask["grids"]).data, make)
scene = bpy.context.scene
shared.place_camera(scene, ask["from"], ask["at"], *ask["image"])
shared.set_up_render(scene, ask["picture"], ask["samples"], ask["step_rate"])
scene.cycles.filter_width = 0.01  # rays through the pixels' middles
scene.view_settings.exposure = ask.get("stops", 0)
bpy.ops.render.render(write_still=True)
seen = shared.pixels(ask["picture"])
print(f"SEEN mean {seen.mean():.4f} most {seen.max():.4f}")
if seen.max() <= 0.05:
    raise RuntimeError("nothing is to be seen")
if "expected" in ask:
    rms = compare(seen, ask["expected"])
    if rms > ask["most"]:
        raise RuntimeError(f"the pictures differ by more than {ask['most']}")
    if rms < ask.get("least", 0):
        raise RuntimeError("the pictures differ by less than they would if values lay elsewhere")
