"""Seamless textures by formula, the PNG writer, and the sky as a Radiance HDR file.

In: a size in pixels. Out: files. Deterministic: the same bytes on every machine with the same zlib.
"""

import math
import random
import struct
import zlib


# ---- files ----------------------------------------------------------------------------------


def write_png(path, size, channels, pixels):
    """8-bit grey (1) or RGB (3); pixels is a flat list of 0..255. Picks the smallest filter per row."""
    stride = size * channels
    raw = bytearray()
    above = bytes(stride)
    for y in range(size):
        row = bytes(pixels[y * stride : (y + 1) * stride])
        left = bytes(channels) + row[:-channels]
        corner = bytes(channels) + above[:-channels]
        candidates = [
            row,
            bytes((x - a) & 255 for x, a in zip(row, left)),
            bytes((x - b) & 255 for x, b in zip(row, above)),
            bytes((x - ((a + b) >> 1)) & 255 for x, a, b in zip(row, left, above)),
            bytes((x - paeth(a, b, c)) & 255 for x, a, b, c in zip(row, left, above, corner)),
        ]
        costs = [sum(v if v < 128 else 256 - v for v in c) for c in candidates]
        best = costs.index(min(costs))
        raw.append(best)
        raw += candidates[best]
        above = row

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", size, size, 8, 0 if channels == 1 else 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(raw), 9)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + body)


def paeth(a, b, c):
    p = a + b - c
    da, db, dc = abs(p - a), abs(p - b), abs(p - c)
    return a if da <= db and da <= dc else b if db <= dc else c


def write_hdr(path, width, height, radiance):
    """A Radiance file of RGBE pixels in the run-length form (runs of literals only). radiance(x, y) is linear."""
    out = bytearray(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width))
    for y in range(height):
        planes = [bytearray(), bytearray(), bytearray(), bytearray()]
        for x in range(width):
            color = radiance(x, y)
            exponent = math.frexp(max(color))[1]
            for plane, c in zip(planes, color):
                plane.append(min(255, int(math.ldexp(c, 8 - exponent))))
            planes[3].append(exponent + 128)
        out += bytes((2, 2, width >> 8, width & 255))
        for plane in planes:
            for start in range(0, width, 128):
                part = plane[start : start + 128]
                if len(set(part)) == 1 and len(part) > 1:
                    # A run is at most 127 long.
                    while part:
                        n = min(127, len(part))
                        out += bytes((128 + n, part[0]))
                        part = part[n:]
                else:
                    out += bytes((len(part),)) + part
    path.write_bytes(out)


# ---- building blocks ------------------------------------------------------------------------


def smoothstep(low, high, x):
    t = min(1.0, max(0.0, (x - low) / (high - low)))
    return t * t * (3 - 2 * t)


def mix(a, b, t):
    return tuple(x + (y - x) * t for x, y in zip(a, b))


def srgb(linear):
    c = min(1.0, max(0.0, linear))
    return 12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055


def to_linear(encoded):
    return encoded / 12.92 if encoded <= 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4


def byte(x):
    return min(255, max(0, int(x * 255 + 0.5)))


def hex_color(text):
    """An sRGB colour as written on screens, to linear."""
    return tuple(to_linear(int(text[i : i + 2], 16) / 255) for i in (0, 2, 4))


class Noise:
    """Value noise that repeats after period_x, period_y lattice cells; -1..1."""

    def __init__(self, seed, period_x, period_y):
        source = random.Random(seed)
        self.nx, self.ny = period_x, period_y
        self.values = [source.uniform(-1, 1) for _ in range(period_x * period_y)]

    def __call__(self, x, y):
        i, j = math.floor(x), math.floor(y)
        fx, fy = x - i, y - j
        fx, fy = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy)
        nx, v = self.nx, self.values
        i0, i1 = i % nx, (i + 1) % nx
        j0, j1 = (j % self.ny) * nx, ((j + 1) % self.ny) * nx
        a, b = v[j0 + i0], v[j0 + i1]
        c, d = v[j1 + i0], v[j1 + i1]
        top, bottom = a + (b - a) * fx, c + (d - c) * fx
        return top + (bottom - top) * fy


def fractal(seed, cells, octaves):
    """Sum of octaves of noise over the unit square, each half as strong; about -1..1."""
    layers = [(Noise(seed + k, cells << k, cells << k), cells << k, 0.5**k) for k in range(octaves)]
    return lambda u, v: sum(a * n(u * c, v * c) for n, c, a in layers)


def normals_of(size, height, strength):
    """A tangent-space normal map of a repeating height field (flat list); Y up in the image."""
    pixels = []
    for y in range(size):
        up, down = ((y - 1) % size) * size, ((y + 1) % size) * size
        here = y * size
        for x in range(size):
            dx = (height[here + (x + 1) % size] - height[here + (x - 1) % size]) * strength
            dy = (height[down + x] - height[up + x]) * strength
            n = 1 / math.sqrt(dx * dx + dy * dy + 1)
            pixels += [byte(0.5 - 0.5 * dx * n), byte(0.5 + 0.5 * dy * n), byte(0.5 + 0.5 * n)]
    return pixels


# ---- the textures ---------------------------------------------------------------------------


def parquet(folder, size):
    """Herringbone oak: base colour, normals, roughness. A texture is 16 x 16 board widths, a board 1 x 4."""
    cells = 16
    boards = {}
    grain = Noise(11, 64, 256)
    pores = Noise(12, 256, 512)
    color, rough, height = [], [], []
    tones = [hex_color(t) for t in ("a87b4f", "9a6c42", "b5895c", "8d6039", "a27247", "ad8152")]
    for y in range(size):
        for x in range(size):
            u, v = x * cells / size, y * cells / size
            i, j = int(u), int(v)
            k = (i - j) % 8
            if k < 4:
                key, along, across = ((i - k) % cells, j, 0), u - i + k, v - j
            else:
                key, along, across = (i, (j - 7 + k) % cells, 1), v - j + 7 - k, u - i
            if key not in boards:
                source = random.Random(repr(key))
                boards[key] = (
                    tones[source.randrange(len(tones))],
                    source.uniform(0.82, 1.12),
                    source.uniform(0, 60),
                    source.uniform(0, 250),
                    (source.uniform(-1, 1), source.uniform(-1, 1)),
                    source.uniform(-0.04, 0.05),
                )
            tone, brightness, shift_x, shift_y, tilt, gloss = boards[key]
            # Year rings run along the board and wander a little.
            wander = grain(along * 1.1 + shift_x, across * 3 + shift_y)
            rings = math.sin((across * 13 + wander * 3.2 + shift_y) * 2.1)
            streak = grain(along * 2.2 + shift_x, across * 22 + shift_y)
            pore = pores(along * 7 + shift_x * 3, across * 30 + shift_y * 2)
            shade = brightness * (1 + 0.09 * rings + 0.10 * streak + 0.05 * pore)
            edge = min(along, 4 - along, across, 1 - across)
            gap = smoothstep(0.0, 0.055, edge)
            shade *= 0.35 + 0.65 * gap
            color += [byte(srgb(c * shade)) for c in tone]
            r = 0.34 + gloss - 0.03 * streak + 0.04 * rings + 0.35 * (1 - gap)
            rough += [255, byte(r), 0]
            relief = 0.9 * smoothstep(0.0, 0.09, edge) + 0.03 * rings + 0.025 * pore
            height.append(relief + 0.14 * (tilt[0] * (along - 2) * 0.25 + tilt[1] * (across - 0.5)))
    write_png(folder / "parquet_color.png", size, 3, color)
    write_png(folder / "parquet_roughness.png", size, 3, rough)
    write_png(folder / "parquet_normal.png", size, 3, normals_of(size, height, 0.55))


def plaster(folder, size):
    """Hand-trowelled plaster: faint clouds in grey, and normals."""
    clouds = fractal(21, 3, 5)
    strokes = fractal(22, 4, 4)
    fine = Noise(23, 128, 128)
    color, height = [], []
    for y in range(size):
        for x in range(size):
            u, v = x / size, y / size
            cloud = clouds(u, v)
            color.append(byte(srgb(0.93 + 0.05 * cloud)))
            # Broad, shallow trowel strokes, wider than high, over a fine grain.
            stroke = strokes(u + 0.05 * cloud, 2 * v)
            height.append(0.7 * stroke + 0.3 * cloud + 0.10 * fine(u * 128, v * 128))
    write_png(folder / "plaster_color.png", size, 1, color)
    write_png(folder / "plaster_normal.png", size, 3, normals_of(size, height, 2.2))


def brushed(folder, size):
    """Roughness of brushed metal: streaks along v. Metallic is full."""
    streaks = [Noise(31 + k, size >> (2 - k), 4 << k) for k in range(3)]
    pixels = []
    for y in range(size):
        for x in range(size):
            u, v = x / size, y / size
            s = sum(n(u * n.nx, v * n.ny) for n in streaks) / 3
            pixels += [255, byte(0.82 + 0.22 * s), 255]
    write_png(folder / "brushed_metal.png", size, 3, pixels)


def glaze(folder, size):
    """Painted bands around a vase; u runs around it, v from its lip to its foot."""
    cream, ink, sky, clay = (hex_color(t) for t in ("efe6d2", "1d2f56", "5f8fb0", "bb5a38"))
    wobble = fractal(41, 6, 3)
    soft = 1.6 / size

    def stripe(v, centre, half):
        return smoothstep(-soft, soft, half - abs(v - centre))

    def pattern(u, v):
        c = cream
        for centre, half, paint in (
            (0.055, 0.030, ink),
            (0.105, 0.006, clay),
            (0.285, 0.006, ink),
            (0.300, 0.003, clay),
            (0.585, 0.003, clay),
            (0.600, 0.006, ink),
            (0.800, 0.010, clay),
            (0.930, 0.060, ink),
        ):
            c = mix(c, paint, stripe(v, centre, half))
        # A zigzag in the upper band, twice.
        if 0.12 < v < 0.28:
            t = (u * 16) % 1
            zig = abs(t - 0.5) * 2
            for base, paint, half in ((0.155, ink, 0.010), (0.190, sky, 0.008), (0.215, ink, 0.004)):
                c = mix(c, paint, stripe(v, base + 0.045 * zig, half))
        # Lozenges with an eye in the broad band.
        if 0.31 < v < 0.575:
            t = (u * 8) % 1 - 0.5
            d = abs(t) / 0.46 + abs(v - 0.4425) / 0.128
            edge = soft * 9
            for limit, paint in ((1.0, ink), (0.86, cream), (0.76, sky), (0.48, cream), (0.38, clay)):
                c = mix(c, paint, smoothstep(-edge, edge, limit - d))
            t = (u * 8 + 0.5) % 1 - 0.5
            for side in (-1, 1):
                r = math.hypot(t * 0.55, (v - 0.4425) - side * 0.095) / 0.030
                c = mix(c, clay, smoothstep(-0.06, 0.06, 1 - r))
        # Petals above the foot.
        if 0.61 < v < 0.79:
            t = (u * 12) % 1 - 0.5
            rise = (v - 0.79) / -0.17
            width = 0.44 * math.sqrt(max(0.0, 1 - rise * rise)) if rise < 1 else 0.0
            c = mix(c, ink, smoothstep(-0.03, 0.03, width - abs(t)))
            c = mix(c, cream, smoothstep(-0.03, 0.03, width * 0.72 - 0.03 - abs(t)))
            c = mix(c, clay, smoothstep(-0.03, 0.03, width * 0.3 - 0.03 - abs(t)))
        if 0.825 < v < 0.86:
            t = (u * 24) % 1 - 0.5
            r = math.hypot(t * 0.5, (v - 0.8425) * 12) / 0.14
            c = mix(c, ink, smoothstep(-0.1, 0.1, 1 - r))
        return c

    pixels = []
    for y in range(size):
        for x in range(size):
            u, v = x / size, y / size
            w = wobble(u, v)
            c = pattern(u, v + 0.0016 * w)
            pixels += [byte(srgb(k * (1 + 0.035 * w))) for k in c]
    write_png(folder / "vase_color.png", size, 3, pixels)


def painting(folder, size):
    """A quilt of arcs on a 4 x 4 grid, with the weave of a canvas."""
    palette = [hex_color(t) for t in ("f0e4cc", "c8503a", "e0a33e", "20425c", "2f7d78", "141c2b", "d98a6a")]
    source = random.Random(58)
    tiles = {}
    for j in range(4):
        for i in range(4):
            picks = source.sample(palette, 4)
            tiles[i, j] = (source.randrange(5), source.randrange(4), picks)
    stain = fractal(51, 4, 5)
    soft = 2.2 * 4 / size

    def cover(x):
        return smoothstep(-soft, soft, x)

    pixels = []
    for y in range(size):
        for x in range(size):
            u, v = 4 * x / size, 4 * y / size
            kind, turn, (ground, a, b, c) = tiles[int(u), int(v)]
            s, t = u % 1, v % 1
            for _ in range(turn):
                s, t = t, 1 - s
            r = math.hypot(s, t)
            color = ground
            if kind == 0:  # quarter discs, one in another
                for limit, paint in ((1.0, a), (0.66, b), (0.33, c)):
                    color = mix(color, paint, cover(limit - r))
            elif kind == 1:  # two leaves
                color = mix(color, a, cover(1 - r) * cover(1 - math.hypot(1 - s, 1 - t)))
                color = mix(color, b, cover(0.16 - math.hypot(s - 0.5, t - 0.5)))
            elif kind == 2:  # half disc and bar
                color = mix(color, a, cover(0.5 - math.hypot(s - 0.5, t)))
                color = mix(color, b, cover(0.22 - math.hypot(s - 0.5, t)))
                color = mix(color, c, cover(t - 0.75))
            elif kind == 3:  # triangle and disc
                color = mix(color, a, cover((s - t) * 0.7))
                color = mix(color, b, cover(0.2 - math.hypot(s - 0.72, t - 0.28)))
            else:  # rings
                d = math.hypot(s - 0.5, t - 0.5)
                for limit, paint in ((0.46, a), (0.33, ground), (0.22, b), (0.1, c)):
                    color = mix(color, paint, cover(limit - d))
            w = 1 + 0.10 * stain(x / size, y / size) + (0.03 if (x + y) % 2 else -0.03)
            pixels += [byte(srgb(k * w)) for k in color]
    write_png(folder / "painting_color.png", size, 3, pixels)


def sky(folder, width, height):
    """A bright, slightly hazy sky over pale ground, as radiance. The sun is a light of its own."""

    def radiance(x, y):
        up = math.sin(math.pi * (0.5 - (y + 0.5) / height))
        # Brighter and warmer towards one side, where the sun stands.
        side = 0.5 + 0.5 * math.cos(2 * math.pi * ((x + 0.5) / width - 0.62))
        if up < 0:
            near = math.exp(up * 9)
            return mix((0.36, 0.32, 0.28), (0.80, 0.78, 0.76), near)
        haze = math.exp(-up * 3.2)
        blue = mix((0.53, 0.83, 1.49), (0.68, 0.94, 1.40), side)
        low = mix((1.10, 1.28, 1.53), (1.95, 1.66, 1.32), side)
        return mix(blue, low, haze)

    write_hdr(folder / "sky.hdr", width, height, radiance)


def write_all(folder):
    """Every texture of the gallery."""
    parquet(folder, 512)
    plaster(folder, 512)
    brushed(folder, 256)
    glaze(folder, 512)
    painting(folder, 512)
    sky(folder, 256, 128)
