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
import mathutils
import numpy as np

ask = json.loads(sys.argv[sys.argv.index("--") + 1])
WHITE = 255  # grey levels


def load_volume(path):
    """Blender renders a missing or unreadable file as black."""
    if not os.path.isabs(path) or not os.path.isfile(path):
        raise SystemExit(f"no file with an absolute path: {path}")
    data = bpy.data.volumes.new("flame")
    data.filepath = path
    if not data.grids.load() or data.grids.error_message:
        raise RuntimeError(f"Blender can't read {path}: {data.grids.error_message}")
    names = {grid.name for grid in data.grids}
    missing = set(ask["grids"]) - names
    if missing:
        raise RuntimeError(f"{path} has no grids {missing}, only {names}")
    data.render.precision = "FULL"  # else half floats
    data.render.clipping = 0
    flame = bpy.data.objects.new("flame", data)
    bpy.context.collection.objects.link(flame)
    return data


def emission_material(nodes, links, output):
    """Emission / 255 and black absorption: emitted light as `emberlock render` sees it."""
    colour = nodes.new("ShaderNodeAttribute")
    colour.attribute_name = "emission"
    light = nodes.new("ShaderNodeEmission")
    light.inputs["Strength"].default_value = 1 / WHITE
    links.new(colour.outputs["Color"], light.inputs["Color"])
    density = nodes.new("ShaderNodeAttribute")
    density.attribute_name = "density"
    absorption = nodes.new("ShaderNodeVolumeAbsorption")
    absorption.inputs["Color"].default_value = (0, 0, 0, 1)
    links.new(density.outputs["Fac"], absorption.inputs["Density"])
    both = nodes.new("ShaderNodeAddShader")
    links.new(light.outputs[0], both.inputs[0])
    links.new(absorption.outputs[0], both.inputs[1])
    links.new(both.outputs[0], output.inputs["Volume"])


def principled_material(nodes, links, output):
    """As Blender has it for a new volume, but for the glow; the grids' names are its defaults."""
    principled = nodes.new("ShaderNodeVolumePrincipled")
    names = [principled.inputs[f"{what} Attribute"].default_value for what in ("Density", "Temperature")]
    if names != ["density", "temperature"]:
        raise RuntimeError(f"this Blender's Principled Volume reads {names}")
    principled.inputs["Temperature"].default_value = 1  # it multiplies the grid, which is in K
    principled.inputs["Blackbody Intensity"].default_value = 1
    links.new(principled.outputs[0], output.inputs["Volume"])


def give_material(data):
    material = bpy.data.materials.new("flame")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    output = nodes.new("ShaderNodeOutputMaterial")
    make = {"emission": emission_material, "principled": principled_material}[ask["material"]]
    make(nodes, material.node_tree.links, output)
    data.materials.append(material)


def place_camera(scene, width, height):
    """`emberlock render --camera FROM --look-at AT`: 40 degrees across the shorter side, +z up."""
    eye, at = (mathutils.Vector(ask[key]) for key in ("from", "at"))
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "HORIZONTAL" if width <= height else "VERTICAL"
    camera.angle = np.radians(40)
    camera.clip_start = 1e-4
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.location = eye
    scene.camera.rotation_euler = (at - eye).to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = width, height


def set_up_render(scene):
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = ask["samples"]
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"  # rays through the pixels' middles
    scene.cycles.filter_width = 0.01
    scene.cycles.volume_step_rate = ask["step_rate"]
    scene.cycles.volume_max_steps = 65536
    scene.view_settings.exposure = ask.get("stops", 0)
    world = bpy.data.worlds.new("nothing")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    scene.world = world
    exr = ask["picture"].endswith(".exr")
    scene.view_settings.view_transform = "Raw" if exr else "Standard"
    scene.render.image_settings.file_format = "OPEN_EXR" if exr else "PNG"
    if exr:
        scene.render.image_settings.color_depth = "32"
    scene.render.filepath = ask["picture"]


def pixels(path):
    """Height x width x RGB, as the file has them."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Raw" if path.endswith(".exr") else image.colorspace_settings.name
    return np.array(image.pixels[:], dtype=np.float64).reshape(image.size[1], image.size[0], -1)[..., :3]


def compare(seen, expected):
    both = (pixels(expected), seen)
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
give_material(load_volume(ask["volume"]))
scene = bpy.context.scene
place_camera(scene, *ask["image"])
set_up_render(scene)
bpy.ops.render.render(write_still=True)
seen = pixels(ask["picture"])
print(f"SEEN mean {seen.mean():.4f} most {seen.max():.4f}")
if seen.max() <= 0.05:
    raise RuntimeError("nothing is to be seen")
if "expected" in ask:
    rms = compare(seen, ask["expected"])
    if rms > ask["most"]:
        raise RuntimeError(f"the pictures differ by more than {ask['most']}")
    if rms < ask.get("least", 0):
        raise RuntimeError("the pictures differ by less than they would if values lay elsewhere")
