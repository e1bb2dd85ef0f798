"""Triangle meshes by formula. Metres, Y up, counter-clockwise seen from outside.

In: sizes and segment counts. Out: Shape (positions, normals, texture coordinates, indices).
Knows no material, no file. Degenerate triangles (poles, mitres) are left out.
"""

import math


class Shape:
    """One indexed triangle list with smooth or split normals, as its builder chose."""

    def __init__(self):
        self.positions = []
        self.normals = []
        self.uvs = []
        self.indices = []

    def vertex(self, position, normal, uv):
        length = math.sqrt(sum(c * c for c in normal))
        self.positions.append(tuple(position))
        self.normals.append(tuple(c / length for c in normal))
        self.uvs.append(tuple(uv))
        return len(self.positions) - 1

    def triangle(self, a, b, c):
        """Adds it unless it has no area."""
        p, q, r = (self.positions[i] for i in (a, b, c))
        n = cross(sub(q, p), sub(r, p))
        if dot(n, n) > 1e-20:
            self.indices += [a, b, c]

    def quad(self, a, b, c, d):
        self.triangle(a, b, c)
        self.triangle(a, c, d)

    def grid(self, columns, rows, flip=False):
        """Joins the last (columns + 1) * (rows + 1) vertices, row after row, to quads."""
        base = len(self.positions) - (columns + 1) * (rows + 1)
        for j in range(rows):
            for i in range(columns):
                a = base + j * (columns + 1) + i
                b, c, d = a + 1, a + columns + 2, a + columns + 1
                self.quad(*((a, d, c, b) if flip else (a, b, c, d)))

    def add(self, other, offset=(0.0, 0.0, 0.0)):
        """Appends another shape, moved."""
        base = len(self.positions)
        self.positions += [add(p, offset) for p in other.positions]
        self.normals += other.normals
        self.uvs += other.uvs
        self.indices += [base + i for i in other.indices]
        return self

    def lowest(self):
        return min(p[1] for p in self.positions)


def add(a, b):
    return tuple(x + y for x, y in zip(a, b))


def sub(a, b):
    return tuple(x - y for x, y in zip(a, b))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(dot(a, a))
    return tuple(c / length for c in a)


def plane(corner, edge_u, edge_v, uv_of):
    """One rectangle; edge_u x edge_v is its front. uv_of(position) gives the texture coordinate."""
    shape = Shape()
    normal = cross(edge_u, edge_v)
    for s, t in ((0, 0), (1, 0), (1, 1), (0, 1)):
        p = tuple(c + s * u + t * v for c, u, v in zip(corner, edge_u, edge_v))
        shape.vertex(p, normal, uv_of(p))
    shape.quad(0, 1, 2, 3)
    return shape


def box(low, high, tile_m=1.0):
    """A sharp box from corner to corner; texture coordinates are metres / tile_m on each face."""
    shape = Shape()
    size = sub(high, low)
    for axis in range(3):
        u_axis, v_axis = (axis + 1) % 3, (axis + 2) % 3
        for positive in (False, True):
            corner = list(low)
            corner[axis] = high[axis] if positive else low[axis]
            edge_u, edge_v = [0.0] * 3, [0.0] * 3
            edge_u[u_axis], edge_v[v_axis] = size[u_axis], size[v_axis]
            if not positive:
                edge_u, edge_v = edge_v, edge_u
            shape.add(plane(corner, edge_u, edge_v, box_uv(axis, tile_m)))
    return shape


def box_uv(axis, tile_m):
    """Projection along an axis with the image upright on walls (v grows downwards in glTF)."""
    if axis == 0:
        return lambda p: (p[2] / tile_m, -p[1] / tile_m)
    if axis == 1:
        return lambda p: (p[0] / tile_m, p[2] / tile_m)
    return lambda p: (p[0] / tile_m, -p[1] / tile_m)


def rounded_box(size, radius, steps=4, tile_m=1.0):
    """A box of that full size around the origin with edges rounded by radius."""
    shape = Shape()
    half = [s / 2 for s in size]
    angles = [math.pi / 4 * (i / steps) for i in range(steps + 1)]
    for axis in range(3):
        u_axis, v_axis = (axis + 1) % 3, (axis + 2) % 3
        uv_of = box_uv(axis, tile_m)

        def stops(a):
            flat = half[a] - radius
            bend = [flat + radius * math.tan(t) for t in angles]
            return [-x for x in reversed(bend)] + bend

        for side in (-1.0, 1.0):
            for v in stops(v_axis):
                for u in stops(u_axis):
                    outer = [0.0] * 3
                    outer[axis], outer[u_axis], outer[v_axis] = side * half[axis], u, v
                    inner = [max(-(h - radius), min(h - radius, c)) for c, h in zip(outer, half)]
                    normal = unit(sub(outer, inner))
                    p = tuple(i + radius * n for i, n in zip(inner, normal))
                    shape.vertex(p, normal, uv_of(p))
            count = 2 * steps + 1
            shape.grid(count, count, flip=side < 0)
    return shape


def lathe(profile, segments=96, uv_scale=(1.0, 1.0), smooth=True):
    """Turns a profile of (radius, height) about Y. Walk it so that the outside lies to the right:
    upwards on outer walls, downwards on inner ones. smooth=False splits normals at each point."""
    lengths = [0.0]
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        lengths.append(lengths[-1] + math.hypot(r1 - r0, y1 - y0))
    total = lengths[-1]
    side = []
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        side.append(unit((y1 - y0, r0 - r1)))
    runs = []
    if smooth:
        normals = [side[0]]
        for a, b in zip(side, side[1:]):
            normals.append(unit(add(a, b)))
        normals.append(side[-1])
        # On the axis the surface is level.
        for end in (0, -1):
            if profile[end][0] == 0.0:
                normals[end] = (0.0, math.copysign(1.0, side[end][1]))
        runs.append((profile, normals, lengths))
    else:
        for i, n in enumerate(side):
            runs.append((profile[i : i + 2], [n, n], lengths[i : i + 2]))
    shape = Shape()
    for points, normals, along in runs:
        for (r, y), (nr, ny), s in zip(points, normals, along):
            for i in range(segments + 1):
                turn = 2 * math.pi * (i % segments) / segments
                c, z = math.cos(turn), -math.sin(turn)
                uv = (uv_scale[0] * i / segments, uv_scale[1] * (1 - s / total))
                shape.vertex((r * c, y, r * z), (nr * c, ny, nr * z), uv)
        shape.grid(segments, len(points) - 1)
    return shape


def sphere(radius, segments=96, rings=48):
    """A sphere around the origin."""
    profile = []
    for j in range(rings + 1):
        a = math.pi * j / rings
        r = 0.0 if j in (0, rings) else radius * math.sin(a)
        profile.append((r, -radius * math.cos(a)))
    shape = lathe(profile, segments)
    shape.normals = [unit(p) for p in shape.positions]
    return shape


def bend(points, radius, steps=6):
    """Rounds the inner corners of a profile by arcs (quadratic) that start radius before them."""
    out = [points[0]]
    for before, corner, after in zip(points, points[1:], points[2:]):
        to, frm = sub(before, corner), sub(after, corner)
        reach = min(radius, 0.49 * math.hypot(*to), 0.49 * math.hypot(*frm))
        p = tuple(c + reach * d for c, d in zip(corner, unit(to)))
        q = tuple(c + reach * d for c, d in zip(corner, unit(frm)))
        for i in range(steps + 1):
            t = i / steps
            out.append(tuple((1 - t) ** 2 * a + 2 * t * (1 - t) * c + t * t * b for a, c, b in zip(p, corner, q)))
    out.append(points[-1])
    return out


def curve(points, steps):
    """Catmull-Rom spline through the points, ends doubled."""
    padded = [points[0]] + list(points) + [points[-1]]
    out = []
    for a, b, c, d in zip(padded, padded[1:], padded[2:], padded[3:]):
        for i in range(steps):
            t = i / steps
            out.append(
                tuple(
                    0.5 * (2 * q + (r - p) * t + (2 * p - 5 * q + 4 * r - s) * t * t + (3 * q - p - 3 * r + s) * t**3)
                    for p, q, r, s in zip(a, b, c, d)
                )
            )
    out.append(points[-1])
    return out


def torus_knot(p, q, radius, tube, segments, sides, uv_scale):
    """The (p, q) knot on a torus of that radius, as a tube. Normals are those of the swept circle."""

    def centre(t):
        r = radius * (1 + 0.45 * math.cos(q * t))
        return (r * math.cos(p * t), r * math.sin(p * t), 0.45 * radius * math.sin(q * t))

    # Rotation-minimising frames, then the leftover twist spread evenly so that the tube closes.
    points = [centre(2 * math.pi * i / segments) for i in range(segments)]
    tangents = [unit(sub(points[(i + 1) % segments], points[i - 1])) for i in range(segments)]
    frame = [unit(cross(tangents[0], (0.0, 0.0, 1.0)))]
    for i in range(1, segments + 1):
        t = tangents[i % segments]
        n = sub(frame[-1], tuple(dot(frame[-1], t) * c for c in t))
        frame.append(unit(n))
    side = cross(tangents[0], frame[0])
    twist = math.atan2(dot(frame[segments], side), dot(frame[segments], frame[0]))
    shape = Shape()
    for i in range(segments + 1):
        t, n = tangents[i % segments], frame[i]
        b = cross(t, n)
        back = -twist * i / segments
        for j in range(sides + 1):
            a = 2 * math.pi * (j % sides) / sides + back
            normal = tuple(math.cos(a) * x + math.sin(a) * y for x, y in zip(n, b))
            position = tuple(c + tube * x for c, x in zip(points[i % segments], normal))
            shape.vertex(position, normal, (uv_scale[0] * i / segments, uv_scale[1] * j / sides))
    shape.grid(sides, segments)
    return shape


def picture_frame(width, height, profile, tile_m=1.0):
    """A mitred frame around a width x height opening in the XY plane, facing +Z. The profile is a run
    of (distance outwards from the opening, height above the wall), from the opening outwards."""
    shape = Shape()
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    for k in range(4):
        (ax, ay), (bx, by) = corners[k], corners[(k + 1) % 4]
        outward = (0.0, -1.0, 0.0) if k == 0 else (1.0, 0.0, 0.0) if k == 1 else (0.0, 1.0, 0.0) if k == 2 else (-1.0, 0.0, 0.0)
        for (d0, z0), (d1, z1) in zip(profile, profile[1:]):
            rise = unit((d1 - d0, z1 - z0))
            normal = tuple(-rise[1] * o for o in outward[:2]) + (rise[0],)

            def corner(cx, cy, d, z):
                return (cx * (width / 2 + d), cy * (height / 2 + d), z)

            quad = [corner(ax, ay, d0, z0), corner(ax, ay, d1, z1), corner(bx, by, d1, z1), corner(bx, by, d0, z0)]
            ids = []
            for p in quad:
                run = p[0] if k in (0, 2) else p[1]
                across = p[1] if k in (0, 2) else p[0]
                ids.append(shape.vertex(p, normal, (run / tile_m, across / tile_m)))
            shape.quad(*ids)
    return shape
