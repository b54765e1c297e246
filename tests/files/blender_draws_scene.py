# SPDX-License-Identifier: Apache-2.0
# Draws the scene of `bench_scene` with Blender's Cycles, by direct light alone, and says how far `emberlock scene` is from it; fails where
# that is more than `most` (0.01) of the range, RMS, or where `wrong`, a picture of another scene, isn't:
#   blender -b --factory-startup --python-exit-code 1 -P blender_draws_scene.py -- \
#     '{"scene": "/ABS/scene.json", "volumes": ["/ABS/flame.vdb", ...], "picture": "/ABS/out.exr", "image": [320, 180], "samples": 256,
#       "expected": "/ABS/frame-0000.exr", "most": 0.01, "wrong": "/ABS/other.exr"}'
# `volumes`: the scene's flames in their order, by `emberlock export --format blender4`.
import json
import os
import sys

import bpy
import numpy as np

sys.path.append(os.path.dirname(os.path.abspath(__file__)))
import blender_shared as shared  # noqa: E402

ask = json.loads(sys.argv[sys.argv.index("--") + 1])
np.bool = bool  # Debian 12 has a glTF importer older than its numpy
with open(ask["scene"]) as file:
    described = json.load(file)


def add_flame(path, flame):
    thing = shared.load_volume(path, ["emission", "density"])
    thing.data.render.space = "OBJECT"  # both are divided by the object's scale, as a scene file says
    thing.location = flame["position"]
    thing.rotation_mode = "XYZ"
    thing.rotation_euler = np.radians(flame["rotation"])
    thing.scale = (flame.get("scale", 1),) * 3
    shared.give_material(thing.data, shared.emission_material)


def add_geometry(path):
    """Its materials as Lambert's, of their base colour."""
    bpy.ops.import_scene.gltf(filepath=path)
    for material in bpy.data.materials:
        if material.name == "flame" or not material.use_nodes:
            continue
        nodes, links = material.node_tree.nodes, material.node_tree.links
        base = [n for n in nodes if n.type == "BSDF_PRINCIPLED"]
        if not base:
            continue
        colour = tuple(base[0].inputs["Base Color"].default_value)
        nodes.clear()
        diffuse = nodes.new("ShaderNodeBsdfDiffuse")
        diffuse.inputs["Color"].default_value = colour
        links.new(diffuse.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def set_up_render(scene):
    shared.set_up_render(scene, ask["picture"], ask["samples"], ask.get("step_rate", 1))
    cycles = scene.cycles
    cycles.filter_width = 1
    # Cycles goes one step farther than it is told: from a surface to a flame, but to no other surface.
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 0
    cycles.transmission_bounces = cycles.volume_bounces = 0
    cycles.transparent_max_bounces = 64
    cycles.sample_clamp_indirect = cycles.sample_clamp_direct = 0
    scene.render.threads_mode = "FIXED"
    scene.render.threads = ask.get("threads", 2)


def tell(name, off, scale):
    print(f"AGREEMENT {name}: {100 * np.sqrt(np.mean(off**2)) / scale:.3f} % of {255 * scale:.1f} grey levels (RMS), "
          f"mean {100 * off.mean() / scale:+.3f} %, worst {100 * np.abs(off).max() / scale:.2f} %")


for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)
for volume, flame in zip(ask["volumes"], described["flames"]):
    add_flame(volume, flame)
for geometry in described.get("geometry", []):
    add_geometry(os.path.join(os.path.dirname(ask["scene"]), geometry["file"]))
scene = bpy.context.scene
shared.place_camera(scene, described["camera"]["from"], described["camera"]["look_at"], *ask["image"])
set_up_render(scene)
bpy.ops.render.render(write_still=True)
seen, expected = shared.pixels(ask["picture"]), shared.pixels(ask["expected"])
off = expected - seen
full = seen.max() - seen.min()
tell("all pixels, of the range", off, full)
if "flames" in ask:  # the flames alone, without surfaces: where they aren't, surfaces are seen
    bare = shared.pixels(ask["flames"]).max(axis=2) <= 0
    tell("surfaces alone, of their range", off[bare], seen[bare].max() - seen[bare].min())
    tell("flames, of their range", off[~bare], seen[~bare].max() - seen[~bare].min())
    print(f"LIGHT on surfaces {100 * (expected[bare].sum() / seen[bare].sum() - 1):+.3f} %")
most = ask.get("most", 0.01)
if np.sqrt(np.mean(off**2)) > most * full:
    raise RuntimeError(f"emberlock scene differs by more than {100 * most} % of the range")
if "wrong" in ask:
    other = shared.pixels(ask["wrong"]) - seen
    tell("another scene", other, full)
    if np.sqrt(np.mean(other**2)) <= most * full:
        raise RuntimeError("another scene would have passed")
