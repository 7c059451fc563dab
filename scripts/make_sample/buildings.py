"""Town houses: walls with real window openings, shop fronts, cornices, balconies, roofs and chimneys."""

import math

import materials as m
from geometry import lettering, wall

WHITE = (0.72, 0.71, 0.68)
CREAM = (0.66, 0.58, 0.44)
OCHRE = (0.56, 0.40, 0.20)
ROSE = (0.52, 0.32, 0.25)
GREY = (0.44, 0.44, 0.42)
SAGE = (0.40, 0.44, 0.34)
BLUE = (0.38, 0.44, 0.50)
RED_BRICK = (0.30, 0.115, 0.075)
BROWN_BRICK = (0.24, 0.145, 0.10)
YELLOW_BRICK = (0.42, 0.33, 0.20)
SANDSTONE = (0.50, 0.43, 0.33)
SLATE = (0.085, 0.092, 0.105)
CLAY = (0.26, 0.105, 0.06)
GOODS = ((0.5, 0.12, 0.07), (0.55, 0.42, 0.12), (0.12, 0.22, 0.32), (0.6, 0.55, 0.45), (0.15, 0.28, 0.12),
         (0.35, 0.2, 0.1))


def wall_material(kind, colour):
    name = f"{kind} {colour}"
    return {"plaster": m.plaster, "brick": m.brick, "stone": m.stone}[kind](name, colour)


def _pane_material(rng):
    pick = rng.random()
    if pick < 0.13:
        return m.window_glass("pane, lamp on", (0.3, 0.2, 0.1), 1.0 if rng.random() < 0.6 else 0.55)
    if pick < 0.40:
        return m.window_glass("pane, curtain", (0.34, 0.33, 0.31))
    if pick < 0.50:
        return m.window_glass("pane, blind", (0.45, 0.40, 0.30))
    return m.window_glass("pane, dark room", (0.018, 0.02, 0.022))


def window(mesh, at, u0, u1, v0, v1, look, rng):
    """One window in its opening: frame, bars, panes, sill, surround, and what the style adds."""
    paint, trim = look["frame"], look["trim"]
    depth = -0.15
    edge, bar = 0.06, 0.035
    mesh.frame_box(at, u0, u0 + edge, v0, v1, depth - 0.03, depth + 0.04, paint)
    mesh.frame_box(at, u1 - edge, u1, v0, v1, depth - 0.03, depth + 0.04, paint)
    mesh.frame_box(at, u0, u1, v0, v0 + edge, depth - 0.03, depth + 0.04, paint)
    mesh.frame_box(at, u0, u1, v1 - edge, v1, depth - 0.03, depth + 0.04, paint)
    middle = (u0 + u1) / 2
    mesh.frame_box(at, middle - bar, middle + bar, v0, v1, depth - 0.02, depth + 0.05, paint)
    transom = v0 + (v1 - v0) * (0.68 if look["bars"] else 0.5)
    mesh.frame_box(at, u0, u1, transom - bar, transom + bar, depth - 0.02, depth + 0.03, paint)
    if look["bars"]:
        low = v0 + (v1 - v0) * 0.34
        mesh.frame_box(at, u0, u1, low - 0.014, low + 0.014, depth - 0.01, depth + 0.02, paint)

    # Each leaf of the window hangs a little differently, so each reflects a different piece of the sky.
    behind = _pane_material(rng)
    dark = m.window_glass("pane, dark room", (0.018, 0.02, 0.022))
    drawn = rng.uniform(0.15, 0.45) if "curtain" in behind.name and rng.random() < 0.6 else None
    blind = v1 - (v1 - v0) * rng.uniform(0.2, 0.7) if "blind" in behind.name else None
    for a, b in ((u0, middle), (middle, u1)):
        tilt = [rng.uniform(-0.006, 0.006) for _ in range(2)]

        def pane(ua, ub, va, vb, material):
            def n(u, v):
                return depth + tilt[0] * (u - a) / (b - a) + tilt[1] * (v - v0) / (v1 - v0)
            mesh.polygon([at(ua, va, n(ua, va)), at(ub, va, n(ub, va)), at(ub, vb, n(ub, vb)), at(ua, vb, n(ua, vb))],
                         material)
        if drawn is not None:
            split = a + (b - a) * (drawn if a == u0 else 1 - drawn) * (1.0 if a == u0 else 1.0)
            pane(a, split, v0, v1, behind if a == u0 else dark)
            pane(split, b, v0, v1, dark if a == u0 else behind)
        elif blind is not None:
            pane(a, b, v0, blind, dark)
            pane(a, b, blind, v1, behind)
        else:
            pane(a, b, v0, v1, behind)

    mesh.frame_box(at, u0 - 0.1, u1 + 0.1, v0 - 0.09, v0, -0.16, 0.11, trim)
    if look["surround"]:
        s = 0.13
        mesh.frame_box(at, u0 - s, u0, v0, v1, -0.01, 0.04, trim)
        mesh.frame_box(at, u1, u1 + s, v0, v1, -0.01, 0.04, trim)
        mesh.frame_box(at, u0 - s, u1 + s, v1, v1 + 0.2, -0.01, 0.06, trim)
        mesh.frame_box(at, u0 - s - 0.05, u1 + s + 0.05, v1 + 0.2, v1 + 0.27, -0.01, 0.13, trim)
    else:
        mesh.frame_box(at, u0 - 0.08, u1 + 0.08, v1, v1 + 0.22, -0.01, 0.015, trim)
    if look["shutters"]:
        w = (u1 - u0) / 2
        for a in (u0 - w - 0.03, u1 + 0.03):
            mesh.frame_box(at, a, a + w, v0, v1, 0.01, 0.045, look["shutters"])
            count = 16
            for i in range(count):
                v = v0 + 0.06 + (v1 - v0 - 0.12) * i / count
                mesh.frame_box(at, a + 0.05, a + w - 0.05, v, v + 0.045, 0.045, 0.062, look["shutters"])


def railing(mesh, at, u0, u1, v, n0, n1, iron):
    for top in (v + 0.08, v + 0.95):
        mesh.frame_box(at, u0, u1, top, top + 0.04, n1 - 0.035, n1, iron)
        for u in (u0, u1 - 0.03):
            mesh.frame_box(at, u, u + 0.03, top, top + 0.04, n0, n1, iron)
    count = max(int((u1 - u0) / 0.12), 2)
    for i in range(count + 1):
        u = u0 + (u1 - u0 - 0.02) * i / count
        mesh.frame_box(at, u, u + 0.02, v, v + 0.95, n1 - 0.03, n1 - 0.01, iron)
    for n in (n0 + 0.15, n0 + 0.32, n0 + 0.5):
        if n < n1 - 0.05:
            for u in (u0, u1 - 0.02):
                mesh.frame_box(at, u, u + 0.02, v, v + 0.95, n, n + 0.02, iron)


def balcony(mesh, at, u0, u1, v, look):
    mesh.frame_box(at, u0 - 0.35, u1 + 0.35, v - 0.2, v - 0.06, 0, 0.75, look["trim"])
    for u in (u0 - 0.2, u1 + 0.05):
        mesh.frame_box(at, u, u + 0.15, v - 0.55, v - 0.2, 0, 0.4, look["trim"])
    railing(mesh, at, u0 - 0.32, u1 + 0.32, v - 0.06, 0, 0.72, m.plain("iron", (0.014, 0.014, 0.015), 0.35))


def door(mesh, at, u0, u1, top, look, rng):
    """A panelled door with a fanlight, in a deep, dark reveal, and its step."""
    paint = look["door"]
    depth = -0.32
    leaf_top = top - 0.55
    mesh.frame_box(at, u0, u1, 0.12, leaf_top, depth - 0.05, depth, paint)
    for a, b in ((u0 + 0.12, (u0 + u1) / 2 - 0.06), ((u0 + u1) / 2 + 0.06, u1 - 0.12)):
        for c, d in ((0.35, 0.95), (1.1, leaf_top - 0.2)):
            mesh.frame_box(at, a, b, c, d, depth, depth + 0.025, paint)
    mesh.frame_box(at, u0, u1, leaf_top, leaf_top + 0.08, depth - 0.05, depth + 0.05, look["frame"])
    mesh.frame_box(at, u0, u1, leaf_top + 0.08, top, depth - 0.02, depth - 0.01,
                   m.window_glass("pane, lamp on", (0.3, 0.2, 0.1), 1.0) if rng.random() < 0.4 else
                   m.window_glass("pane, dark room", (0.018, 0.02, 0.022)))
    mesh.frame_box(at, u0 - 0.15, u1 + 0.15, 0, 0.12, -0.35, 0.28, look["plinth"])
    brass = m.plain("brass", (0.5, 0.33, 0.1), 0.25, 0.5, 1.0)
    mesh.frame_box(at, (u0 + u1) / 2 + 0.03, (u0 + u1) / 2 + 0.06, 1.05, 1.2, depth, depth + 0.07, brass)
    for u in (u0 - 0.22, u1):
        mesh.frame_box(at, u, u + 0.22, 0.12, top + 0.05, -0.02, 0.1, look["trim"])
    mesh.frame_box(at, u0 - 0.34, u1 + 0.34, top + 0.05, top + 0.3, -0.02, 0.2, look["trim"])
    mesh.frame_box(at, u0 - 0.42, u1 + 0.42, top + 0.3, top + 0.38, -0.02, 0.34, look["trim"])


def awning(mesh, at, u0, u1, v, reach, stripes):
    """A striped canvas with a scalloped edge."""
    count = max(int((u1 - u0) / 0.28), 3)
    drop = 0.62
    for i in range(count):
        a, b = u0 + (u1 - u0) * i / count, u0 + (u1 - u0) * (i + 1) / count
        cloth = stripes[i % 2]
        mesh.polygon([at(a, v, 0.03), at(b, v, 0.03), at(b, v - drop, reach), at(a, v - drop, reach)], cloth)
        hem = [at(a, v - drop, reach), at(b, v - drop, reach)]
        for k in range(5, -1, -1):
            t = k / 5
            hem.append(at(a + (b - a) * t, v - drop - 0.13 - 0.07 * math.sin(math.pi * t), reach + 0.005))
        mesh.polygon(hem, cloth)
    for u in (u0, u1):
        mesh.polygon([at(u, v, 0.03), at(u, v - drop, reach), at(u, v - drop, 0.03)], stripes[0])


def shop(mesh, at, u0, u1, height, look, rng):
    """A shop front: stall riser, panes in a timber frame, a lit room behind with goods, a fascia with the name."""
    wood = look["shop"]
    top = height - 0.72
    door_u = u0 + 0.2 + rng.random() * 0.2 if rng.random() < 0.5 else u1 - 1.4
    mesh.frame_box(at, u0, u1, height - 0.72, height - 0.1, -0.05, 0.1, wood)
    mesh.frame_box(at, u0 - 0.06, u1 + 0.06, height - 0.12, height, -0.05, 0.26, wood)
    lettering(mesh, at, look["sign"], (u0 + u1) / 2, height - 0.58, 0.36, 0.112,
              m.plain("gilt letters", (0.62, 0.5, 0.25), 0.35, 0.5, 0.3))
    for u in (u0, u1 - 0.24):
        mesh.frame_box(at, u, u + 0.24, 0, height - 0.1, -0.1, 0.14, wood)
        mesh.frame_box(at, u - 0.03, u + 0.27, height - 0.95, height - 0.72, -0.1, 0.19, wood)
    bays = max(int((u1 - u0 - 1.6) / 1.3), 1)
    spans = []
    if door_u < (u0 + u1) / 2:
        start, end = door_u + 1.15, u1 - 0.24
    else:
        start, end = u0 + 0.24, door_u
    for i in range(bays):
        spans.append((start + (end - start) * i / bays, start + (end - start) * (i + 1) / bays))
    glass = m.shop_glass()
    for a, b in spans:
        mesh.frame_box(at, a, b, 0, 0.55, -0.16, -0.02, wood)
        mesh.frame_box(at, a + 0.12, b - 0.12, 0.1, 0.45, -0.02, 0.01, wood)
        mesh.frame_box(at, a, a + 0.06, 0.55, top, -0.14, -0.03, wood)
        mesh.frame_box(at, b - 0.06, b, 0.55, top, -0.14, -0.03, wood)
        mesh.frame_box(at, a, b, top - 0.55, top - 0.49, -0.14, -0.04, wood)
        mesh.polygon([at(a, 0.55, -0.1), at(b, 0.55, -0.1), at(b, top, -0.1), at(a, top, -0.1)], glass)
    mesh.frame_box(at, door_u, door_u + 0.1, 0, top, -0.6, -0.5, wood)
    mesh.frame_box(at, door_u + 1.05, door_u + 1.15, 0, top, -0.6, -0.02, wood)
    mesh.frame_box(at, door_u, door_u + 1.15, 0.1, 0.5, -0.58, -0.52, wood)
    mesh.polygon([at(door_u, 0.5, -0.55), at(door_u + 1.1, 0.5, -0.55), at(door_u + 1.1, top, -0.55),
                  at(door_u, top, -0.55)], glass)
    # The room.
    deep = -3.2
    inside = m.lamplit("shop wall", (0.60, 0.40, 0.21), 0.62)
    floor = m.lamplit("shop wood", (0.17, 0.10, 0.055), 0.6)
    for ring in ([(u0, 0, deep), (u1, 0, deep), (u1, top, deep), (u0, top, deep)],
                 [(u0, 0, deep), (u0, 0, -0.1), (u0, top, -0.1), (u0, top, deep)],
                 [(u1, 0, deep), (u1, 0, -0.1), (u1, top, -0.1), (u1, top, deep)],
                 [(u0, top, deep), (u1, top, deep), (u1, top, -0.1), (u0, top, -0.1)]):
        mesh.polygon([at(*p) for p in ring], inside)
    mesh.polygon([at(*p) for p in ((u0, 0.1, deep), (u1, 0.1, deep), (u1, 0.1, -0.1), (u0, 0.1, -0.1))], floor)
    lamp = m.light("shop ceiling light", (1.0, 0.74, 0.45), 1.7)
    for i in range(3):
        a = u0 + (u1 - u0) * (i + 0.25) / 3
        mesh.frame_box(at, a, a + (u1 - u0) / 6, top - 0.06, top - 0.02, -2.4, -0.6, lamp)
    for n in (deep + 0.1, -0.7):
        for level in ((0.6, 1.05, 1.5, 1.95) if n < -1 else (0.6,)):
            mesh.frame_box(at, u0 + 0.2, u1 - 1.6 if n > -1 else u1 - 0.2, level - 0.04, level, n, n + 0.4, floor)
            u = u0 + 0.3
            while u < (u1 - 1.8 if n > -1 else u1 - 0.4):
                w, h = rng.uniform(0.08, 0.28), rng.uniform(0.1, 0.34)
                tone = rng.choice(GOODS)
                mesh.frame_box(at, u, u + w, level, level + h, n + 0.08, n + 0.32,
                               m.lamplit(f"goods {tone}", tone, 0.75))
                u += w + rng.uniform(0.02, 0.3)
    for a, b in ((u0 + 0.02, u0 + 0.36), (u1 - 0.36, u1 - 0.02)):
        for level in (0.6, 1.05, 1.5, 1.95, 2.4):
            mesh.frame_box(at, a, b, level - 0.04, level, deep + 0.5, -0.9, floor)
            n = deep + 0.55
            while n < -1.2:
                w, h = rng.uniform(0.06, 0.22), rng.uniform(0.12, 0.34)
                tone = rng.choice(GOODS)
                mesh.frame_box(at, a + 0.05, b - 0.05, level, level + h, n, n + w,
                               m.lamplit(f"goods {tone}", tone, 0.75))
                n += w + rng.uniform(0.0, 0.2)
    if look["awning"]:
        awning(mesh, at, u0 + 0.1, u1 - 0.1, height - 0.75, 1.25, look["awning"])


def roof(mesh, at, width, eaves, look, rng, depth=9.0):
    """Pitched roof with its gutter, dormers and chimneys."""
    pitch = look["pitch"]
    rise = depth / 2 * math.tan(pitch)
    tiles = look["tiles"]
    mesh.polygon([at(0, eaves, 0.35), at(width, eaves, 0.35), at(width, eaves + rise, -depth / 2),
                  at(0, eaves + rise, -depth / 2)], tiles)
    mesh.polygon([at(0, eaves, -depth), at(width, eaves, -depth), at(width, eaves + rise, -depth / 2),
                  at(0, eaves + rise, -depth / 2)], tiles)
    for u in (0, width):
        mesh.polygon([at(u, 0, 0), at(u, 0, -depth), at(u, eaves, -depth), at(u, eaves + rise, -depth / 2),
                      at(u, eaves, 0)], look["wall"])
    mesh.polygon([at(0, 0, -depth), at(width, 0, -depth), at(width, eaves, -depth), at(0, eaves, -depth)], look["wall"])
    zinc = m.plain("zinc", (0.17, 0.18, 0.19), 0.35, 0.5, 0.5)
    mesh.frame_box(at, 0, width, eaves - 0.1, eaves + 0.02, 0.33, 0.47, zinc)
    if look["dormers"]:
        for i in range(look["dormers"]):
            u = width * (i + 0.5) / look["dormers"]
            base = eaves + 0.9 * math.tan(pitch)
            front = -0.55
            mesh.frame_box(at, u - 0.75, u - 0.55, base - 0.3, base + 1.35, -3.0, front, look["trim"])
            mesh.frame_box(at, u + 0.55, u + 0.75, base - 0.3, base + 1.35, -3.0, front, look["trim"])
            mesh.frame_box(at, u - 0.75, u + 0.75, base - 0.4, base, -3.0, front, look["trim"])
            window(mesh, lambda a, b, n: at(a, b, n + front), u - 0.55, u + 0.55, base, base + 1.3,
                   {**look, "surround": False, "shutters": None}, rng)
            mesh.frame_box(at, u - 0.75, u + 0.75, base + 1.3, base + 1.5, -3.0, front + 0.02, look["trim"])
            mesh.polygon([at(u - 0.75, base + 1.45, front), at(u + 0.75, base + 1.45, front),
                          at(u, base + 2.05, front)], look["trim"])
            for side in (-1, 1):
                mesh.polygon([at(u + side * 0.92, base + 1.4, front + 0.12), at(u, base + 2.12, front + 0.12),
                              at(u, base + 2.12, -4.0), at(u + side * 0.92, base + 1.4, -4.0)], tiles)
    stack = m.brick("chimney brick", (0.27, 0.12, 0.085))
    pot = m.plain("chimney pot", (0.36, 0.16, 0.09), 0.7)
    for u in (0.35, width - 0.75):
        top = eaves + rise + rng.uniform(0.9, 1.5)
        n = -depth / 2 + 0.5
        mesh.frame_box(at, u, u + 0.6, eaves, top, n - 1.3, n, stack)
        mesh.frame_box(at, u - 0.07, u + 0.67, top - 0.16, top, n - 1.37, n + 0.07, stack)
        for k in range(3):
            x, _, z = at(u + 0.3, 0, n - 0.25 - 0.4 * k)
            mesh.lathe((x, top, z), [(0.11, 0), (0.13, 0.08), (0.1, 0.4), (0.13, 0.45), (0.1, 0.45), (0.02, 0.4)],
                       pot, 10)


def building(mesh, at, width, spec, rng):
    """One house; `at` is its facade's frame, u from 0 to width. Returns the height of the eaves."""
    kind, colour = spec["wall"]
    face = wall_material(kind, colour)
    trim_colour = spec.get("trim", WHITE)
    tone = spec.get("shop_paint", (0.02, 0.05, 0.04))
    look = {
        "wall": face,
        "trim": m.plaster(f"trim {trim_colour}", trim_colour),
        "plinth": m.stone("plinth", (0.26, 0.25, 0.24), (0.8, 0.3)),
        "frame": m.painted(f"frame {spec.get('frame', WHITE)}", spec.get("frame", WHITE)),
        "door": m.painted(f"door {spec.get('door', (0.02, 0.05, 0.03))}", spec.get("door", (0.02, 0.05, 0.03)), 0.25),
        "shop": m.painted(f"shop {tone}", tone, 0.3),
        "surround": spec.get("surround", True), "bars": spec.get("bars", False),
        "shutters": m.painted(f"shutter {spec['shutters']}", spec["shutters"], 0.5) if "shutters" in spec else None,
        "sign": spec.get("sign", ""),
        "awning": [m.plain(f"canvas {c}", c, 0.8, 0.2) for c in spec["awning"]] if "awning" in spec else None,
        "pitch": spec.get("pitch", math.radians(40)), "dormers": spec.get("dormers", 0),
        "tiles": m.roof_tiles(f"tiles {spec.get('tiles', SLATE)}", spec.get("tiles", SLATE)),
    }
    ground, storey, floors = spec.get("ground", 4.0), spec.get("storey", 3.25), spec["floors"]
    eaves = ground + storey * floors
    bays = max(int(round(width / spec.get("bay", 2.6))), 2)
    margin = 0.55
    pitch = (width - 2 * margin) / bays
    wide = spec.get("window", 1.15)

    # Ground floor: a shop, or a door among windows.
    holes, fills = [], []
    if spec.get("sign"):
        span = (0.45, width - 0.45 if not spec.get("side_door") else width - 2.3)
        holes.append((span[0], span[1], 0, ground - 0.1))
        fills.append(("shop", span[0], span[1]))
        if spec.get("side_door"):
            holes.append((width - 1.7, width - 0.6, 0, 3.0))
            fills.append(("door", width - 1.7, width - 0.6))
    else:
        own = int(rng.random() * bays)
        for i in range(bays):
            u = margin + pitch * (i + 0.5)
            if i == own:
                holes.append((u - 0.6, u + 0.6, 0, 3.05))
                fills.append(("door", u - 0.6, u + 0.6))
            else:
                holes.append((u - wide / 2, u + wide / 2, 1.05, 3.05))
                fills.append(("window", u - wide / 2, u + wide / 2))
    ground_wall = m.stone(f"ground stone {spec['base']}", spec["base"]) if "base" in spec else face
    wall(mesh, at, 0, width, 0, ground, holes, ground_wall, 0.34)
    for what, a, b in fills:
        if what == "shop":
            shop(mesh, at, a, b, ground - 0.1, look, rng)
        elif what == "door":
            door(mesh, at, a, b, 3.0, look, rng)
        else:
            window(mesh, at, a, b, 1.05, 3.05, {**look, "shutters": None}, rng)
    solid = [(0, width)]
    for a, b in sorted((h[0], h[1]) for h in holes if h[2] == 0):
        last = solid.pop()
        solid += [(last[0], a - 0.2), (b + 0.2, last[1])]
    for a, b in solid:
        if b > a:
            mesh.frame_box(at, a, b, 0, 0.55, -0.01, 0.06, look["plinth"])
    mesh.frame_box(at, 0, width, ground - 0.06, ground + 0.16, -0.02, 0.14, look["trim"])

    # Upper floors.
    for floor in range(floors):
        v = ground + storey * floor
        low, high = v + 0.85, v + 0.85 + storey * 0.56
        french = spec.get("balconies") and floor in spec["balconies"]
        holes = []
        for i in range(bays):
            u = margin + pitch * (i + 0.5)
            tall = french and i in spec.get("balcony_bays", range(bays))
            holes.append((u - wide / 2, u + wide / 2, v + 0.2 if tall else low, high))
        wall(mesh, at, 0, width, v, v + storey, holes, face)
        for i, (a, b, c, d) in enumerate(holes):
            window(mesh, at, a, b, c, d, look, rng)
            if c < low:
                balcony(mesh, at, a, b, v + 0.2, look)
        if spec.get("bands") and floor:
            mesh.frame_box(at, 0, width, v - 0.08, v + 0.08, -0.02, 0.07, look["trim"])
    if spec.get("quoins"):
        v, i = ground + 0.2, 0
        while v < eaves - 0.4:
            w = 0.55 if i % 2 else 0.36
            for a, b in ((0, w), (width - w, width)):
                mesh.frame_box(at, a, b, v, v + 0.3, -0.02, 0.035, look["trim"])
            v, i = v + 0.33, i + 1

    # Cornice with its dentils.
    mesh.frame_box(at, 0, width, eaves - 0.42, eaves - 0.3, -0.02, 0.12, look["trim"])
    mesh.frame_box(at, 0, width, eaves - 0.14, eaves, -0.02, 0.34, look["trim"])
    mesh.frame_box(at, 0, width, eaves - 0.3, eaves - 0.14, -0.02, 0.1, look["trim"])
    u = 0.1
    while u < width - 0.15:
        mesh.frame_box(at, u, u + 0.12, eaves - 0.28, eaves - 0.14, 0.1, 0.24, look["trim"])
        u += 0.3
    roof(mesh, at, width, eaves, look, rng)

    # Downpipe at the joint between two houses.
    pipe = m.plain("downpipe", (0.10, 0.105, 0.11), 0.4, 0.5, 0.4)
    mesh.tube([at(0.14, eaves - 0.05, 0.36), at(0.14, eaves - 0.5, 0.16), at(0.14, 0.1, 0.13)], [0.05] * 3, pipe, 8)
    for k in range(int(eaves / 2)):
        mesh.frame_box(at, 0.06, 0.22, 1.2 + 2 * k, 1.26 + 2 * k, 0, 0.2, pipe)
    return eaves
