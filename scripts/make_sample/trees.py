"""Street trees: branches that fork, and leaves as small folded quadrilaterals."""

import math

import numpy as np

import materials as m
from geometry import Mesh


def _turn(direction, angle, around, rng):
    """`direction` bent by `angle` towards a side chosen by `around`."""
    helper = np.array([0, 0, 1.0]) if abs(direction[1]) > 0.8 else np.array([0, 1.0, 0])
    side = np.cross(direction, helper)
    side /= np.linalg.norm(side)
    other = np.cross(direction, side)
    bent = direction * math.cos(angle) + math.sin(angle) * (side * math.cos(around) + other * math.sin(around))
    return bent / np.linalg.norm(bent)


def tree(name, seed, height=8.5, trunk=2.7, leaves_each=110):
    """A mesh of a tree that stands at the origin."""
    rng = np.random.default_rng(seed)
    mesh = Mesh(name)
    wood = m.bark()
    greens = [m.leaf("leaf, dark", (0.030, 0.062, 0.016)), m.leaf("leaf", (0.046, 0.088, 0.020)),
              m.leaf("leaf, turning", (0.13, 0.115, 0.022))]
    tips = []

    def branch(start, direction, length, radius, level):
        steps = 5 if level < 2 else 3
        points, radii = [start], [radius]
        p, d = np.array(start, float), np.array(direction, float)
        for i in range(steps):
            d = d + rng.normal(0, 0.10 + 0.05 * level, 3) + np.array([0, 0.05 if level else 0.0, 0])
            d /= np.linalg.norm(d)
            p = p + d * length / steps
            points.append(p.copy())
            radii.append(radius * (1 - (0.45 if level else 0.3) * (i + 1) / steps))
        mesh.tube(points, radii, wood, 10 if level == 0 else 6 if level == 1 else 4, cap=False)
        if level == 3:
            tips.append((points, d))
            return
        children = (6, 6, 5)[level]
        around = rng.uniform(0, 6.28)
        for k in range(children):
            t = 1.0 if level == 0 and k < 3 else rng.uniform(0.78, 1.0) if level == 0 else rng.uniform(0.3, 1.0)
            at = t * steps
            i = min(int(at), steps - 1)
            q = points[i] + (points[i + 1] - points[i]) * (at - i)
            around += 2.4 + rng.normal(0, 0.2)
            spread = rng.uniform(0.35, 0.75) if level == 0 else rng.uniform(0.45, 1.05)
            reach = (height - trunk) * (0.52, 0.34, 0.20)[level] * rng.uniform(0.8, 1.15)
            branch(q, _turn(d, spread, around, rng), reach, radii[i] * (0.55, 0.5, 0.45)[level], level + 1)

    branch((0, 0, 0), (0, 1, 0), trunk, 0.15 + 0.005 * height, 0)
    mesh.lathe((0, 0, 0), [(0.27, 0), (0.225, 0.12), (0.19, 0.4)], wood, 12)
    for points, direction in tips:
        green = greens[rng.choice(3, p=(0.45, 0.47, 0.08))]
        for _ in range(leaves_each):
            i = rng.integers(0, len(points) - 1)
            q = points[i] + (points[i + 1] - points[i]) * rng.random() + rng.normal(0, 0.16, 3)
            size = rng.uniform(0.035, 0.072)
            axis = rng.normal(0, 1, 3) + np.array([0, -0.7, 0])
            axis /= np.linalg.norm(axis)
            side = np.cross(axis, rng.normal(0, 1, 3))
            side /= np.linalg.norm(side) + 1e-9
            fold = np.cross(axis, side) * size * 0.18
            base, tip = q, q + axis * size * 1.5
            belly = q + axis * size * 0.65
            mesh.polygon([base, belly + side * size * 0.5 + fold, tip, belly - side * size * 0.5 + fold], green)
    return mesh.to_mesh()


def grate(mesh, x, y, z):
    """The iron ring around a street tree, and the earth in it."""
    iron = m.plain("grate", (0.02, 0.019, 0.018), 0.4)
    earth = m.plain("earth", (0.03, 0.022, 0.015), 0.7)
    mesh.box((x - 0.6, y, z - 0.6), (x + 0.6, y + 0.006, z + 0.6), earth)
    for k in range(-6, 7):
        if abs(k) > 2:
            mesh.box((x + k * 0.1 - 0.03, y, z - 0.65), (x + k * 0.1 + 0.03, y + 0.016, z + 0.65), iron)
        else:
            mesh.box((x + k * 0.1 - 0.03, y, z - 0.65), (x + k * 0.1 + 0.03, y + 0.016, z - 0.25), iron)
            mesh.box((x + k * 0.1 - 0.03, y, z + 0.25), (x + k * 0.1 + 0.03, y + 0.016, z + 0.65), iron)
