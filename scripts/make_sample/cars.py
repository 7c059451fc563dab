"""Parked cars: a lofted, subdivided body with glass, lamps, wheels and plates."""

import math

import materials as m
from geometry import Mesh, place

# One station along the body from the tail: distance, sill height, half width, belt height, half width at the
# glass, roof height, half width of the roof; all in metres.
HATCHBACK = [
    (0.00, 0.40, 0.70, 0.60, 0.66, 0.63, 0.50), (0.03, 0.32, 0.82, 0.78, 0.76, 0.82, 0.64),
    (0.14, 0.28, 0.87, 0.95, 0.80, 1.00, 0.66), (0.60, 0.25, 0.89, 0.97, 0.81, 1.44, 0.60),
    (0.85, 0.24, 0.90, 0.97, 0.82, 1.48, 0.61), (1.75, 0.23, 0.90, 0.95, 0.83, 1.51, 0.62),
    (1.87, 0.23, 0.90, 0.95, 0.83, 1.51, 0.62), (2.45, 0.23, 0.90, 0.94, 0.82, 1.45, 0.60),
    (3.15, 0.24, 0.89, 0.93, 0.80, 0.98, 0.66), (3.75, 0.26, 0.87, 0.82, 0.77, 0.87, 0.60),
    (4.00, 0.28, 0.83, 0.68, 0.73, 0.72, 0.56), (4.08, 0.34, 0.74, 0.58, 0.66, 0.61, 0.50),
]
SALOON = [
    (0.00, 0.42, 0.70, 0.62, 0.66, 0.66, 0.52), (0.04, 0.34, 0.83, 0.84, 0.77, 0.88, 0.64),
    (0.14, 0.30, 0.88, 0.97, 0.80, 1.01, 0.66), (0.72, 0.26, 0.90, 0.98, 0.81, 1.03, 0.67),
    (1.30, 0.25, 0.91, 0.97, 0.82, 1.38, 0.60), (1.55, 0.24, 0.91, 0.96, 0.83, 1.43, 0.61),
    (2.30, 0.23, 0.91, 0.95, 0.83, 1.45, 0.62), (2.42, 0.23, 0.91, 0.95, 0.83, 1.45, 0.62),
    (2.95, 0.23, 0.91, 0.94, 0.82, 1.39, 0.60), (3.65, 0.24, 0.90, 0.92, 0.80, 0.96, 0.66),
    (4.35, 0.27, 0.87, 0.78, 0.76, 0.82, 0.60), (4.56, 0.30, 0.83, 0.66, 0.72, 0.69, 0.56),
    (4.62, 0.36, 0.74, 0.56, 0.66, 0.59, 0.50),
]
VAN = [
    (0.00, 0.42, 0.80, 1.00, 0.80, 1.02, 0.74), (0.04, 0.36, 0.93, 1.15, 0.90, 2.02, 0.80),
    (0.25, 0.33, 0.96, 1.18, 0.93, 2.14, 0.82), (1.20, 0.31, 0.97, 1.18, 0.93, 2.18, 0.83),
    (2.70, 0.30, 0.97, 1.16, 0.93, 2.18, 0.83), (2.82, 0.30, 0.97, 1.16, 0.93, 2.17, 0.83),
    (3.55, 0.30, 0.97, 1.12, 0.92, 2.02, 0.78), (4.30, 0.31, 0.96, 1.08, 0.90, 1.14, 0.76),
    (4.85, 0.34, 0.92, 0.92, 0.84, 0.98, 0.66), (5.00, 0.38, 0.82, 0.74, 0.76, 0.78, 0.58),
]
# (body, first roof station, last roof station, pillar stations, axles)
SHAPES = {
    "hatchback": (HATCHBACK, 3, 7, (3, 5), (0.72, 3.28), 0.31),
    "saloon": (SALOON, 4, 8, (4, 6), (0.95, 3.72), 0.32),
    "van": (VAN, 4, 6, (4,), (0.95, 4.05), 0.34),
}


def _ring(station):
    s, low, w, belt, gw, top, tw = station
    half = [(w * 0.86, low), (w * 0.985, low + 0.10), (w, (low + belt) / 2), (w * 0.975, belt - 0.03),
            (gw, belt + 0.02), (tw, top - 0.03), (tw * 0.5, top + 0.02)]
    right = [(x, y, -s) for x, y in half]
    return right + [(0.0, top + 0.03, -s)] + [(-x, y, z) for x, y, z in right[::-1]]


def car(name, shape, colour, headlights=False):
    """Meshes of a car whose tail stands at the origin and which points down -z: [(mesh, is_subdivided)]."""
    stations, first, last, pillars, axles, radius = SHAPES[shape]
    length = stations[-1][0]
    paint = m.car_paint(f"paint {colour}", colour)
    glass = m.window_glass("car glass", (0.008, 0.009, 0.01), ior=1.4)
    black = m.plain("car trim", (0.012, 0.012, 0.012), 0.5)
    body = Mesh(name + " body")
    rings = [_ring(s) for s in stations]
    count = len(rings[0])
    points = [p for ring in rings for p in ring]
    faces, kinds = [], []
    for i in range(len(rings) - 1):
        for j in range(count):
            k = (j + 1) % count
            faces.append((i * count + j, (i + 1) * count + j, (i + 1) * count + k, i * count + k))
            side_window = j in (4, count - 6) and first <= i < last and i not in pillars
            ends = (last,) if shape == "van" else (first - 1, last)
            screen = i in ends and 5 <= j <= count - 7
            kinds.append(glass if side_window or screen else black if j == count - 1 else paint)
    for i in (0, len(rings) - 1):
        for j in range(count // 2):
            a, b = i * count + j, i * count + count - 1 - j
            if j < count // 2 - 1:
                faces.append((a, a + 1, b - 1, b))
            else:
                faces.append((a, a + 1, b))
            kinds.append(paint)
    body.indexed(points, faces, kinds)

    parts = Mesh(name + " parts")
    rubber = m.plain("tyre", (0.010, 0.010, 0.010), 0.6, 0.3)
    alloy = m.plain("rim", (0.35, 0.36, 0.37), 0.25, 0.5, 0.9)
    half = max(s[2] for s in stations)
    for s in axles:
        for side in (-1, 1):
            parts.disc((side * (half + 0.002), radius + 0.03, -s), radius + 0.065, (1, 0, 0), black, 28)
            x = side * (half - 0.13)
            profile = [(radius - 0.09, 0.145), (radius - 0.02, 0.15), (radius, 0.12), (radius, -0.08)]
            vertices, wheel_faces = [], []
            n = 28
            for r, d in profile:
                for k in range(n):
                    a = 2 * math.pi * k / n
                    vertices.append((x + side * d, radius + r * math.sin(a), -s + r * math.cos(a)))
            for r in range(len(profile) - 1):
                for k in range(n):
                    wheel_faces.append((r * n + k, r * n + (k + 1) % n, (r + 1) * n + (k + 1) % n, (r + 1) * n + k))
            parts.indexed(vertices, wheel_faces, rubber)
            parts.disc((x + side * 0.142, radius, -s), radius - 0.085, (1, 0, 0), black, 24)
            for k in range(5):
                a = 2 * math.pi * k / 5 + s
                d = [(math.cos(a + o) * r, math.sin(a + o) * r)
                     for o, r in ((-0.25, 0.06), (-0.2, radius - 0.09), (0.2, radius - 0.09), (0.25, 0.06))]
                parts.polygon([(x + side * 0.15, radius + v, -s + u) for u, v in d], alloy)
            parts.disc((x + side * 0.152, radius, -s), 0.075, (1, 0, 0), alloy, 16)
    red = m.plain("tail lamp", (0.28, 0.008, 0.006), 0.1, 0.6, 0.0, 1.0)
    clear = m.plain("head lamp", (0.55, 0.57, 0.58), 0.06, 0.8, 0.5, 1.0)
    if headlights:
        clear = m.light("head lamp, lit", (1.0, 0.93, 0.80), 7.0)
    plate = m.plain("plate", (0.6, 0.6, 0.56), 0.5)
    tail_belt = stations[2][3]
    for side in (-1, 1):
        a, b = sorted((side * 0.56, side * 0.79))
        parts.box((a, tail_belt - 0.26, -0.16), (b, tail_belt - 0.06, 0.005), red)
        a, b = sorted((side * 0.46, side * 0.76))
        parts.box((a, 0.62, -length + 0.16), (b, 0.75, -length - 0.005), clear)
        x0, x1 = sorted((side * (half - 0.06), side * (half + 0.14)))
        parts.box((x0, 1.0, -stations[last][0] - 0.35), (x1, 1.13, -stations[last][0] - 0.25), paint)
        # Door seams and sill.
        for s in (stations[pillars[-1]][0], stations[last][0] + 0.3):
            x0, x1 = sorted((side * (half - 0.03), side * (half - 0.008)))
            parts.box((x0, 0.36, -s - 0.006), (x1, 0.9, -s + 0.006), black)
        x0, x1 = sorted((side * (half - 0.06), side * (half - 0.01)))
        parts.box((x0, 0.25, -axles[1] + 0.4), (x1, 0.33, -axles[0] - 0.4), black)
    parts.box((-0.26, 0.56, -0.06), (0.26, 0.67, 0.03), plate)
    parts.box((-0.26, 0.42, -length + 0.05), (0.26, 0.53, -length - 0.03), plate)
    parts.box((-0.5, 0.54, -length + 0.1), (0.5, 0.64, -length - 0.012), black)
    parts.box((-0.78, 0.30, -length + 0.2), (0.78, 0.40, -length + 0.0), black)
    parts.box((-0.78, 0.32, -0.2), (0.78, 0.44, 0.0), black)
    parts.box((-0.7, 0.2, -length + 0.4), (0.7, 0.4, -0.4), black)
    return [(body.to_mesh(), True), (parts.to_mesh(), False)]


def park(meshes, name, position, turn):
    """Puts a car into the scene; returns its objects."""
    things = []
    for mesh, smooth in meshes:
        thing = place(mesh, name, position, turn)
        if smooth:
            modifier = thing.modifiers.new("subdivision", "SUBSURF")
            modifier.levels = modifier.render_levels = 2
        things.append(thing)
    return things
