"""Writes shapes as glTF 2.0: one .gltf beside one .bin.

In: shapes, material and node dictionaries. Out: files. Knows no geometry and no texture.
"""

import json
import struct

FLOAT, UNSIGNED_SHORT, UNSIGNED_INT = 5126, 5123, 5125


def short(value):
    """A number as it stands in the JSON text: five decimals are 10 micrometres."""
    return round(value, 5)


class File:
    """One glTF file under construction."""

    def __init__(self, name):
        self.name = name
        self.binary = bytearray()
        self.json = {
            "asset": {"version": "2.0", "generator": "Caustica projects/gallery/generate.py", "copyright": "CC0 1.0"},
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

    def _accessor(self, rows, kind, component, target):
        while len(self.binary) % 4:
            self.binary.append(0)
        start = len(self.binary)
        code = {FLOAT: "f", UNSIGNED_SHORT: "H", UNSIGNED_INT: "I"}[component]
        for row in rows:
            self.binary += struct.pack("<%d%s" % (len(row), code), *row)
        view = self._append(
            "bufferViews", {"buffer": 0, "byteOffset": start, "byteLength": len(self.binary) - start, "target": target}
        )
        accessor = {"bufferView": view, "componentType": component, "count": len(rows), "type": kind}
        return self._append("accessors", accessor)

    def geometry(self, shape):
        """Stores a shape; the result goes into mesh() as often as wanted."""
        position = self._accessor(shape.positions, "VEC3", FLOAT, 34962)
        # The bounds have to be those of the stored single-precision values.
        stored = [struct.unpack("<3f", struct.pack("<3f", *p)) for p in shape.positions]
        self.json["accessors"][position]["min"] = [min(p[i] for p in stored) for i in range(3)]
        self.json["accessors"][position]["max"] = [max(p[i] for p in stored) for i in range(3)]
        component = UNSIGNED_SHORT if len(shape.positions) < 65535 else UNSIGNED_INT
        return {
            "attributes": {
                "POSITION": position,
                "NORMAL": self._accessor(shape.normals, "VEC3", FLOAT, 34962),
                "TEXCOORD_0": self._accessor(shape.uvs, "VEC2", FLOAT, 34962),
            },
            "indices": self._accessor([(i,) for i in shape.indices], "SCALAR", component, 34963),
        }

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

    def write(self, folder):
        if self.binary:
            self.json["buffers"] = [{"uri": self.name + ".bin", "byteLength": len(self.binary)}]
            (folder / (self.name + ".bin")).write_bytes(self.binary)
        text = json.dumps(self.json, indent=1) + "\n"
        (folder / (self.name + ".gltf")).write_text(text, encoding="utf-8")
