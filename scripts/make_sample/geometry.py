"""Polygon building blocks for the sample street.

Conventions: metres, right-handed, +y up, the street runs along -z (Virga's world, docs/conventions.md).
Blender's world is +z up; `Mesh.to_object` is the only place where the two meet: (x, y, z) -> (x, -z, y).
"""

import math

import bpy
import numpy as np


def to_blender(point):
    """A point or direction of our world in Blender's."""
    return (point[0], -point[2], point[1])


class Mesh:
    """Polygons that share one object; each polygon names its material."""

    def __init__(self, name):
        self.name = name
        self.vertices = []
        self.faces = []
        self.face_materials = []
        self.smooth = []
        self.materials = []

    def _slot(self, material):
        if material not in self.materials:
            self.materials.append(material)
        return self.materials.index(material)

    def polygon(self, points, material, smooth=False):
        first = len(self.vertices)
        self.vertices.extend(tuple(p) for p in points)
        self.faces.append(tuple(range(first, first + len(points))))
        self.face_materials.append(self._slot(material))
        self.smooth.append(smooth)

    def indexed(self, points, faces, material, smooth=True):
        """Polygons that share vertices: needed wherever normals or subdivision run across edges.
        `material` is one material, or one for each face."""
        first = len(self.vertices)
        self.vertices.extend(tuple(p) for p in points)
        for index, face in enumerate(faces):
            self.faces.append(tuple(first + i for i in face))
            own = material[index] if isinstance(material, (list, tuple)) else material
            self.face_materials.append(self._slot(own))
            self.smooth.append(smooth)

    def box(self, lo, hi, material):
        self.frame_box(WORLD, lo[0], hi[0], lo[1], hi[1], lo[2], hi[2], material)

    def frame_box(self, frame, u0, u1, v0, v1, n0, n1, material):
        """A box in a facade's frame: u along the wall, v up, n out of it."""
        c = [frame(u, v, n) for n in (n0, n1) for v in (v0, v1) for u in (u0, u1)]
        for face in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
            self.polygon([c[i] for i in face], material)

    def tube(self, points, radii, material, sides=8, cap=True):
        """A round tube along a polyline, one radius a point."""
        points = [np.asarray(p, float) for p in points]
        rings = []
        side = None
        for i, p in enumerate(points):
            along = points[min(i + 1, len(points) - 1)] - points[max(i - 1, 0)]
            along /= np.linalg.norm(along) + 1e-12
            if side is None:
                helper = np.array([1.0, 0, 0]) if abs(along[0]) < 0.8 else np.array([0, 0, 1.0])
                side = np.cross(along, helper)
            side = side - along * np.dot(side, along)
            side /= np.linalg.norm(side) + 1e-12
            other = np.cross(along, side)
            rings.append([p + radii[i] * (math.cos(a) * side + math.sin(a) * other)
                          for a in np.linspace(0, 2 * math.pi, sides, endpoint=False)])
        vertices = [v for ring in rings for v in ring]
        faces = []
        for r in range(len(rings) - 1):
            for s in range(sides):
                t = (s + 1) % sides
                faces.append((r * sides + s, r * sides + t, (r + 1) * sides + t, (r + 1) * sides + s))
        self.indexed(vertices, faces, material)
        if cap:
            self.polygon(rings[0][::-1], material)
            self.polygon(rings[-1], material)

    def lathe(self, centre, profile, material, sides=16):
        """A solid of revolution about the vertical through `centre`; profile is (radius, height) pairs."""
        points = [(centre[0], centre[1] + h, centre[2]) for _, h in profile]
        vertices, faces = [], []
        for (radius, _), p in zip(profile, points):
            for a in np.linspace(0, 2 * math.pi, sides, endpoint=False):
                vertices.append((p[0] + radius * math.cos(a), p[1], p[2] + radius * math.sin(a)))
        for r in range(len(profile) - 1):
            for s in range(sides):
                t = (s + 1) % sides
                faces.append((r * sides + s, r * sides + t, (r + 1) * sides + t, (r + 1) * sides + s))
        self.indexed(vertices, faces, material)

    def disc(self, centre, radius, axis, material, sides=24):
        axis = np.asarray(axis, float)
        helper = np.array([0, 1.0, 0]) if abs(axis[1]) < 0.8 else np.array([1.0, 0, 0])
        side = np.cross(axis, helper)
        side /= np.linalg.norm(side)
        other = np.cross(axis, side)
        self.polygon([np.asarray(centre) + radius * (math.cos(a) * side + math.sin(a) * other)
                      for a in np.linspace(0, 2 * math.pi, sides, endpoint=False)], material)

    def to_mesh(self):
        mesh = bpy.data.meshes.new(self.name)
        mesh.from_pydata([to_blender(v) for v in self.vertices], [], self.faces)
        for material in self.materials:
            mesh.materials.append(material)
        mesh.polygons.foreach_set("material_index", self.face_materials)
        mesh.polygons.foreach_set("use_smooth", self.smooth)
        mesh.update()
        return mesh

    def to_object(self):
        return place(self.to_mesh(), self.name)


def place(mesh, name, position=(0, 0, 0), turn=0.0, scale=1.0):
    """Put a mesh into the scene; `turn` is about +y, in radians. Meshes may be placed many times."""
    thing = bpy.data.objects.new(name, mesh)
    thing.location = to_blender(position)
    thing.rotation_euler = (0, 0, turn)
    thing.scale = (scale, scale, scale)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def frame(origin, along, out):
    """A facade's frame: (u, v, n) -> world. `along` and `out` are horizontal unit vectors (x, z)."""
    def to_world(u, v, n):
        return (origin[0] + along[0] * u + out[0] * n, origin[1] + v, origin[2] + along[1] * u + out[1] * n)
    return to_world


def WORLD(x, y, z):
    return (x, y, z)


def wall(mesh, place_in, u0, u1, v0, v1, holes, material, reveal=0.2, reveal_material=None):
    """A wall with rectangular holes (u0, u1, v0, v1), each with its reveal."""
    us = sorted({u0, u1, *(h[0] for h in holes), *(h[1] for h in holes)})
    vs = sorted({v0, v1, *(h[2] for h in holes), *(h[3] for h in holes)})
    for a, b in zip(us, us[1:]):
        for c, d in zip(vs, vs[1:]):
            u, v = (a + b) / 2, (c + d) / 2
            if any(h[0] < u < h[1] and h[2] < v < h[3] for h in holes):
                continue
            mesh.polygon([place_in(a, c, 0), place_in(b, c, 0), place_in(b, d, 0), place_in(a, d, 0)], material)
    side = reveal_material or material
    for a, b, c, d in holes:
        ring = [(a, c), (b, c), (b, d), (a, d)]
        for (ua, va), (ub, vb) in zip(ring, ring[1:] + ring[:1]):
            mesh.polygon([place_in(ua, va, 0), place_in(ub, vb, 0),
                          place_in(ub, vb, -reveal), place_in(ua, va, -reveal)], side)


# Capital letters as strokes on a 2 x 4 grid, for the shop signs.
_STROKES = {
    "A": ["00-12-14", "14-22-20", "01-21"], "B": ["00-04-14-23-12-02", "12-21-10-00"], "C": ["24-04-00-20"],
    "E": ["24-04-00-20", "02-12"], "F": ["24-04-00", "02-12"], "H": ["00-04", "20-24", "02-22"],
    "I": ["10-14"], "L": ["04-00-20"], "N": ["00-04-20-24"], "O": ["00-04-24-20-00"],
    "P": ["00-04-24-22-02"], "R": ["00-04-24-22-02", "12-20"], "S": ["24-04-02-22-20-00"],
    "T": ["04-24", "10-14"], "U": ["04-00-20-24"], "M": ["00-04-12-24-20"], "V": ["04-10-24"],
    "K": ["00-04", "24-02-20"], "D": ["00-04-14-22-10-00"], "G": ["24-04-00-20-22-12"], "Z": ["04-24-00-20"],
}


def lettering(mesh, place_in, text, u_mid, v0, height, n, material):
    """Flat capital letters, centred at u_mid."""
    cell = height / 4
    stroke = 0.38 * cell
    advance = 3.3 * cell
    u = u_mid - advance * len(text) / 2 + 0.6 * cell
    for letter in text:
        for line in _STROKES.get(letter, []):
            dots = [(u + int(p[0]) * cell, v0 + int(p[1]) * cell) for p in line.split("-")]
            for (ua, va), (ub, vb) in zip(dots, dots[1:]):
                length = math.hypot(ub - ua, vb - va)
                du, dv = (ub - ua) / length * stroke, (vb - va) / length * stroke
                corners = [(ua - du - dv, va - dv + du), (ub + du - dv, vb + dv + du),
                           (ub + du + dv, vb + dv - du), (ua - du + dv, va - dv - du)]
                mesh.polygon([place_in(p, q, n) for p, q in corners], material)
        u += advance
