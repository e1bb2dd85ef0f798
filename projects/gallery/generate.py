#!/usr/bin/env python3
"""Makes the assets of the gallery: glTF files, their buffers, textures and the sky.

Python 3, standard library only, deterministic. Run `python3 projects/gallery/generate.py`; it
rewrites projects/gallery/assets. The project file places what is made here and is kept by hand.
Metres, Y up. The room is centred on the origin; the back wall is at -Z, the viewer looks there.
"""

import math
import pathlib
import sys

sys.dont_write_bytecode = True  # leaves no __pycache__ in the project
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))  # projects/generator

from generator import shapes, textures  # noqa: E402
from generator.gltf import File, look_at  # noqa: E402
from generator.shapes import Shape, bend, box, curve, lathe, rounded_box  # noqa: E402

MADE_BY = "projects/gallery/generate.py"
ASSETS = pathlib.Path(__file__).resolve().parent / "assets"

# The room, inside: x -4..4, z -3.4..5.0, y 0..4.3. Walls are 0.2 thick.
LEFT, RIGHT, BACK, FRONT, TOP, WALL = -4.0, 4.0, -3.4, 5.0, 4.3, 0.2

BRASS = (0.89, 0.66, 0.34)
COPPER = (0.955, 0.638, 0.538)
STEEL = (0.62, 0.61, 0.59)


def room():
    """Walls, floor, roof with its skylight, mirror, painting, lights and the camera."""
    f = File(MADE_BY, "room")
    oak = f.material(
        "Oak parquet",
        roughness=1.0,
        base="parquet_color.png",
        orm="parquet_roughness.png",
        normal="parquet_normal.png",
        normal_scale=0.6,
    )

    def plaster(name, color):
        return f.material(
            name, color, roughness=0.92, base="plaster_color.png", normal="plaster_normal.png", normal_scale=0.3
        )

    white, deep = plaster("White plaster", (0.84, 0.81, 0.76)), plaster("Petrol plaster", (0.045, 0.115, 0.130))
    paint = f.material("White lacquer", (0.80, 0.78, 0.74), roughness=0.35)
    timber = f.material("Dark timber", (0.10, 0.072, 0.052), roughness=0.55)

    # The boards run at 45 degrees to the walls; a texture is 16 boards of 0.1 m.
    def turned(p):
        s = math.sqrt(0.5) / 1.6
        return ((p[0] - p[2]) * s, (p[0] + p[2]) * s)

    floor = shapes.plane((LEFT, 0.0, FRONT), (RIGHT - LEFT, 0, 0), (0, 0, BACK - FRONT), turned)
    f.node("Floor", mesh=f.mesh("Floor", (f.geometry(floor), oak)))

    tile = 2.0
    f.node("Back wall", mesh=f.mesh("Back wall", (f.geometry(box((LEFT - WALL, 0, BACK - WALL), (RIGHT + WALL, TOP, BACK), tile)), deep)))
    f.node("Left wall", mesh=f.mesh("Left wall", (f.geometry(box((LEFT - WALL, 0, BACK), (LEFT, TOP, FRONT), tile)), white)))
    f.node("Right wall", mesh=f.mesh("Right wall", (f.geometry(box((RIGHT, 0, BACK), (RIGHT + WALL, TOP, FRONT), tile)), white)))
    front = Shape()
    # Three tall windows behind the viewer; the mirror and the glass show them.
    pillars = [LEFT - WALL, -3.4, -1.5, -1.1, 0.8, 1.2, 3.1, RIGHT + WALL]
    for low, high in zip(pillars[0::2], pillars[1::2]):
        front.add(box((low, 0, FRONT), (high, TOP, FRONT + WALL), tile))
    for low, high in zip(pillars[1::2], pillars[2::2]):
        front.add(box((low, 0, FRONT), (high, 0.35, FRONT + WALL), tile))
        front.add(box((low, 3.3, FRONT), (high, TOP, FRONT + WALL), tile))
    f.node("Window wall", mesh=f.mesh("Window wall", (f.geometry(front), white)))
    bars = Shape()
    for low, high in zip(pillars[1::2], pillars[2::2]):
        middle = (low + high) / 2
        bars.add(box((middle - 0.03, 0.35, FRONT + 0.06), (middle + 0.03, 3.3, FRONT + 0.12)))
        for y in (1.3, 2.3):
            bars.add(box((low, y - 0.025, FRONT + 0.065), (high, y + 0.025, FRONT + 0.115)))
    f.node("Window bars", mesh=f.mesh("Window bars", (f.geometry(bars), timber)))

    skirting = Shape()
    for low, high in (
        ((LEFT, 0, BACK), (RIGHT, 0.14, BACK + 0.018)),
        ((LEFT, 0, BACK + 0.018), (LEFT + 0.018, 0.14, FRONT)),
        ((RIGHT - 0.018, 0, BACK + 0.018), (RIGHT, 0.14, FRONT)),
    ):
        skirting.add(box(low, high))
    f.node("Skirting", mesh=f.mesh("Skirting", (f.geometry(skirting), paint)))

    # The roof is a ring around an open skylight that beams cross.
    hole = (-3.0, 3.0, -3.0, 3.4)
    ring = Shape()
    for low, high in (
        ((LEFT - WALL, TOP, BACK - WALL), (hole[0], TOP + 0.25, FRONT + WALL)),
        ((hole[1], TOP, BACK - WALL), (RIGHT + WALL, TOP + 0.25, FRONT + WALL)),
        ((hole[0], TOP, BACK - WALL), (hole[1], TOP + 0.25, hole[2])),
        ((hole[0], TOP, hole[3]), (hole[1], TOP + 0.25, FRONT + WALL)),
    ):
        ring.add(box(low, high, tile))
    f.node("Roof", mesh=f.mesh("Roof", (f.geometry(ring), white)))
    beams = Shape()
    count = 6
    for i in range(1, count):
        x = hole[0] + (hole[1] - hole[0]) * i / count
        beams.add(box((x - 0.05, TOP - 0.02, hole[2]), (x + 0.05, TOP + 0.24, hole[3])))
    for i in (1, 2):
        z = hole[2] + (hole[3] - hole[2]) * i / 3
        beams.add(box((hole[0], TOP + 0.02, z - 0.05), (hole[1], TOP + 0.20, z + 0.05)))
    f.node("Roof beams", mesh=f.mesh("Roof beams", (f.geometry(beams), timber)))

    mirror(f)
    picture(f)
    lights(f)
    eye, target = (0.95, 1.60, 3.80), (0.06, 1.16, -1.2)
    f.node(
        "Visitor",
        camera=f.camera("Visitor", math.radians(44), 0.05, 100.0),
        translation=list(eye),
        rotation=look_at(eye, target),
    )
    eye, target = (-2.9, 1.35, 1.9), (0.6, 0.95, -1.2)
    f.node(
        "Corner",
        camera=f.camera("Corner", math.radians(42), 0.05, 100.0),
        translation=list(eye),
        rotation=look_at(eye, target),
    )
    f.write(ASSETS)


def mirror(f):
    """A large mirror in a brass frame on the back wall."""
    width, height = 2.1, 1.7
    at = f.node("Mirror", translation=[-1.35, 1.62, BACK])
    silver = f.material("Mirror silver", (0.94, 0.95, 0.945), metallic=1.0, roughness=0.0)
    brass = f.material("Mirror brass", BRASS, metallic=1.0, roughness=0.26)
    glass = shapes.plane(
        (-width / 2, -height / 2, 0.02), (width, 0, 0), (0, height, 0), lambda p: (p[0] / width + 0.5, 0.5 - p[1] / height)
    )
    f.node("Mirror glass", at, mesh=f.mesh("Mirror glass", (f.geometry(glass), silver)))
    profile = [(0.0, 0.02), (0.006, 0.030), (0.014, 0.030), (0.022, 0.040), (0.052, 0.058), (0.066, 0.060)]
    profile += [(0.078, 0.054), (0.086, 0.042), (0.088, 0.0)]
    frame = shapes.picture_frame(width, height, profile)
    f.node("Mirror frame", at, mesh=f.mesh("Mirror frame", (f.geometry(frame), brass)))


def picture(f):
    """A framed painting on the back wall."""
    size = 1.45
    at = f.node("Painting", translation=[1.75, 1.66, BACK])
    canvas = f.material("Canvas", roughness=0.85, base="painting_color.png")
    wood = f.material("Frame oak", (0.50, 0.34, 0.20), roughness=0.5)
    board = shapes.plane(
        (-size / 2, -size / 2, 0.025), (size, 0, 0), (0, size, 0), lambda p: (p[0] / size + 0.5, 0.5 - p[1] / size)
    )
    f.node("Canvas", at, mesh=f.mesh("Canvas", (f.geometry(board), canvas)))
    frame = shapes.picture_frame(size, size, [(0.0, 0.025), (0.0, 0.045), (0.028, 0.045), (0.028, 0.0)])
    f.node("Painting frame", at, mesh=f.mesh("Painting frame", (f.geometry(frame), wood)))


def lights(f):
    """Sun through the skylight, a small warm pendant over the glass, a large soft disc at the left."""
    down = (-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # a spot shines along its -Z
    f.node(
        "Sun",
        translation=[2.0, 6.0, 1.0],
        rotation=look_at((0.60, 1.0, 0.24), (0, 0, 0)),
        extensions=f.light("Sun", "directional", (1.0, 0.86, 0.66), 8.0, {"angle": 0.7}),
    )
    black = f.material("Black steel", (0.018, 0.018, 0.02), metallic=0.0, roughness=0.4)
    brass = f.material("Lamp brass", BRASS, metallic=1.0, roughness=0.22)
    filament = f.material(
        "Pendant glow",
        (0.0, 0.0, 0.0),
        roughness=1.0,
        emissive=(1.0, 0.72, 0.42),
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 9.0}},
    )
    panel = f.material(
        "Disc glow",
        (0.0, 0.0, 0.0),
        roughness=1.0,
        emissive=(0.86, 0.93, 1.0),
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 5.0}},
    )

    pendant = f.node("Pendant lamp", translation=[1.60, 2.16, 0.98])
    outside = bend([(0.16, 0.0), (0.148, 0.05), (0.05, 0.155), (0.022, 0.19), (0.018, 0.26), (0.0, 0.26)], 0.03)
    inside = bend([(0.0, 0.15), (0.045, 0.15), (0.144, 0.05), (0.157, 0.0)], 0.02)
    shade = lathe(outside).add(lathe(inside)).add(lathe([(0.157, 0.0), (0.16, 0.0)]))
    f.node("Pendant shade", pendant, mesh=f.mesh("Pendant shade", (f.geometry(shade), brass)))
    cable = lathe([(0.004, 0.26), (0.004, TOP + 0.1 - 2.16)], 12)
    f.node("Pendant cable", pendant, mesh=f.mesh("Pendant cable", (f.geometry(cable), black)))
    bulb = lathe([(0.0, 0.085), (0.03, 0.1), (0.03, 0.13), (0.0, 0.14)], 48)
    f.node("Pendant bulb", pendant, mesh=f.mesh("Pendant bulb", (f.geometry(bulb), filament)))
    f.node(
        "Pendant light",
        pendant,
        translation=[0, 0.05, 0],
        rotation=down,
        extensions=f.light(
            "Pendant light",
            "spot",
            (1.0, 0.70, 0.40),
            22.0,
            {"radius": 0.02},
            {"innerConeAngle": short_angle(30), "outerConeAngle": short_angle(58)},
        ),
    )

    disc = f.node("Disc lamp", translation=[-1.0, 2.85, -1.1])
    body = lathe([(0.0, 0.02), (0.36, 0.02), (0.36, 0.0), (0.38, 0.0), (0.38, 0.05), (0.0, 0.05)], 96, smooth=False)
    # The glowing face closes the body from below.
    f.node("Disc lamp body", disc, mesh=f.mesh("Disc lamp body", (f.geometry(body), black)))
    face = lathe([(0.0, 0.01), (0.36, 0.01)], 96)
    f.node("Disc lamp face", disc, mesh=f.mesh("Disc lamp face", (f.geometry(face), panel)))
    rod = lathe([(0.006, 0.05), (0.006, TOP + 0.1 - 2.85)], 12)
    f.node("Disc lamp rod", disc, mesh=f.mesh("Disc lamp rod", (f.geometry(rod), black)))
    f.node(
        "Disc light",
        disc,
        translation=[0, -0.06, 0],
        rotation=down,
        extensions=f.light(
            "Disc light",
            "spot",
            (0.80, 0.90, 1.0),
            11.0,
            {"radius": 0.35},
            {"innerConeAngle": short_angle(40), "outerConeAngle": short_angle(85)},
        ),
    )


def short_angle(degrees):
    return round(math.radians(degrees), 5)


def plinth():
    """The prefab that the project places several times: 0.42 m square, 1 m high, on a recessed foot."""
    f = File(MADE_BY, "plinth")
    lacquer = f.material("Plinth lacquer", (0.78, 0.765, 0.735), roughness=0.42)
    shadow = f.material("Plinth foot", (0.03, 0.03, 0.032), roughness=0.6)
    top = f.node("Plinth")
    body = Shape().add(rounded_box((0.42, 0.95, 0.42), 0.006), (0, 0.525, 0))
    f.node("Plinth body", top, mesh=f.mesh("Plinth body", (f.geometry(body), lacquer)))
    foot = box((-0.18, 0, -0.18), (0.18, 0.06, 0.18))
    f.node("Plinth foot", top, mesh=f.mesh("Plinth foot", (f.geometry(foot), shadow)))
    f.write(ASSETS)


def glass_material(f, name, color, thickness_m, tint, distance_m):
    return f.material(
        name,
        color,
        roughness=0.0,
        extensions={
            "KHR_materials_transmission": {"transmissionFactor": 1.0},
            "KHR_materials_ior": {"ior": 1.5},
            "KHR_materials_volume": {
                "thicknessFactor": thickness_m,
                "attenuationColor": list(tint),
                "attenuationDistance": distance_m,
            },
        },
    )


def glass_sphere():
    """A solid glass sphere on a thin brass ring; the origin is where it stands."""
    f = File(MADE_BY, "glass_sphere")
    radius = 0.19
    glass = glass_material(f, "Clear glass", (1.0, 1.0, 1.0), 2 * radius, (0.86, 0.96, 0.95), 0.6)
    brass = f.material("Ring brass", BRASS, metallic=1.0, roughness=0.2)
    top = f.node("Glass sphere")
    ball = f.geometry(shapes.sphere(radius, 112, 56))
    # The ring touches the sphere where its circle of radius 0.09 lies.
    lift = 0.022 + math.sqrt((radius + 0.012) ** 2 - 0.09**2) - 0.010
    f.node("Glass ball", top, translation=[0, round(lift, 5), 0], mesh=f.mesh("Glass ball", (ball, glass)))
    circle = [(0.09 + 0.012 * math.cos(a), 0.012 + 0.012 * math.sin(a)) for a in (math.pi * 2 * i / 24 for i in range(25))]
    ring = lathe(circle)
    f.node("Brass ring", top, mesh=f.mesh("Brass ring", (f.geometry(ring), brass)))
    f.write(ASSETS)


def glass_vase():
    """A turned vase of thick green glass: one closed surface, outer and inner wall."""
    f = File(MADE_BY, "glass_vase")
    glass = glass_material(f, "Green glass", (1.0, 1.0, 1.0), 0.02, (0.30, 0.78, 0.60), 0.03)
    outer = curve([(0.075, 0.004), (0.10, 0.05), (0.125, 0.14), (0.105, 0.25), (0.055, 0.35), (0.05, 0.41), (0.078, 0.47)], 10)
    inner = curve([(0.068, 0.47), (0.041, 0.41), (0.045, 0.35), (0.093, 0.25), (0.112, 0.14), (0.086, 0.06), (0.05, 0.036)], 10)
    lip = [(0.0765, 0.4745), (0.073, 0.4765), (0.0695, 0.4745)]
    profile = [(0.0, 0.0), (0.066, 0.0), (0.072, 0.001)] + outer + lip + inner + [(0.025, 0.033), (0.0, 0.033)]
    f.node("Glass vase", mesh=f.mesh("Glass vase", (f.geometry(lathe(profile, 96)), glass)))
    f.write(ASSETS)


def ceramic_vase():
    """A painted vase with a generated pattern."""
    f = File(MADE_BY, "ceramic_vase")
    painted = f.material("Painted glaze", roughness=0.16, base="vase_color.png")
    earth = f.material("Vase inside", (0.30, 0.20, 0.13), roughness=0.8)
    outer = curve(
        [(0.105, 0.004), (0.125, 0.05), (0.185, 0.20), (0.205, 0.33), (0.170, 0.47), (0.095, 0.56), (0.078, 0.61), (0.098, 0.655)],
        12,
    )
    body = lathe([(0.0, 0.0), (0.098, 0.0)] + outer, 128)
    inside = lathe([(0.098, 0.655), (0.094, 0.660), (0.088, 0.656), (0.068, 0.61), (0.083, 0.56), (0.155, 0.47), (0.0, 0.30)], 64)
    f.node("Ceramic vase", mesh=f.mesh("Ceramic vase", (f.geometry(body), painted), (f.geometry(inside), earth)))
    f.write(ASSETS)


def copper_knot():
    """A torus knot of brushed copper that stands on its lowest point."""
    f = File(MADE_BY, "copper_knot")
    copper = f.material("Brushed copper", COPPER, metallic=1.0, roughness=0.36, orm="brushed_metal.png")
    knot = shapes.torus_knot(2, 3, 0.17, 0.048, 288, 32, (12.0, 1.0))
    lift = round(-knot.lowest(), 5)
    f.node("Copper knot", translation=[0, lift, 0], mesh=f.mesh("Copper knot", (f.geometry(knot), copper)))
    f.write(ASSETS)


def steel_spheres():
    """Three spheres of one geometry, from polished to satin."""
    f = File(MADE_BY, "steel_spheres")
    top = f.node("Steel spheres")
    radius = 0.18
    ball = f.geometry(shapes.sphere(radius))
    for name, roughness, x, z, scale in (
        ("Polished", 0.06, 0.0, 0.0, 1.0),
        ("Satin", 0.24, 0.44, 0.20, 0.76),
        ("Matte", 0.45, 0.13, 0.50, 0.52),
    ):
        steel = f.material(name + " steel", STEEL, metallic=1.0, roughness=roughness)
        f.node(
            name + " sphere",
            top,
            translation=[x, round(radius * scale, 5), z],
            scale=[scale] * 3,
            mesh=f.mesh(name + " sphere", (ball, steel)),
        )
    f.write(ASSETS)


def bench():
    """A leather bench on a black steel frame, 1.5 m long."""
    f = File(MADE_BY, "bench")
    leather = f.material("Tan leather", (0.36, 0.155, 0.062), roughness=0.48)
    steel = f.material("Bench steel", (0.02, 0.02, 0.022), roughness=0.38)
    top = f.node("Bench")
    seat = Shape()
    for i in range(3):
        seat.add(rounded_box((0.496, 0.10, 0.46), 0.032, 4), (-0.5 + 0.5 * i, 0.40, 0))
    f.node("Bench seat", top, mesh=f.mesh("Bench seat", (f.geometry(seat), leather)))
    frame = Shape()
    frame.add(rounded_box((1.46, 0.03, 0.40), 0.004), (0, 0.335, 0))
    for x in (-0.66, 0.66):
        for z in (-0.17, 0.17):
            frame.add(rounded_box((0.035, 0.32, 0.035), 0.004), (x, 0.16, z))
        frame.add(rounded_box((0.035, 0.03, 0.34), 0.004), (x, 0.015, 0))
    f.node("Bench frame", top, mesh=f.mesh("Bench frame", (f.geometry(frame), steel)))
    f.write(ASSETS)


def main():
    ASSETS.mkdir(exist_ok=True)
    textures.write_all(ASSETS)
    for make in (room, plinth, glass_sphere, glass_vase, ceramic_vase, copper_knot, steel_spheres, bench):
        make()
    total = sum(p.stat().st_size for p in ASSETS.iterdir())
    print(f"wrote {len(list(ASSETS.iterdir()))} files, {total / 1e6:.2f} MB, to {ASSETS.name}/")


if __name__ == "__main__":
    main()
