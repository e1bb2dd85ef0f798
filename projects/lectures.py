#!/usr/bin/env python3
"""Makes the projects of the lectures: for each its glTF file, its project file, and no README.

Python 3, standard library only, deterministic. Run `python3 projects/lectures.py`; it rewrites
projects/lecture-*/assets and the .caustica.json beside it. Metres, Y up, exposure 0 EV.
"""

import json
import math
import pathlib
import sys

sys.dont_write_bytecode = True  # leaves no __pycache__ in the project

from generator import shapes, textures  # noqa: E402
from generator.gltf import File, look_at  # noqa: E402
from generator.shapes import Shape, add, bend, box, curve, lathe, sub, unit  # noqa: E402

PROJECTS = pathlib.Path(__file__).resolve().parent
MADE_BY = "projects/lectures.py"
UNLIT = {"KHR_materials_unlit": {}}

CORAL, AMBER, TEAL, BLUE = (0.80, 0.20, 0.13), (0.85, 0.47, 0.07), (0.05, 0.42, 0.38), (0.08, 0.20, 0.60)
CREAM, BRASS = (0.76, 0.70, 0.60), (0.89, 0.66, 0.34)


# ---- files ------------------------------------------------------------------------------------


def lecture(number, topic):
    """An empty glTF file of a lecture."""
    f = File(MADE_BY, topic.replace("-", "_"))
    f.folder = PROJECTS / f"lecture-{number:02}-{topic}"
    f.topic = topic
    return f


def write(f, environment, render, without_shadow=()):
    """The assets and the project: one instance of the file, seen by its node "Camera". environment: radiance."""
    assets = f.folder / "assets"
    assets.mkdir(parents=True, exist_ok=True)
    f.write(assets)
    counts = [len(f.json.get(key, [])) for key in ("meshes", "materials", "textures")]
    ids = iter(range(2, 2 + sum(counts)))
    meshes, materials, textures_ids = ([next(ids) for _ in range(count)] for count in counts)
    node = {"id": 2 + sum(counts), "name": f.topic.replace("-", " ").capitalize(), "prefab": 1}
    if without_shadow:
        visibility = {"cameraVisible": True, "castsShadows": False}
        node["overrides"] = {part: {"rayVisibility": visibility} for part in without_shadow}
    project = {
        "caustica": 1,
        "nextId": node["id"] + 1,
        "prefabs": [
            {
                "id": 1,
                "name": f.name,
                "source": f"assets/{f.name}.gltf",
                "meshes": meshes,
                "materials": materials,
                "textures": textures_ids,
            }
        ],
        "nodes": [node],
        "environment": {"kind": "constant", "radiance": list(environment)},
        "camera": {"node": node["id"], "part": f.camera_part},
        "view": {},
        "render": render,
    }
    path = f.folder / f"{f.topic}.caustica.json"
    path.write_text(json.dumps(project, indent=2) + "\n", encoding="utf-8")


def camera(f, eye, target, yfov_deg, name="Camera"):
    if name == "Camera":
        f.camera_part = name
    f.node(name, camera=f.camera(name, math.radians(yfov_deg), 0.02, 100.0), translation=list(eye), rotation=look_at(eye, target))


def lamp(f, name, at, color, candela, radius_m):
    f.node(name, translation=list(at), extensions=f.light(name, "point", color, candela, {"radius": radius_m}))


def sun(f, towards, color, lux, angle_deg):
    """towards: from the scene to the sun."""
    extensions = f.light("Sun", "directional", color, lux, {"angle": angle_deg})
    f.node("Sun", translation=[4 * c for c in unit(towards)], rotation=look_at(towards, (0, 0, 0)), extensions=extensions)


def put(f, name, shape, material, parent=None, colors=None, **fields):
    return f.node(name, parent, mesh=f.mesh(name, (f.geometry(shape, colors), material)), **fields)


# ---- shapes -----------------------------------------------------------------------------------


def no_uv(_):
    return (0.0, 0.0)


def face(shape, *corners):
    """One flat polygon with its own normal, as a fan."""
    normal = shapes.cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]))
    ids = [shape.vertex(p, normal, (0.0, 0.0)) for p in corners]
    for b, c in zip(ids[1:], ids[2:]):
        shape.triangle(ids[0], b, c)


def triangles_of(shape):
    corners = [shape.positions[i] for i in shape.indices]
    return list(zip(corners[0::3], corners[1::3], corners[2::3]))


def faceted(shape):
    """The same triangles, each with the normal of its plane."""
    out = Shape()
    for triangle in triangles_of(shape):
        face(out, *triangle)
    return out


def icosphere(radius, levels):
    """An icosahedron, each triangle cut into four as often as said; flat."""
    g = (1 + math.sqrt(5)) / 2
    corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    text = "0b5 051 017 07a 0ab 159 5b4 ba2 a76 718 394 342 326 368 389 495 24b 62a 867 981"
    faces = [tuple(unit(corners[int(c, 16)]) for c in word) for word in text.split()]
    for _ in range(levels):
        finer = []
        for a, b, c in faces:
            ab, bc, ca = (unit(add(p, q)) for p, q in ((a, b), (b, c), (c, a)))
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    out = Shape()
    for triangle in faces:
        face(out, *(tuple(radius * x for x in p) for p in triangle))
    return out


def rod(a, b, radius, sides=8):
    """A round rod from point to point, without ends."""
    along = unit(sub(b, a))
    side = unit(shapes.cross(along, (0.0, 1.0, 0.0) if abs(along[1]) < 0.9 else (1.0, 0.0, 0.0)))
    up = shapes.cross(side, along)
    out = Shape()
    for end in (a, b):
        for i in range(sides + 1):
            turn = 2 * math.pi * (i % sides) / sides
            normal = tuple(math.cos(turn) * s - math.sin(turn) * u for s, u in zip(side, up))
            out.vertex(add(end, tuple(radius * n for n in normal)), normal, (0.0, 0.0))
    out.grid(sides, 1)
    return out


def ring(radius, tube, segments=96, sides=12):
    """A torus about Y."""
    turns = [-2 * math.pi * i / sides for i in range(sides + 1)]
    profile = [(radius + tube * math.cos(t), -tube * math.sin(t)) for t in turns]
    return lathe(profile, segments)


def ball(radius):
    return shapes.sphere(radius, 64, 32)


def upright(shape):
    """Turned from the axis Y to the axis Z."""
    turn = lambda p: (p[0], -p[2], p[1])  # noqa: E731
    shape.positions, shape.normals = [turn(p) for p in shape.positions], [turn(n) for n in shape.normals]
    return shape


def backdrop(f, color, width=60.0, front=8.0, back=-5.0, height=9.0, bend_m=3.0):
    """A floor that bends up into a wall, as in a photographer's studio."""
    arc = [(back + bend_m * (1 - math.sin(t)), bend_m * (1 - math.cos(t)), t) for t in (math.pi / 2 * i / 16 for i in range(17))]
    profile = [(front, 0.0, 0.0)] + arc + [(back, height, math.pi / 2)]
    out = Shape()
    for z, y, turn in profile:
        for x in (-width / 2, width / 2):
            out.vertex((x, y, z), (0.0, math.cos(turn), math.sin(turn)), (0.0, 0.0))
    out.grid(1, len(profile) - 1)
    put(f, "Backdrop", out, f.material("Backdrop", color, roughness=0.9))


# ---- the lectures -----------------------------------------------------------------------------

SKY_BLUE = (0.38, 0.55, 0.70)
EYE, PLANE_M = (-2.3, 1.0, 0.0), 1.1
SPHERES = (((1.1, 0.75, -0.25), 0.75, CORAL), ((1.9, 0.5, 1.0), 0.5, AMBER), ((0.55, 0.32, 0.8), 0.32, BLUE))


def first_hit(direction):
    """What a ray from EYE meets: its point, its colour as a painter of tiles sees it, and whether it is near."""
    best, color = 1e9, SKY_BLUE
    if direction[1] < 0:
        best, color = -EYE[1] / direction[1], tuple(0.75 * c for c in SKY_BLUE)
    for centre, radius, paint in SPHERES:
        to = sub(EYE, centre)
        b, c = shapes.dot(direction, to), shapes.dot(to, to) - radius * radius
        t = -b - math.sqrt(max(b * b - c, 0.0))
        if b * b > c and t < best:
            normal = unit(sub(add(EYE, tuple(t * d for d in direction)), centre))
            shade = 0.35 + 0.65 * max(0.0, shapes.dot(normal, unit((-0.5, 1.0, 0.6))))
            best, color = t, tuple(shade * p for p in paint)
    return add(EYE, tuple(best * d for d in direction)), color, best < 4.2


def camera_rays():
    """A camera seen from outside: its image plane in tiles, and the rays through them."""
    f = lecture(1, "camera-rays")
    backdrop(f, SKY_BLUE)
    for (centre, radius, paint), name in zip(SPHERES, ("Large", "Middle", "Small")):
        put(f, f"{name} sphere", ball(radius), f.material(f"{name} paint", paint, roughness=0.35), translation=list(centre))
    tiles, rays, tile_colors, ray_colors = Shape(), Shape(), [], []
    step = 0.072
    for row in range(9):
        for column in range(16):
            y, z = EYE[1] + (4 - row) * step, (column - 7.5) * step
            at = (EYE[0] + PLANE_M, y, z)
            hit, color, near = first_hit(unit(sub(at, EYE)))
            half = 0.44 * step
            tiles.add(box((at[0] - 0.006, y - half, z - half), (at[0] + 0.006, y + half, z + half)))
            tile_colors += [color] * (len(tiles.positions) - len(tile_colors))
            if near and row % 2 == 0 and column % 2 == 0:
                rays.add(rod(EYE, hit, 0.007))
                ray_colors += [color] * (len(rays.positions) - len(ray_colors))
    glow = f.material("As it is seen", (1.0, 1.0, 1.0), extensions=UNLIT)
    put(f, "Image plane", tiles, glow, colors=tile_colors)
    put(f, "Rays", rays, glow, colors=ray_colors)
    black = f.material("Camera black", (0.03, 0.03, 0.035), roughness=0.4)
    body = shapes.rounded_box((0.5, 0.42, 0.6), 0.05)
    put(f, "Camera body", body, black, translation=[EYE[0] - 0.33, EYE[1], 0])
    lens = lathe([(0.0, -0.08), (0.15, -0.08), (0.15, 0.06), (0.11, 0.06), (0.09, 0.0), (0.0, 0.0)], 48, smooth=False)
    turned = [0, 0, -math.sqrt(0.5), math.sqrt(0.5)]
    put(f, "Lens", lens, black, translation=[EYE[0] - 0.05, EYE[1], 0], rotation=turned)
    frame, tall, wide, bar = Shape(), 4.5 * step, 8 * step, 0.02
    for y, z, height, depth in ((tall + bar, 0, bar, wide + 2 * bar), (-tall - bar, 0, bar, wide + 2 * bar), (0, wide + bar, tall, bar), (0, -wide - bar, tall, bar)):
        frame.add(box((-0.015, y - height, z - depth), (0.015, y + height, z + depth)))
    put(f, "Frame", frame, black, translation=[EYE[0] + PLANE_M, EYE[1], 0])
    tripod = Shape()
    for x, z in ((-0.45, 0.0), (0.25, 0.4), (0.25, -0.4)):
        tripod.add(rod((EYE[0] - 0.33, 0.8, 0), (EYE[0] - 0.33 + x, 0.0, z), 0.022))
    put(f, "Tripod", tripod, black)
    camera(f, (-3.2, 2.5, 3.9), (-0.55, 0.70, 0.1), 39)
    camera(f, EYE, add(EYE, (1.0, 0.0, 0.0)), math.degrees(2 * math.atan(4.5 * step / PLANE_M)), "Pinhole")
    sun(f, (-0.5, 1.0, 0.6), (1.0, 0.95, 0.87), 2.2, 1.5)
    write(f, (0.45, 0.50, 0.58), {"pipeline": "raytraced"}, ["Rays", "Image plane"])


def triangle_mesh():
    """From one triangle to 20, 80 and 320."""
    f = lecture(2, "triangle-mesh")
    backdrop(f, (0.70, 0.72, 0.74))
    one = Shape()
    face(one, (-0.62, 0.0, 0.0), (0.62, 0.0, 0.0), (0.0, 1.1, 0.0))
    put(f, "1 triangle", one, f.material("Coral", CORAL, roughness=0.5), translation=[-2.5, 0.003, 0], rotation=[0, 0.1305262, 0, 0.9914449])
    for name, paint, level, x in (("20 triangles", AMBER, 0, -0.9), ("80 triangles", TEAL, 1, 0.75), ("320 triangles", BLUE, 2, 2.4)):
        body = icosphere(0.68, level)
        put(f, name, body, f.material(name, paint, roughness=0.45), translation=[x, round(-body.lowest(), 5), 0])
    camera(f, (0.0, 1.75, 7.0), (0.0, 0.66, 0.0), 28)
    sun(f, (-0.7, 1.1, 0.75), (1.0, 0.94, 0.85), 2.4, 2.0)
    write(f, (0.42, 0.46, 0.52), {"pipeline": "raytraced"})


def vertex_data():
    """One vase of few triangles, with more in its vertices from left to right."""
    f = lecture(3, "vertex-data")
    backdrop(f, (0.74, 0.72, 0.70))
    outer = curve([(0.24, 0.0), (0.40, 0.30), (0.47, 0.62), (0.30, 0.98), (0.17, 1.20), (0.25, 1.42)], 2)
    vase = lathe([(0.0, 0.0)] + outer, 14, (6.0, 5.0)).add(lathe([(0.25, 1.42), (0.22, 1.415), (0.11, 1.20), (0.0, 1.10)], 14))
    grey = f.material("Clay", (0.62, 0.56, 0.50), roughness=0.4)
    white = f.material("Glaze", (1.0, 1.0, 1.0), roughness=0.4)
    checker(f)
    tiled = f.material("Checked glaze", (1.0, 1.0, 1.0), roughness=0.4, base="checker.png")

    def hue(p):
        turn = math.atan2(p[2], p[0])
        wheel = [0.5 + 0.5 * math.cos(turn - 2 * math.pi * i / 3) for i in range(3)]
        return tuple(0.05 + 0.8 * (0.25 + 0.75 * p[1] / 1.42) * c for c in wheel)

    put(f, "Positions", faceted(vase), grey, translation=[-2.1, 0, 0])
    put(f, "Normals", vase, grey, translation=[-0.7, 0, 0])
    put(f, "Colours", vase, white, colors=[hue(p) for p in vase.positions], translation=[0.7, 0, 0])
    put(f, "Texture coordinates", vase, tiled, translation=[2.1, 0, 0])
    camera(f, (0.0, 1.95, 6.6), (0.0, 0.70, 0.0), 27)
    sun(f, (-0.8, 1.0, 0.8), (1.0, 0.94, 0.86), 2.4, 2.0)
    write(f, (0.42, 0.45, 0.50), {"pipeline": "raytraced"})


def checker(f):
    size, pixels = 64, []
    for y in range(size):
        for x in range(size):
            pixels += (38, 70, 120) if (x // 32 + y // 32) % 2 else (235, 225, 205)
    assets = f.folder / "assets"
    assets.mkdir(parents=True, exist_ok=True)
    textures.write_png(assets / "checker.png", size, 3, pixels)


def orbit():
    """A model of the planets that turns, and a camera on an arm that goes round it."""
    f = lecture(4, "orbit")
    backdrop(f, (0.10, 0.12, 0.20))
    brass = f.material("Brass", BRASS, metallic=1.0, roughness=0.25)
    foot = bend([(0.0, 0.0), (0.5, 0.0), (0.5, 0.05), (0.12, 0.12), (0.04, 0.3), (0.04, 0.9), (0.0, 0.9)], 0.04)
    put(f, "Foot", lathe(foot, 64), brass)
    glow = f.material("Sunshine", (1.0, 0.83, 0.45), extensions=UNLIT)
    put(f, "Sun", ball(0.24), glow, translation=[0, 1.14, 0])
    turns = []
    for name, paint, radius, arm, height, count, start in (
        ("Mercury", (0.45, 0.40, 0.36), 0.07, 0.55, 0.86, 4, 0.6),
        ("Venus", AMBER, 0.12, 0.90, 0.78, 3, 2.9),
        ("Earth", (0.07, 0.25, 0.62), 0.14, 1.32, 0.70, 2, 5.3),
        ("Saturn", CREAM, 0.22, 1.95, 0.62, 1, 0.35),
    ):
        hub = f.node(f"{name} turns")
        turns.append((hub, count))
        c, s = math.cos(start), math.sin(start)
        at = (arm * c, 1.14, arm * s)
        bar = rod((0.0, height, 0.0), (arm * c, height, arm * s), 0.014).add(rod((arm * c, height, arm * s), at, 0.010))
        put(f, f"{name} arm", bar.add(ball(0.02), (arm * c, height, arm * s)), brass, hub)
        put(f, name, ball(radius), f.material(name, paint, roughness=0.35), hub, translation=list(at))
        if name == "Saturn":
            disc = lathe([(0.30, -0.004), (0.46, -0.004), (0.46, 0.004), (0.30, 0.004), (0.30, -0.004)], 96, smooth=False)
            sand = f.material("Ring", (0.62, 0.50, 0.33), roughness=0.6)
            put(f, "Ring", disc, sand, hub, translation=list(at), rotation=[0.2079117, 0, 0, 0.9781476])
    lamp(f, "Sunlight", (0, 1.14, 0), (1.0, 0.86, 0.62), 9.0, 0.2)
    arm = f.node("Camera arm")
    turns.append((arm, -1))
    eye, target = (0.0, 2.4, 5.2), (0.0, 0.9, 0.0)
    f.node("Camera", arm, camera=f.camera("Camera", math.radians(36), 0.02, 100.0), translation=list(eye), rotation=look_at(eye, target))
    f.camera_part = "Camera arm/Camera"
    f.spin("Orbits", turns, 12.0)
    write(f, (0.10, 0.12, 0.18), {"pipeline": "raytraced"}, ["Sun"])


def lantern(radius, wall, opening):
    """A ball of 80 triangular windows, with a thickness; the middle one of a point is left open."""
    out = Shape()
    for triangle in triangles_of(icosphere(1.0, 1)):
        centre = tuple(sum(axis) / 3 for axis in zip(*triangle))
        window = [tuple(c + opening * (p - c) for c, p in zip(centre, corner)) for corner in triangle]
        for i in range(3):
            a, b, c, d = triangle[i], triangle[(i + 1) % 3], window[(i + 1) % 3], window[i]
            far, near = (tuple(radius * x for x in p) for p in (a, b, c, d)), (tuple((radius - wall) * x for x in p) for p in (a, b, c, d))
            (fa, fb, fc, fd), (na, nb, nc, nd) = far, near
            face(out, fa, fb, fc, fd)
            face(out, nd, nc, nb, na)
            face(out, fd, fc, nc, nd)
    return out


def shadow_ray():
    """A lantern in the corner of a dark room: a point that shines, and a cage around it."""
    f = lecture(5, "shadow-ray")
    plaster = f.material("Plaster", (0.72, 0.62, 0.50), roughness=0.95)
    room = shapes.plane((-4, 0, 5), (9, 0, 0), (0, 0, -7.2), no_uv)
    room.add(shapes.plane((-4, 0, -2.2), (9, 0, 0), (0, 5, 0), no_uv))
    room.add(shapes.plane((-2.8, 0, 5), (0, 0, -8), (0, 5, 0), no_uv))
    put(f, "Room", room, plaster)
    iron = f.material("Iron", (0.06, 0.055, 0.05), metallic=0.0, roughness=0.5)
    at = [0.0, 1.55, -0.4]
    put(f, "Lantern", lantern(0.42, 0.025, 0.80), iron, translation=at)
    put(f, "Cable", rod((0.0, 0.42, 0.0), (0.0, 4.0, 0.0), 0.012), iron, translation=at)
    put(f, "Bulb", ball(0.05), f.material("Glow", (1.0, 0.85, 0.6), extensions=UNLIT), translation=at)
    for name, shape, paint, place in (
        ("Blue ball", ball(0.34), BLUE, [-1.35, 0.34, 0.35]),
        ("Coral block", shapes.rounded_box((0.5, 0.9, 0.5), 0.03), CORAL, [1.35, 0.45, -0.9]),
        ("Amber cone", lathe([(0.0, 0.0), (0.32, 0.0), (0.0, 0.75)], 64, smooth=False), AMBER, [1.0, 0.0, 0.75]),
    ):
        put(f, name, shape, f.material(name, paint, roughness=0.5), translation=place)
    lamp(f, "Point light", at, (1.0, 0.78, 0.52), 9.0, 0.0)
    camera(f, (1.7, 1.75, 4.9), (-0.15, 1.05, -0.6), 42)
    write(f, (0.035, 0.045, 0.07), {"pipeline": "raytraced"}, ["Bulb"])


def reflections():
    """Two mirrors that face each other, and things between them."""
    f = lecture(6, "reflections")
    tiles = [Shape(), Shape()]
    for i in range(-6, 6):
        for j in range(-6, 6):
            tiles[(i + j) % 2].add(shapes.plane((0.5 * i, 0, 0.5 * j + 0.5), (0.5, 0, 0), (0, 0, -0.5), no_uv))
    put(f, "Light tiles", tiles[0], f.material("Ivory", (0.75, 0.70, 0.62), roughness=0.6))
    put(f, "Dark tiles", tiles[1], f.material("Slate", (0.08, 0.10, 0.13), roughness=0.6))
    silver = f.material("Silver", (0.95, 0.95, 0.95), metallic=1.0, roughness=0.0)
    frame = f.material("Frame", BRASS, metallic=1.0, roughness=0.3)
    for name, side in (("Left", -1), ("Right", 1)):
        x = side * 1.5
        low, high = sorted((x, x + side * 0.03))
        put(f, f"{name} mirror", box((low, 0.12, -1.3), (high, 2.2, 1.3)), silver)
        bars = Shape()
        for y, z, height, depth in ((0.06, 0, 0.12, 2.7), (2.26, 0, 0.12, 2.7), (1.16, -1.32, 2.2, 0.06), (1.16, 1.32, 2.2, 0.06)):
            bars.add(box((x - 0.04, y - height / 2, z - depth / 2), (x + 0.04, y + height / 2, z + depth / 2)))
        put(f, f"{name} frame", bars, frame)
    for name, radius, paint, x, z in (("Coral ball", 0.30, CORAL, 0.55, -0.45), ("Blue ball", 0.22, BLUE, 0.05, 0.05), ("Amber ball", 0.16, AMBER, 0.75, 0.30)):
        put(f, name, ball(radius), f.material(name, paint, roughness=0.6), translation=[x, radius, z])
    put(f, "Chrome ball", ball(0.26), silver, translation=[0.15, 0.26, -0.90])
    lamp(f, "Lamp", (0.0, 2.6, 0.2), (1.0, 0.93, 0.82), 14.0, 0.12)
    camera(f, (-1.28, 1.35, 0.75), (1.2, 0.66, -0.25), 58)
    write(f, (0.16, 0.20, 0.28), {"pipeline": "raytraced", "max_depth": 32})


def anti_aliasing():
    """Thin spokes, and a floor of tiles that runs to the horizon."""
    f = lecture(7, "anti-aliasing")
    tiles = [Shape(), Shape()]
    for i in range(-40, 40):
        for j in range(-74, 6):
            tiles[(i + j) % 2].add(shapes.plane((0.5 * i, 0, 0.5 * j + 0.5), (0.5, 0, 0), (0, 0, -0.5), no_uv))
    put(f, "Light tiles", tiles[0], f.material("Ivory", (0.80, 0.77, 0.70), roughness=0.9))
    put(f, "Dark tiles", tiles[1], f.material("Slate", (0.06, 0.09, 0.14), roughness=0.9))
    steel = f.material("Dark steel", (0.03, 0.04, 0.07), roughness=0.4)
    wheel = f.node("Wheel", translation=[0.55, 1.95, -1.2], rotation=[0, 0.2164396, 0, 0.976296])
    rims = upright(ring(1.5, 0.028)).add(upright(ring(1.36, 0.014)))
    put(f, "Rims", rims, steel, wheel)
    spokes, cabins = Shape(), [Shape() for _ in range(4)]
    for i in range(48):
        c, s = math.cos(2 * math.pi * i / 48), math.sin(2 * math.pi * i / 48)
        spokes.add(rod((0.12 * c, 0.12 * s, 0.0), (1.5 * c, 1.5 * s, 0.0), 0.006))
        if i % 4 == 0:
            cabins[i // 4 % 4].add(shapes.rounded_box((0.2, 0.2, 0.2), 0.04), (1.5 * c, 1.5 * s - 0.16, 0.0))
    put(f, "Spokes", spokes, steel, wheel)
    put(f, "Hub", upright(lathe([(0.0, -0.1), (0.14, -0.1), (0.14, 0.1), (0.0, 0.1)], 48, smooth=False)), f.material("Hub", CORAL, roughness=0.4), wheel)
    for name, paint, shape in zip(("Coral", "Amber", "Teal", "Blue"), (CORAL, AMBER, TEAL, BLUE), cabins):
        put(f, f"{name} cabins", shape, f.material(name, paint, roughness=0.4), wheel)
    legs = Shape()
    for z in (-0.22, 0.22):
        for x in (-0.75, 0.75):
            legs.add(rod((0.0, 0.0, z), (x, -1.95, 2.2 * z), 0.03))
    put(f, "Legs", legs, steel, wheel)
    camera(f, (-0.6, 0.85, 4.4), (0.15, 1.45, -1.2), 40)
    sun(f, (-0.6, 0.9, 0.7), (1.0, 0.95, 0.86), 2.6, 0.5)
    write(f, (0.42, 0.58, 0.80), {"pipeline": "raytraced"})


def soft_shadows():
    """Three niches with the same cage; only the size of the lamp differs."""
    f = lecture(8, "soft-shadows")
    plaster = f.material("Plaster", (0.78, 0.74, 0.68), roughness=0.95)
    walls = shapes.plane((-4, 0, 6), (8, 0, 0), (0, 0, -7.0), no_uv)
    walls.add(shapes.plane((-4, 0, -1.0), (8, 0, 0), (0, 4.5, 0), no_uv))
    put(f, "Floor and wall", walls, plaster)
    for x in (-3, -1, 1, 3):
        put(f, f"Divider at {x}", box((x - 0.04, 0, -1.0), (x + 0.04, 3.2, 1.9)), plaster)
    cage = Shape()
    for i in range(12):
        c, s = 0.4 * math.cos(2 * math.pi * i / 12), 0.4 * math.sin(2 * math.pi * i / 12)
        cage.add(rod((c, 0.0, s), (c, 1.5, s), 0.018))
    cage.add(ring(0.4, 0.028), (0, 1.5, 0)).add(ring(0.4, 0.028), (0, 0.75, 0))
    glow = f.material("Glow", (1.0, 0.93, 0.80), extensions=UNLIT)
    bulbs = []
    for name, x, radius, paint in (("Point", -2, 0.0, CORAL), ("Small lamp", 0, 0.07, AMBER), ("Large lamp", 2, 0.25, TEAL)):
        paint = f.material(f"{name} paint", paint, roughness=0.4)
        put(f, f"{name}: cage", cage, paint, translation=[x, 0, 0.05])
        put(f, f"{name}: ball", ball(0.24), paint, translation=[x, 0.24, 0.05])
        at = [x - 0.45, 2.35, 1.15]
        bulbs.append(f"{name}: bulb")
        put(f, bulbs[-1], ball(max(radius, 0.02)), glow, translation=at)
        lamp(f, name, at, (1.0, 0.90, 0.76), 10.0, radius)
    camera(f, (0.0, 2.1, 7.4), (0.0, 1.12, 0.0), 27.5)
    write(f, (0.10, 0.11, 0.14), {"pipeline": "raytraced"}, bulbs)


def turned_box(size, turn_deg):
    out = box((-size / 2, 0.0, -size / 2), (size / 2, 1.0, size / 2))
    c, s = math.cos(math.radians(turn_deg)), math.sin(math.radians(turn_deg))
    turn = lambda p: (c * p[0] + s * p[2], p[1], c * p[2] - s * p[0])  # noqa: E731
    out.positions, out.normals = [turn(p) for p in out.positions], [turn(n) for n in out.normals]
    return out


def cornell_box():
    """The box of Goral et al. 1984 in its usual form, 2 m wide, lit by its ceiling lamp alone."""
    f = lecture(9, "path-traced-cornell")
    white = f.material("White", (0.73, 0.73, 0.72), roughness=1.0)
    red, green = f.material("Red", (0.62, 0.06, 0.05), roughness=1.0), f.material("Green", (0.12, 0.45, 0.12), roughness=1.0)
    shell = shapes.plane((-1, 0, 1), (2, 0, 0), (0, 0, -2), no_uv)
    shell.add(shapes.plane((-1, 2, -1), (2, 0, 0), (0, 0, 2), no_uv))
    shell.add(shapes.plane((-1, 0, -1), (2, 0, 0), (0, 2, 0), no_uv))
    put(f, "Floor, ceiling, back", shell, white)
    put(f, "Left wall", shapes.plane((-1, 0, 1), (0, 0, -2), (0, 2, 0), no_uv), red)
    put(f, "Right wall", shapes.plane((1, 0, -1), (0, 0, 2), (0, 2, 0), no_uv), green)
    for name, size, height, turn, x, z in (("Tall block", 0.6, 1.2, 18, -0.36, -0.32), ("Short block", 0.6, 0.6, -17, 0.36, 0.36)):
        put(f, name, turned_box(size, turn), white, translation=[x, 0, z], scale=[1.0, height, 1.0])
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 18.0}}
    glow = f.material("Lamp", (0.0, 0.0, 0.0), roughness=1.0, emissive=(1.0, 0.78, 0.50), extensions=strength)
    put(f, "Lamp", shapes.plane((-0.25, 1.998, -0.25), (0.5, 0, 0), (0, 0, 0.5), no_uv), glow)
    camera(f, (0.0, 1.0, 4.55), (0.0, 1.0, 0.0), 33)
    write(f, (0.0, 0.0, 0.0), {"pipeline": "path"})


def main():
    for make in (camera_rays, triangle_mesh, vertex_data, orbit, shadow_ray, reflections, anti_aliasing, soft_shadows, cornell_box):
        make()


if __name__ == "__main__":
    main()
