# SPDX-License-Identifier: Apache-2.0
# What both blender_draws.py and blender_draws_scene.py do.
import os

import bpy
import mathutils
import numpy as np

WHITE = 255  # grey levels


def load_volume(path, grids):
    """An object in the scene. Blender itself draws a missing or unreadable file as black."""
    if not os.path.isabs(path) or not os.path.isfile(path):
        raise SystemExit(f"no file with an absolute path: {path}")
    data = bpy.data.volumes.new("flame")
    data.filepath = path
    if not data.grids.load() or data.grids.error_message:
        raise RuntimeError(f"Blender can't read {path}: {data.grids.error_message}")
    missing = set(grids) - {grid.name for grid in data.grids}
    if missing:
        raise RuntimeError(f"{path} has no grids {missing}")
    data.render.precision = "FULL"  # else half floats
    data.render.clipping = 0
    flame = bpy.data.objects.new("flame", data)
    bpy.context.collection.objects.link(flame)
    return flame


def give_material(data, make):
    material = bpy.data.materials.new("flame")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    make(nodes, material.node_tree.links, nodes.new("ShaderNodeOutputMaterial"))
    data.materials.append(material)


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


def place_camera(scene, eye, at, width, height):
    """`emberlock render --camera FROM --look-at AT`: 40 degrees across the shorter side, +z up."""
    eye, at = mathutils.Vector(eye), mathutils.Vector(at)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "HORIZONTAL" if width <= height else "VERTICAL"
    camera.angle = np.radians(40)
    camera.clip_start = 1e-4
    scene.camera = bpy.data.objects.new("camera", camera)
    scene.camera.location = eye
    scene.camera.rotation_euler = (at - eye).to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(scene.camera)
    scene.render.resolution_x, scene.render.resolution_y = width, height


def set_up_render(scene, picture, samples, step_rate):
    """What is the same in all pictures: each pixel for itself, small steps, and no light but the scene's."""
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.pixel_filter_type = "BOX"
    scene.cycles.volume_step_rate = step_rate
    scene.cycles.volume_max_steps = 65536
    world = bpy.data.worlds.new("nothing")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0, 0, 0, 1)
    scene.world = world
    exr = picture.endswith(".exr")
    scene.view_settings.view_transform = "Raw" if exr else "Standard"
    scene.render.image_settings.file_format = "OPEN_EXR" if exr else "PNG"
    if exr:
        scene.render.image_settings.color_depth = "32"
    scene.render.filepath = picture


def pixels(path):
    """Height x width x RGB, as the file has them."""
    image = bpy.data.images.load(path)
    image.colorspace_settings.name = "Raw" if path.endswith(".exr") else image.colorspace_settings.name
    return np.array(image.pixels[:], dtype=np.float64).reshape(image.size[1], image.size[0], -1)[..., :3]
