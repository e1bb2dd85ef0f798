#!/usr/bin/env python3
"""A sphere of glass or brushed metal on a floor under a lamp, as a glTF file and as rendered by Mitsuba 3 (`pip install mitsuba numpy`).

    tests/reference/beside_mitsuba.py CASE SAMPLES        writes CASE.gltf and CASE.exr, 96 x 96 pixels

Mitsuba reads the same triangles. `rough_glass` differs by the Fresnel term from outside, which glTF approximates after Schlick.
"""
import base64
import json
import math
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

SIZE_PX, LAMP, SKY, FLOOR = 96, 8.0, 0.4, 0.5
EYE, DOWN_RAD, FOV_DEG = (0.0, 0.5, 4.5), 0.1, 40.0
TINT = [0.3, 0.8, 0.5]  # what is left of light after a metre
ROUGHNESS = {"smooth_glass": 0.0, "rough_glass": 0.4, "brushed_metal": 0.5}
ANISOTROPY = 0.7


def sphere(columns=96, rows=48):
    """Positions, normals, texture coordinates, tangents (along the parallels), indices."""
    grid = [(math.pi * j / rows, 2 * math.pi * i / columns) for j in range(rows + 1) for i in range(columns + 1)]
    p = [(math.sin(t) * math.cos(f), math.cos(t), math.sin(t) * math.sin(f)) for t, f in grid]
    uv = [(f / (2 * math.pi), t / math.pi) for t, f in grid]
    tangents = [(-math.sin(f), 0, math.cos(f), 1) for _, f in grid]
    indices = []
    for j in range(rows):
        for i in range(columns):
            a = j * (columns + 1) + i
            c = a + columns + 1
            indices += [a, a + 1, c] if j else []
            indices += [a + 1, c + 1, c] if j < rows - 1 else []
    return np.float32(p), np.float32(p), np.float32(uv), np.float32(tangents), np.uint32(indices)


def sheet(half, y, up):
    p = np.float32([[-half, y, -half], [half, y, -half], [half, y, half], [-half, y, half]])
    order = [0, 2, 1, 0, 3, 2] if up else [0, 1, 2, 0, 2, 3]
    n = np.float32([[0, 1 if up else -1, 0]] * 4)
    return p, n, np.float32([[0, 0], [1, 0], [1, 1], [0, 1]]), np.float32([[1, 0, 0, 1]] * 4), np.uint32(order)


def shapes():
    lamp = sheet(1.0, 0.0, False)
    return sphere(), (lamp[0] + np.float32([2, 4, 1]), *lamp[1:]), sheet(6.0, -1.001, True)


def material(case):
    pbr = {"baseColorFactor": [1, 1, 1, 1], "metallicFactor": 0, "roughnessFactor": ROUGHNESS[case]}
    if case == "brushed_metal":
        pbr["metallicFactor"] = 1
        return pbr, {"KHR_materials_anisotropy": {"anisotropyStrength": ANISOTROPY}}
    volume = {"thicknessFactor": 1, "attenuationColor": TINT, "attenuationDistance": 1.0}
    return pbr, {
        "KHR_materials_transmission": {"transmissionFactor": 1},
        "KHR_materials_ior": {"ior": 1.5},
        "KHR_materials_volume": volume,
    }


def write_gltf(case):
    blob, views, accessors, meshes = b"", [], [], []

    def add(array, kind, component, target):
        nonlocal blob
        views.append({"buffer": 0, "byteOffset": len(blob), "byteLength": array.nbytes, "target": target})
        blob += array.tobytes()
        accessor = {"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind}
        if kind == "VEC3":
            accessor |= {"min": array.min(0).tolist(), "max": array.max(0).tolist()}
        accessors.append(accessor)
        return len(accessors) - 1

    for number, (p, n, uv, tangents, indices) in enumerate(shapes()):
        named = [("POSITION", p, "VEC3"), ("NORMAL", n, "VEC3"), ("TEXCOORD_0", uv, "VEC2"), ("TANGENT", tangents, "VEC4")]
        attributes = {name: add(array, kind, 5126, 34962) for name, array, kind in named}
        primitive = {"attributes": attributes, "indices": add(indices, "SCALAR", 5125, 34963), "material": number}
        meshes.append({"primitives": [primitive]})
    dull = {"KHR_materials_specular": {"specularFactor": 0}}
    pbr, extensions = material(case)
    grey = lambda x: {"baseColorFactor": [x, x, x, 1], "roughnessFactor": 1, "metallicFactor": 0}
    shining = {"emissiveFactor": [1, 1, 1], "extensions": dull | {"KHR_materials_emissive_strength": {"emissiveStrength": LAMP}}}
    materials = [
        {"pbrMetallicRoughness": pbr, "extensions": extensions},
        {"pbrMetallicRoughness": grey(0.0), **shining},
        {"pbrMetallicRoughness": grey(FLOOR), "extensions": dull},
    ]
    camera = {"type": "perspective", "perspective": {"yfov": math.radians(FOV_DEG), "znear": 0.1}}
    turned = [math.sin(-DOWN_RAD / 2), 0, 0, math.cos(DOWN_RAD / 2)]
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": sorted({name for m in materials for name in m.get("extensions", {})}),
        "buffers": [{"byteLength": len(blob), "uri": "data:application/octet-stream;base64," + base64.b64encode(blob).decode()}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": meshes,
        "materials": materials,
        "cameras": [camera],
        "nodes": [{"mesh": 0}, {"mesh": 1}, {"mesh": 2}, {"camera": 0, "translation": EYE, "rotation": turned}],
        "scenes": [{"nodes": [0, 1, 2, 3], "extras": {"environment": {"constantRadiance": [SKY] * 3}}}],
        "scene": 0,
    }
    with open(f"{case}.gltf", "w") as file:
        json.dump(document, file)


def mitsuba_shape(name, arrays, more):
    p, n, uv, _, indices = arrays
    mesh = mi.Mesh(name, len(p), len(indices) // 3, has_vertex_normals=True, has_vertex_texcoords=True)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"], parameters["vertex_normals"] = p.ravel(), n.ravel()
    parameters["vertex_texcoords"], parameters["faces"] = uv.ravel(), indices.ravel()
    parameters.update()
    mesh.write_ply(f"{name}.ply")
    return {"type": "ply", "filename": f"{name}.ply", **more}


def mitsuba_material(case):
    alpha = ROUGHNESS[case] ** 2
    if case == "brushed_metal":
        along = alpha + (1 - alpha) * ANISOTROPY**2
        return {"bsdf": {"type": "roughconductor", "material": "none", "distribution": "ggx", "alpha_u": along, "alpha_v": alpha}}
    glass = {"int_ior": 1.5, "ext_ior": 1.0}
    kind = {"type": "roughdielectric", "distribution": "ggx", "alpha": alpha} if alpha > 0 else {"type": "dielectric"}
    extinction = {"type": "rgb", "value": [-math.log(x) / 2 for x in TINT]}
    return {"bsdf": kind | glass, "interior": {"type": "homogeneous", "albedo": 0.0, "sigma_t": extinction, "scale": 2.0}}


def render(case, samples):
    place = mi.ScalarTransform4f().translate(list(EYE)).rotate([1, 0, 0], -math.degrees(DOWN_RAD)).rotate([0, 1, 0], 180)
    film = {"type": "hdrfilm", "width": SIZE_PX, "height": SIZE_PX, "rfilter": {"type": "box"}, "component_format": "float32"}
    ball, lamp, floor = shapes()
    grey = lambda x: {"type": "diffuse", "reflectance": x}
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 64},
        "sensor": {"type": "perspective", "fov": FOV_DEG, "fov_axis": "y", "near_clip": 0.01, "to_world": place, "film": film},
        "sky": {"type": "constant", "radiance": {"type": "rgb", "value": SKY}},
        "ball": mitsuba_shape("ball", ball, mitsuba_material(case)),
        "lamp": mitsuba_shape("lamp", lamp, {"emitter": {"type": "area", "radiance": {"type": "rgb", "value": LAMP}}, "bsdf": grey(0.0)}),
        "floor": mitsuba_shape("floor", floor, {"bsdf": {"type": "twosided", "material": grey(FLOOR)}}),
    })
    mi.Bitmap(np.array(mi.render(scene, spp=samples, seed=1))).write(f"{case}.exr")


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in ROUGHNESS:
        sys.exit(f"usage: {sys.argv[0]} {'|'.join(ROUGHNESS)} SAMPLES")
    write_gltf(sys.argv[1])
    render(sys.argv[1], int(sys.argv[2]))
