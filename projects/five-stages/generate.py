#!/usr/bin/env python3
"""Writes assets/stage.gltf: a floor of triangles and a perforated screen. Standard library only.

The holes of the screen are a mask in a texture, so that rays meet two triangles there and an any-hit shader decides.
"""

import base64
import json
import pathlib
import struct
import zlib

SIDE_PX = 256
HOLES = 8


def png(rows):
    """An RGBA picture, 8 bits a channel, as the bytes of a PNG file."""
    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 6, 0, 0, 0)
    raw = b"".join(b"\0" + b"".join(bytes(texel) for texel in row) for row in rows)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b"")


def screen():
    """Round holes in rows, with a rim at the edges."""
    def alpha(x, y):
        cell = SIDE_PX / HOLES
        u, v = (x + 0.5) / cell % 1.0 - 0.5, (y + 0.5) / cell % 1.0 - 0.5
        return 0 if u * u + v * v < 0.36 * 0.36 else 255

    return [[(205, 198, 180, alpha(x, y)) for x in range(SIDE_PX)] for y in range(SIDE_PX)]


def checks():
    """Squares of two greys."""
    shade = [(150, 150, 152, 255), (96, 98, 102, 255)]
    return [[shade[(x // 16 + y // 16) % 2] for x in range(SIDE_PX)] for y in range(SIDE_PX)]


def quad(corner, across, up):
    """Four corners and their normal: counter-clockwise seen from the front."""
    normal = [across[1] * up[2] - across[2] * up[1], across[2] * up[0] - across[0] * up[2], across[0] * up[1] - across[1] * up[0]]
    length = sum(x * x for x in normal) ** 0.5
    at = lambda a, b: [corner[i] + a * across[i] + b * up[i] for i in range(3)]
    return [at(0, 0), at(1, 0), at(1, 1), at(0, 1)], [x / length for x in normal]


def main():
    buffer, views, accessors, meshes = bytearray(), [], [], []

    def accessor(data, kind, component, count, **more):
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": len(data)})
        buffer.extend(data + b"\0" * (-len(data) % 4))
        accessors.append({"bufferView": len(views) - 1, "componentType": component, "count": count, "type": kind, **more})
        return len(accessors) - 1

    quads = [("Floor", quad([-6, 0, 6], [12, 0, 0], [0, 0, -12]), 0), ("Screen", quad([-2.6, 0.15, -0.2], [1.5, 0, 0.9], [0, 1.9, 0]), 1)]
    for name, (corners, normal), material in quads:
        low, high = ([f(c[i] for c in corners) for i in range(3)] for f in (min, max))
        pack = lambda rows: b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows)
        attributes = {
            "POSITION": accessor(pack(corners), "VEC3", 5126, 4, min=low, max=high),
            "NORMAL": accessor(pack([normal] * 4), "VEC3", 5126, 4),
            "TEXCOORD_0": accessor(pack([[0, 1], [1, 1], [1, 0], [0, 0]]), "VEC2", 5126, 4),
        }
        indices = accessor(struct.pack("<6H", 0, 1, 2, 0, 2, 3), "SCALAR", 5123, 6)
        meshes.append({"name": name, "primitives": [{"attributes": attributes, "indices": indices, "material": material}]})
    uri = lambda kind, data: f"data:{kind};base64,{base64.b64encode(bytes(data)).decode()}"
    matt = lambda index: {"baseColorTexture": {"index": index}, "metallicFactor": 0.0, "roughnessFactor": 0.7}
    stage = {
        "asset": {"version": "2.0", "generator": "projects/five-stages/generate.py"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": mesh["name"], "mesh": index} for index, mesh in enumerate(meshes)],
        "meshes": meshes,
        "materials": [
            {"name": "Checks", "pbrMetallicRoughness": matt(0)},
            {"name": "Perforated", "pbrMetallicRoughness": matt(1), "alphaMode": "MASK", "alphaCutoff": 0.5, "doubleSided": True},
        ],
        "textures": [{"source": 0}, {"source": 1}],
        "images": [{"uri": uri("image/png", png(checks()))}, {"uri": uri("image/png", png(screen()))}],
        "buffers": [{"byteLength": len(buffer), "uri": uri("application/octet-stream", buffer)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    folder = pathlib.Path(__file__).parent / "assets"
    folder.mkdir(exist_ok=True)
    (folder / "stage.gltf").write_text(json.dumps(stage, indent=1) + "\n")


main()
