# SPDX-License-Identifier: Apache-2.0
# Exports a scene for `emberlock scene`: a textured floor, a smooth head, a camera, and an empty that a flame stands at:
#   blender -b --factory-startup --python-exit-code 1 -P blender_exports_scene.py -- OUT.glb RESULT
import sys

import bpy
import numpy as np

out, result = sys.argv[sys.argv.index("--") + 1:]
np.bool = bool  # Debian 12 has a glTF exporter older than its numpy
for thing in list(bpy.data.objects):
    bpy.data.objects.remove(thing)


def material(name, colour=None, image=None):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    base = made.node_tree.nodes["Principled BSDF"]
    base.inputs["Roughness"].default_value = 1
    if colour:
        base.inputs["Base Color"].default_value = colour
    if image:
        texture = made.node_tree.nodes.new("ShaderNodeTexImage")
        texture.image = image
        made.node_tree.links.new(texture.outputs["Color"], base.inputs["Base Color"])
    return made


chequers = bpy.data.images.new("chequers", 64, 64)
y, x = np.mgrid[:64, :64] // 8
chequers.pixels[:] = np.repeat((0.1 + 0.8 * ((x + y) % 2)).ravel(), 4).tolist()
chequers.pack()
bpy.ops.mesh.primitive_plane_add(size=3)
bpy.context.object.data.materials.append(material("floor", image=chequers))
bpy.ops.mesh.primitive_monkey_add(size=0.4, location=(0.45, 0.1, 0.25))
bpy.ops.object.shade_smooth()
bpy.context.object.data.materials.append(material("head", (0.7, 0.5, 0.3, 1)))
bpy.ops.object.empty_add(location=(0, 0, 0))
bpy.context.object["emberlock_flame"] = result
bpy.ops.object.camera_add(location=(0.3, -1.8, 0.8), rotation=(1.25, 0, 0.1))
bpy.ops.export_scene.gltf(filepath=out, export_format="GLB", export_cameras=True, export_extras=True)
