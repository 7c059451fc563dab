"""The street between the houses: road, pavements, markings, lamps, signs, bins, wires."""

import math

import materials as m
from geometry import Mesh

ROAD = 4.0        # half width of the carriageway [m]
KERB = 0.12       # height of the pavement [m]
FRONT = 8.0       # distance of the house fronts from the middle of the road [m]
NEAR, FAR = 34.0, -92.0


def ground(rng):
    mesh = Mesh("ground")
    tar, newer = m.asphalt(), m.asphalt("asphalt, newer", 0.62)
    slabs = m.paving("slabs", (0.20, 0.195, 0.185), 0.62, 0.42)
    kerbstone = m.stone("kerbstone", (0.30, 0.295, 0.285), (1.0, 3.0), 0.02)
    side_gap = (-46.0, -54.0)
    mesh.polygon([(-60, 0, 60), (60, 0, 60), (60, 0, -140), (-60, 0, -140)], tar)
    mesh.polygon([(-900, -0.05, 60), (900, -0.05, 60), (900, -0.05, -1200), (-900, -0.05, -1200)],
                 m.plain("far ground", (0.08, 0.09, 0.06), 0.9))
    for side in (-1, 1):
        for z0, z1 in ((NEAR, FAR + 9),) if side < 0 else ((NEAR, side_gap[0] + 0.8), (side_gap[1] - 0.8, FAR + 9)):
            a, b = sorted((side * (ROAD + 0.15), side * (FRONT + 0.4)))
            mesh.box((a, -0.2, z1), (b, KERB, z0), slabs)
            a, b = sorted((side * ROAD, side * (ROAD + 0.15)))
            mesh.box((a, -0.2, z1), (b, KERB + 0.004, z0), kerbstone)
            # A gutter of setts along the kerb.
            a, b = sorted((side * (ROAD - 0.32), side * ROAD))
            mesh.box((a, -0.1, z1), (b, 0.003, z0), m.paving("setts", (0.12, 0.118, 0.115), 0.16, 0.1, (0.35, 0.1)))
    mesh.box((-40, -0.2, FAR), (40, KERB, FAR + 4), slabs)
    paint = m.road_paint()
    z = 30.0
    while z > -84:
        if not -29.8 < z < -22:
            mesh.box((-0.06, 0, z - 2.2), (0.06, 0.004, z), paint)
        z -= 5.2
    for k in range(8):
        x = -ROAD + 0.35 + k * 0.96
        mesh.box((x, 0, -28.6), (x + 0.5, 0.004, -25.4), paint)
    mesh.box((0.15, 0, -24.2), (ROAD - 0.4, 0.004, -23.8), paint)
    for k in range(15):
        mesh.box((-ROAD + 2.05, 0, -2.0 - 5.3 * k - 0.05), (-ROAD + 0.4, 0.0035, -2.0 - 5.3 * k + 0.05), paint)
    # Where pipes were mended.
    for x0, x1, z0, z1 in ((0.5, 1.6, -12.2, -18.5), (-1.6, -0.4, -31, -39), (1.9, 3.3, -6.0, -8.3)):
        mesh.polygon([(x0, 0.003, z0), (x1, 0.003, z0), (x1, 0.003, z1), (x0, 0.003, z1)], newer)
    iron = m.plain("cast iron", (0.035, 0.033, 0.031), 0.3, 0.5, 0.6)
    for x, z in ((0.55, -9.4), (-0.8, -21.0), (1.2, -36.0)):
        mesh.lathe((x, 0, z), [(0.42, 0.0), (0.42, 0.010), (0.36, 0.012), (0.355, 0.004), (0.34, 0.012),
                               (0.0, 0.012)], iron, 40)
        for r in range(-4, 5):
            w = math.sqrt(max(0.31 ** 2 - (r * 0.07) ** 2, 0))
            mesh.box((x - w, 0.01, z + r * 0.07 - 0.012), (x + w, 0.019, z + r * 0.07 + 0.012), iron)
    for z in (-8.0, -26.0 + 6, -48.0):
        for k in range(6):
            mesh.box((ROAD - 0.34, 0.0, z - 0.3 + k * 0.1), (ROAD - 0.02, 0.012, z - 0.25 + k * 0.1), iron)
    # Fallen leaves, mostly under the trees' side of the kerb.
    dead = [m.leaf("leaf, fallen", (0.16, 0.09, 0.02)), m.leaf("leaf, turning", (0.13, 0.115, 0.022)),
            m.plain("leaf, wet", (0.05, 0.028, 0.012), 0.3)]
    for _ in range(1500):
        side = rng.choice((-1, 1))
        x = side * rng.triangular(2.4, 7.8, 4.1)
        z = rng.uniform(-46, 2)
        y = (KERB if abs(x) > ROAD else 0.0) + 0.006
        size, a = rng.uniform(0.03, 0.07), rng.uniform(0, 6.28)
        c, s = math.cos(a) * size, math.sin(a) * size
        mesh.polygon([(x - c, y, z - s), (x + s * 0.5, y + 0.012, z - c * 0.5), (x + c, y, z + s),
                      (x - s * 0.5, y + 0.010, z + c * 0.5)], rng.choice(dead))
    return mesh


def lamp_post(mesh, x, z, reach, lit):
    """A cast-iron post with a lantern on an arm over the road."""
    iron = m.painted("lamp iron", (0.012, 0.022, 0.018), 0.3)
    mesh.lathe((x, KERB, z), [(0.17, 0), (0.17, 0.12), (0.13, 0.16), (0.12, 0.8), (0.14, 0.84), (0.08, 0.95),
                              (0.062, 1.2), (0.05, 4.7), (0.075, 4.75), (0.06, 4.85), (0.03, 5.1), (0.0, 5.2)], iron,
                              16)
    arc = [(x + reach * (1 - math.cos(t)) * 0.5 * 1.0 + reach * 0.5 * (t / math.pi), 4.55 + KERB + 0.42 * math.sin(t),
            z)
           for t in [math.pi * k / 10 for k in range(11)]]
    mesh.tube(arc, [0.032] * len(arc), iron, 8)
    mesh.tube([(x, 4.2, z), (x + reach * 0.35, 4.98, z)], [0.018, 0.018], iron, 6)
    cx, cy = x + reach, 4.55 + KERB
    mesh.lathe((cx, cy, z), [(0.02, 0.12), (0.08, 0.06), (0.24, -0.06), (0.26, -0.1), (0.19, -0.1), (0.0, -0.06)],
               iron, 8)
    glow = m.light("lamp, lit", (1.0, 0.66, 0.30), 9.0) if lit else m.window_glass("lamp, dark", (0.3, 0.29, 0.26))
    mesh.lathe((cx, cy, z), [(0.17, -0.1), (0.11, -0.46), (0.0, -0.47)], glow, 8)
    for k in range(4):
        a = math.pi / 4 + k * math.pi / 2
        mesh.tube([(cx + 0.18 * math.cos(a), cy - 0.1, z + 0.18 * math.sin(a)),
                   (cx + 0.118 * math.cos(a), cy - 0.47, z + 0.118 * math.sin(a))], [0.012, 0.012], iron, 5)
    mesh.lathe((cx, cy, z), [(0.13, -0.46), (0.1, -0.5), (0.02, -0.56)], iron, 8)


def sign(mesh, x, z, kind):
    steel = m.plain("sign post", (0.20, 0.205, 0.21), 0.35, 0.5, 0.8)
    white = m.plain("sign white", (0.62, 0.62, 0.6), 0.35)
    red = m.plain("sign red", (0.42, 0.012, 0.014), 0.35)
    blue = m.plain("sign blue", (0.015, 0.06, 0.26), 0.35)
    mesh.tube([(x, KERB, z), (x, 2.95, z)], [0.03, 0.03], steel, 10)
    y, front = 2.62, z + 0.045
    mesh.disc((x, y, front - 0.008), 0.31, (0, 0, 1), m.plain("sign back", (0.2, 0.2, 0.21), 0.4))
    if kind == "no entry":
        mesh.disc((x, y, front), 0.305, (0, 0, 1), white, 40)
        mesh.disc((x, y, front + 0.002), 0.29, (0, 0, 1), red, 40)
        mesh.box((x - 0.21, y - 0.05, front), (x + 0.21, y + 0.05, front + 0.005), white)
    else:
        mesh.disc((x, y, front), 0.305, (0, 0, 1), red, 40)
        mesh.disc((x, y, front + 0.002), 0.25, (0, 0, 1), blue, 40)
        mesh.frame_box(lambda u, v, n: (x + (u - v) * 0.7071, y + (u + v) * 0.7071, front + n),
                       -0.27, 0.27, -0.03, 0.03, 0.0, 0.005, red)


def bollard(mesh, x, z):
    iron = m.painted("lamp iron", (0.012, 0.022, 0.018), 0.3)
    mesh.lathe((x, KERB, z), [(0.10, 0), (0.10, 0.1), (0.07, 0.14), (0.06, 0.78), (0.085, 0.82), (0.085, 0.86),
                              (0.06, 0.9), (0.07, 0.96), (0.0, 1.02)], iron, 14)
    mesh.lathe((x, KERB, z), [(0.0645, 0.62), (0.0635, 0.72)], m.plain("bollard band", (0.6, 0.6, 0.58), 0.4), 14)


def bin_(mesh, x, z):
    green = m.painted("bin", (0.015, 0.05, 0.03), 0.3)
    mesh.lathe((x, KERB, z), [(0.24, 0.02), (0.27, 0.75), (0.30, 0.78), (0.30, 0.86), (0.22, 1.0), (0.0, 1.04)],
               green, 18)
    mesh.box((x - 0.31, KERB + 0.62, z - 0.14), (x + 0.31, KERB + 0.74, z + 0.14),
             m.plain("car trim", (0.012, 0.012, 0.012), 0.5))


def bench(mesh, x, z):
    wood = m.painted("bench", (0.13, 0.065, 0.03), 0.35)
    iron = m.painted("lamp iron", (0.012, 0.022, 0.018), 0.3)
    for k in range(4):
        mesh.box((x - 0.22 + k * 0.12, KERB + 0.44, z - 0.8), (x - 0.13 + k * 0.12, KERB + 0.47, z + 0.8), wood)
    for k in range(3):
        mesh.box((x + 0.25 + k * 0.02, KERB + 0.58 + k * 0.13, z - 0.8),
                 (x + 0.28 + k * 0.02, KERB + 0.68 + k * 0.13, z + 0.8), wood)
    for dz in (-0.65, 0.65):
        mesh.box((x - 0.2, KERB, z + dz - 0.03), (x - 0.15, KERB + 0.44, z + dz + 0.03), iron)
        mesh.box((x + 0.22, KERB, z + dz - 0.03), (x + 0.27, KERB + 0.9, z + dz + 0.03), iron)


def cafe_table(mesh, x, z, rng):
    metal = m.plain("table", (0.25, 0.255, 0.26), 0.2, 0.5, 0.8)
    seat = m.painted("chair", (0.18, 0.03, 0.02), 0.3)
    mesh.lathe((x, KERB, z), [(0.22, 0), (0.22, 0.02), (0.025, 0.05), (0.025, 0.71), (0.33, 0.72), (0.33, 0.745),
                              (0.0, 0.745)], metal, 20)
    for a in (rng.uniform(0, 1), rng.uniform(2.6, 3.6)):
        cx, cz = x + 0.62 * math.cos(a), z + 0.62 * math.sin(a)
        out = (math.cos(a), math.sin(a))

        def at(u, v, n):
            return (cx + out[0] * n - out[1] * u, KERB + v, cz + out[1] * n + out[0] * u)
        mesh.frame_box(at, -0.2, 0.2, 0.44, 0.47, -0.2, 0.2, seat)
        for v in (0.62, 0.74, 0.86):
            mesh.frame_box(at, -0.2, 0.2, v, v + 0.07, 0.19, 0.21, seat)
        for u in (-0.19, 0.17):
            mesh.frame_box(at, u, u + 0.02, 0, 0.93, 0.18, 0.2, metal)
            mesh.frame_box(at, u, u + 0.02, 0, 0.45, -0.2, -0.18, metal)


def wire(mesh, a, b, sag):
    dark = m.plain("wire", (0.01, 0.01, 0.01), 0.5)
    points = []
    for k in range(25):
        t = k / 24
        points.append((a[0] + (b[0] - a[0]) * t, a[1] + (b[1] - a[1]) * t - 4 * sag * t * (1 - t),
                       a[2] + (b[2] - a[2]) * t))
    mesh.tube(points, [0.011] * len(points), dark, 5)


def furniture(rng):
    mesh = Mesh("furniture")
    for z, lit in ((12, True), (-12.5, True), (-34, True), (-57, False), (-78, True)):
        lamp_post(mesh, -4.55, z, 1.3, lit)
    for z, lit in ((1, True), (-22.5, True), (-43.5, True), (-66, True)):
        lamp_post(mesh, 4.55, z, -1.3, lit)
    sign(mesh, 4.5, -17.3, "no entry")
    sign(mesh, -4.5, -24.6, "no stopping")
    sign(mesh, 4.6, -44.9, "no stopping")
    for z in (-11.6, -13.2, -14.8, -23.9, -30.2):
        bollard(mesh, 4.5, z)
    for z in (-23.6, -30.4):
        bollard(mesh, -4.5, z)
    bin_(mesh, 4.75, -19.0)
    bin_(mesh, -4.75, -19.2)
    bench(mesh, 5.2, -33.0)
    for x, z in ((-6.6, -16.2), (-6.4, -18.0), (-6.7, -20.1), (6.7, -24.8), (6.5, -26.6)):
        cafe_table(mesh, x, z, rng)
    # A chalk board on the pavement.
    wood = m.painted("bench", (0.13, 0.065, 0.03), 0.35)
    for lean in (-1, 1):
        def at(u, v, n):
            return (6.0 + u, KERB + v, -20.5 + lean * (0.25 - v * 0.22) + n)
        mesh.frame_box(at, -0.3, 0.3, 0.05, 1.0, -0.015, 0.015, wood)
        mesh.frame_box(at, -0.25, 0.25, 0.2, 0.95, lean * 0.016 - 0.002, lean * 0.016 + 0.002,
                       m.plain("slate", (0.02, 0.022, 0.02), 0.6))
    for z, h in ((-15, 9.2), (-15.2, 8.9), (-37, 9.8), (-37.2, 9.5), (-60, 9.4), (20, 9.0)):
        wire(mesh, (-FRONT, h, z), (FRONT, h - 0.7, z - 4), 0.55)
    return mesh
