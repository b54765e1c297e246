# SPDX-License-Identifier: Apache-2.0
# Writes the hall of docs/gallery.md: a floor, a wall, columns and two stands for flames.
#   python3 hall.py hall.gltf
import base64
import json
import math
import struct
import sys

STONE, IRON = [0.62, 0.56, 0.5], [0.12, 0.12, 0.13]


def prism(x, y, foot, top, low, high, sides):
    """A column that narrows from the radius `foot` to `top`; metres, z upwards."""
    rings = [[(x + r * math.cos(a), y + r * math.sin(a), z) for a in [2 * math.pi * (k + 0.5) / sides for k in range(sides)]]
             for r, z in ((foot, low), (top, high))]
    triangles = []
    for k in range(sides):
        a, b, c, d = rings[0][k], rings[0][k - 1], rings[1][k - 1], rings[1][k]
        triangles += [(a, c, b), (a, d, c), (rings[1][k], (x, y, high), rings[1][k - 1])]
    return triangles


def rectangle(corner, along, up):
    a, b = corner, [p + q for p, q in zip(corner, along)]
    d, c = [p + q for p, q in zip(corner, up)], [p + q for p, q in zip(b, up)]
    return [(a, b, c), (a, c, d)]


stone = rectangle([-12, -8, 0], [24, 0, 0], [0, 9, 0]) + rectangle([-12, 1, 0], [24, 0, 0], [0, 0, 5])
for x in (-3, -1.8, -0.6, 0.6, 1.8, 3):
    stone += prism(x, 0.75, 0.28, 0.28, 0, 0.2, 4) + prism(x, 0.75, 0.17, 0.14, 0.2, 5, 24)
iron = []
for x, y in ((-0.9, 0), (0.8, -0.3)):
    iron += prism(x, y, 0.16, 0.04, 0, 0.08, 24) + prism(x, y, 0.025, 0.025, 0.08, 0.75, 12) + prism(x, y, 0.04, 0.11, 0.75, 0.85, 24)

data, views, accessors, primitives = b"", [], [], []
for material, triangles in enumerate((stone, iron)):
    corners = [(x, z, -y) for triangle in triangles for x, y, z in triangle]  # glTF's y points up
    part = b"".join(struct.pack("<3f", *corner) for corner in corners)
    views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(part)})
    accessors.append({"bufferView": material, "componentType": 5126, "type": "VEC3", "count": len(corners)})
    primitives.append({"attributes": {"POSITION": material}, "material": material})
    data += part
gltf = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}],
        "materials": [{"doubleSided": True, "pbrMetallicRoughness": {"baseColorFactor": [*colour, 1], "metallicFactor": 0}} for colour in (STONE, IRON)],
        "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": len(data), "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]}
with open(sys.argv[1], "w") as file:
    json.dump(gltf, file)
