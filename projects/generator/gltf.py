"""Writes shapes as glTF 2.0: one .gltf beside one .bin.

In: shapes, material and node dictionaries. Out: files. Knows no geometry and no texture.
"""

import json
import math
import struct

from generator import shapes

FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125


def short(value):
    """A number as it stands in the JSON text: five decimals are 10 micrometres."""
    return round(value, 5)


def look_at(eye, target):
    """Rotation (x, y, z, w) that turns -Z towards the target and keeps +Y up."""
    z = shapes.unit(shapes.sub(eye, target))
    x = shapes.unit(shapes.cross((0.0, 1.0, 0.0), z))
    y = shapes.cross(z, x)
    w = math.sqrt(max(0.0, 1 + x[0] + y[1] + z[2])) / 2
    if w > 1e-3:
        q = ((y[2] - z[1]) / (4 * w), (z[0] - x[2]) / (4 * w), (x[1] - y[0]) / (4 * w), w)
    else:
        raise ValueError("a camera that looks straight back needs the other branch")
    return [round(c, 7) for c in q]


class File:
    """One glTF file under construction; made_by is the script, from the root of the repository."""

    def __init__(self, made_by, name):
        self.name = name
        self.binary = bytearray()
        self.json = {
            "asset": {"version": "2.0", "generator": "Caustica " + made_by, "copyright": "CC0 1.0"},
            "scene": 0,
            "scenes": [{"name": name, "nodes": []}],
            "nodes": [],
        }

    def _append(self, key, value):
        items = self.json.setdefault(key, [])
        items.append(value)
        return len(items) - 1

    def _use(self, extension):
        used = self.json.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)
            used.sort()

    def _accessor(self, rows, kind, component, target=None):
        while len(self.binary) % 4:
            self.binary.append(0)
        start = len(self.binary)
        code = {FLOAT: "f", UNSIGNED_SHORT: "H", UNSIGNED_INT: "I"}[component]
        for row in rows:
            self.binary += struct.pack("<%d%s" % (len(row), code), *row)
        fields = {"buffer": 0, "byteOffset": start, "byteLength": len(self.binary) - start}
        view = self._append("bufferViews", dict(fields, target=target) if target else fields)
        accessor = {"bufferView": view, "componentType": component, "count": len(rows), "type": kind}
        return self._append("accessors", accessor)

    def _bounded(self, rows, kind, target=None):
        """Floats with their bounds, which have to be those of the stored single-precision values."""
        index = self._accessor(rows, kind, FLOAT, target)
        width = len(rows[0])
        stored = [struct.unpack("<%df" % width, struct.pack("<%df" % width, *row)) for row in rows]
        self.json["accessors"][index]["min"] = [min(row[i] for row in stored) for i in range(width)]
        self.json["accessors"][index]["max"] = [max(row[i] for row in stored) for i in range(width)]
        return index

    def geometry(self, shape, colors=None):
        """Stores a shape; the result goes into mesh() as often as wanted. colors: linear RGB, one a vertex."""
        position = self._bounded(shape.positions, "VEC3", 34962)
        component = UNSIGNED_SHORT if len(shape.positions) < 65535 else UNSIGNED_INT
        attributes = {
            "POSITION": position,
            "NORMAL": self._accessor(shape.normals, "VEC3", FLOAT, 34962),
            "TEXCOORD_0": self._accessor(shape.uvs, "VEC2", FLOAT, 34962),
        }
        if colors:
            attributes["COLOR_0"] = self._accessor(colors, "VEC3", FLOAT, 34962)
        indices = self._accessor([(i,) for i in shape.indices], "SCALAR", component, 34963)
        return {"attributes": attributes, "indices": indices}

    def texture(self, image):
        """A repeating, trilinear texture of an image file beside this one."""
        samplers = self.json.setdefault("samplers", [])
        if not samplers:
            samplers.append({"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497})
        images = self.json.setdefault("images", [])
        uris = [i["uri"] for i in images]
        if image in uris:
            return {"index": uris.index(image)}
        images.append({"uri": image, "name": image.rsplit(".", 1)[0]})
        return {"index": self._append("textures", {"sampler": 0, "source": len(images) - 1})}

    def material(self, name, color=(1.0, 1.0, 1.0), metallic=0.0, roughness=0.5, extensions=None, **more):
        """A metallic-roughness material. `more` may hold base, normal, orm (image names), normal_scale,
        emissive."""
        pbr = {
            "baseColorFactor": [short(c) for c in color] + [1.0],
            "metallicFactor": metallic,
            "roughnessFactor": roughness,
        }
        out = {"name": name, "pbrMetallicRoughness": pbr}
        if "base" in more:
            pbr["baseColorTexture"] = self.texture(more["base"])
        if "orm" in more:
            pbr["metallicRoughnessTexture"] = self.texture(more["orm"])
        if "normal" in more:
            out["normalTexture"] = dict(self.texture(more["normal"]), scale=more.get("normal_scale", 1.0))
        if "emissive" in more:
            out["emissiveFactor"] = list(more["emissive"])
        if extensions:
            out["extensions"] = extensions
            for extension in extensions:
                self._use(extension)
        return self._append("materials", out)

    def mesh(self, name, *parts):
        """Parts are (geometry, material)."""
        primitives = [dict(geometry, material=material) for geometry, material in parts]
        return self._append("meshes", {"name": name, "primitives": primitives})

    def light(self, name, kind, color, intensity, extras, spot=None):
        """KHR_lights_punctual: candela for point and spot, lux for directional."""
        self._use("KHR_lights_punctual")
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        light = {"name": name, "type": kind, "color": list(color), "intensity": intensity, "extras": extras}
        if spot:
            light["spot"] = spot
        lights.append(light)
        return {"KHR_lights_punctual": {"light": len(lights) - 1}}

    def camera(self, name, yfov_rad, near_m, far_m):
        perspective = {"aspectRatio": 16 / 9, "yfov": short(yfov_rad), "znear": near_m, "zfar": far_m}
        return self._append("cameras", {"name": name, "type": "perspective", "perspective": perspective})

    def node(self, name, parent=None, **fields):
        index = self._append("nodes", dict({"name": name}, **fields))
        if parent is None:
            self.json["scenes"][0]["nodes"].append(index)
        else:
            self.json["nodes"][parent].setdefault("children", []).append(index)
        return index

    def spin(self, name, turns, seconds):
        """A clip in which each node of (node, whole turns) turns about its Y axis, evenly."""
        animation = {"name": name, "samplers": [], "channels": []}
        for node, count in turns:
            # Four keys a turn: rotations are interpolated along the shorter way.
            keys = 4 * abs(count)
            times = [(seconds * i / keys,) for i in range(keys + 1)]
            halves = [math.copysign(math.pi / 4 * i, count) for i in range(keys + 1)]
            rotations = [(0.0, math.sin(half), 0.0, math.cos(half)) for half in halves]
            sampler = {"input": self._bounded(times, "SCALAR"), "output": self._accessor(rotations, "VEC4", FLOAT)}
            animation["samplers"].append(sampler)
            target = {"node": node, "path": "rotation"}
            animation["channels"].append({"sampler": len(animation["samplers"]) - 1, "target": target})
        self._append("animations", animation)

    def write(self, folder):
        if self.binary:
            self.json["buffers"] = [{"uri": self.name + ".bin", "byteLength": len(self.binary)}]
            (folder / (self.name + ".bin")).write_bytes(self.binary)
        text = json.dumps(self.json, indent=1) + "\n"
        (folder / (self.name + ".gltf")).write_text(text, encoding="utf-8")
