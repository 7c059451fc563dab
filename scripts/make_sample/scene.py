"""Puts the street together: which houses stand where, trees, cars, church, hills, sky, camera."""

import math
import random

import bpy
import numpy as np

import buildings as b
import materials as m
import street
from cars import car, park
from geometry import Mesh, frame, place, to_blender
from trees import grate, tree

# Left side, from behind the camera to the far end; right side likewise. Widths in metres.
LEFT = [
    (11, dict(wall=("plaster", b.GREY), floors=3)),
    (10, dict(wall=("brick", b.BROWN_BRICK), floors=2, tiles=b.CLAY)),
    (12.5, dict(wall=("plaster", b.CREAM), floors=3, sign="LIBRI", shop_paint=(0.05, 0.015, 0.015))),
    (11.4, dict(wall=("brick", b.RED_BRICK), floors=3, trim=b.SANDSTONE, quoins=True, sign="CAFE MIRO", side_door=True,
                shop_paint=(0.016, 0.045, 0.035), awning=((0.42, 0.04, 0.03), (0.62, 0.58, 0.5)), dormers=2,
                bars=True)),
    (9.2, dict(wall=("plaster", b.WHITE), floors=3, balconies=(0, 1), base=b.SANDSTONE, frame=(0.06, 0.05, 0.04),
               trim=(0.62, 0.6, 0.55), shutters=(0.10, 0.16, 0.17), surround=False, tiles=b.CLAY,
               pitch=math.radians(30))),
    (12.2, dict(wall=("stone", b.SANDSTONE), floors=3, trim=(0.55, 0.49, 0.4), bands=True, balconies=(0,),
                balcony_bays=(1, 2, 3), dormers=3, bars=True)),
    (9.6, dict(wall=("plaster", b.ROSE), floors=2, storey=3.5, sign="TABAC", shop_paint=(0.03, 0.04, 0.07),
               awning=((0.05, 0.11, 0.22), (0.6, 0.58, 0.52)), shutters=(0.30, 0.30, 0.27), surround=False,
               tiles=b.CLAY)),
    (13, dict(wall=("brick", b.YELLOW_BRICK), floors=3, trim=b.WHITE, quoins=True, bands=True, dormers=3)),
    (9.4, dict(wall=("plaster", b.SAGE), floors=3, balconies=(0, 1, 2), balcony_bays=(1,))),
    (12, dict(wall=("plaster", b.CREAM), floors=2, shutters=(0.06, 0.13, 0.09), surround=False, tiles=b.CLAY)),
    (12, dict(wall=("brick", b.RED_BRICK), floors=3)),
]
RIGHT = [
    (12, dict(wall=("brick", b.RED_BRICK), floors=3, bands=True)),
    (11, dict(wall=("plaster", b.OCHRE), floors=3, tiles=b.CLAY)),
    (12, dict(wall=("stone", b.GREY), floors=3, sign="BANCA")),
    (11.2, dict(wall=("plaster", b.BLUE), floors=3, balconies=(0,), sign="FLORA", side_door=True,
                shop_paint=(0.12, 0.08, 0.025), awning=((0.05, 0.15, 0.07), (0.58, 0.56, 0.48)))),
    (12.6, dict(wall=("plaster", b.OCHRE), floors=3, trim=(0.62, 0.58, 0.48), quoins=True, sign="HOTEL SOLE",
                bands=True,
                shop_paint=(0.035, 0.02, 0.012), balconies=(0, 1), balcony_bays=(0, 2, 4), dormers=2)),
    (9.8, dict(wall=("brick", b.BROWN_BRICK), floors=4, storey=3.0, trim=b.WHITE, bars=True)),
    (11.4, dict(wall=("plaster", b.WHITE), floors=2, storey=3.4, shutters=(0.07, 0.12, 0.20), surround=False,
                tiles=b.CLAY)),
    ("gap", 8.0),
    (12, dict(wall=("stone", b.SANDSTONE), floors=3, bands=True, dormers=3)),
    (11, dict(wall=("plaster", b.ROSE), floors=3, balconies=(0, 1), balcony_bays=(1, 2))),
    (12, dict(wall=("brick", b.YELLOW_BRICK), floors=2, tiles=b.CLAY)),
]


def _row(specs, side, rng):
    """Houses along one side; `side` is -1 (left) or +1. Each starts where the last one ended."""
    z = street.NEAR
    for index, (width, spec) in enumerate(specs):
        if width == "gap":
            z -= spec
            continue
        mesh = Mesh(f"house {side} {index}")
        # A house front set forward or back by a hand's breadth makes the row a row of houses.
        set_back = rng.uniform(0.0, 0.14)
        x = side * (street.FRONT + set_back)
        if side < 0:
            at = frame((x, 0.05, z), (0, -1), (1, 0))
        else:
            at = frame((x, 0.05, z - width), (0, 1), (-1, 0))
        b.building(mesh, at, width, spec, rng)
        mesh.to_object()
        z -= width


def _closing_rows(rng):
    """The houses that end the street, ahead and behind, and one to be seen down the side street."""
    mesh = Mesh("closing")
    far = [dict(wall=("plaster", b.CREAM), floors=2, tiles=b.CLAY, shutters=(0.12, 0.16, 0.14), surround=False),
           dict(wall=("plaster", b.WHITE), floors=1, storey=3.4, tiles=b.CLAY),
           dict(wall=("stone", b.SANDSTONE), floors=2, tiles=b.SLATE, dormers=2),
           dict(wall=("plaster", b.ROSE), floors=2, tiles=b.CLAY)]
    u = -24.0
    for k in range(4):
        b.building(mesh, frame((u, 0.05, street.FAR - 0.3 * k), (1, 0), (0, 1)), 12, far[k], rng)
        u += 12
    for k, u in enumerate((26.0, 13.5, 1.0, -11.5)):
        b.building(mesh, frame((u, 0.05, street.NEAR + 9), (-1, 0), (0, -1)), 12.5, far[(k + 1) % 4], rng)
    b.building(mesh, frame((30, 0.05, -62), (0, 1), (-1, 0)), 22,
               dict(wall=("plaster", b.CREAM), floors=3, tiles=b.CLAY), rng)
    mesh.to_object()


def _church(x, z):
    mesh = Mesh("church")
    wall = m.stone("church stone", (0.36, 0.33, 0.28), (0.8, 0.4))
    dark = m.plain("louvre", (0.03, 0.03, 0.03), 0.7)
    slate = m.roof_tiles("church slate", b.SLATE)
    mesh.box((x - 3.2, 0, z - 3.2), (x + 3.2, 27, z + 3.2), wall)
    for y in (9, 17.5, 26.6):
        mesh.box((x - 3.45, y, z - 3.45), (x + 3.45, y + 0.45, z + 3.45), wall)
    for dx in (-1.2, 1.2):
        mesh.box((x + dx - 0.6, 19.5, z), (x + dx + 0.6, 24.2, z + 3.22), dark)
        mesh.disc((x + dx, 24.2, z + 3.22), 0.6, (0, 0, 1), dark)
    mesh.disc((x, 14.6, z + 3.24), 1.3, (0, 0, 1), m.plain("clock", (0.6, 0.58, 0.5), 0.5), 40)
    mesh.box((x - 0.05, 14.6, z + 3.2), (x + 0.05, 15.6, z + 3.28), dark)
    mesh.box((x, 14.55, z + 3.2), (x + 0.7, 14.65, z + 3.28), dark)
    corners = [(x - 3.3, 27, z + 3.3), (x + 3.3, 27, z + 3.3), (x + 3.3, 27, z - 3.3), (x - 3.3, 27, z - 3.3)]
    for k in range(4):
        mesh.polygon([corners[k], corners[(k + 1) % 4], (x, 41, z)], slate)
    for dx in (-3.1, 3.1):
        mesh.lathe((x + dx, 27, z + 3.1), [(0.5, 0), (0.5, 0.6), (0.3, 0.7), (0.0, 3.0)], wall, 8)
    mesh.tube([(x, 40.5, z), (x, 43, z)], [0.07, 0.05], dark, 6)
    mesh.box((x - 0.5, 42.1, z - 0.05), (x + 0.5, 42.2, z + 0.05), dark)
    nave = frame((x - 6, 0, z - 4), (1, 0), (0, 1))
    mesh.frame_box(nave, 0, 12, 0, 12, -26, 0, wall)
    for a, c in ((0, 6), (12, 6)):
        mesh.polygon([nave(a, 12, 0.3), nave(c, 18.5, 0.3), nave(c, 18.5, -26), nave(a, 12, -26)], slate)
    mesh.polygon([nave(0, 12, 0), nave(12, 12, 0), nave(6, 18.5, 0)], wall)
    mesh.to_object()


def _hills():
    """Two ridges of wooded hill; the far one paler."""
    rng = np.random.default_rng(11)
    for name, distance, height, tone in (("near hill", 430, 62, (0.105, 0.135, 0.125)),
                                         ("far hill", 900, 165, (0.25, 0.285, 0.31))):
        mesh = Mesh(name)
        xs = np.linspace(-1.3, 1.3, 261) * distance
        ridge = np.zeros_like(xs)
        for octave in range(7):
            phase = rng.uniform(0, 6.28)
            ridge += np.sin(xs / distance * 2.1 * 1.9 ** octave + phase) * 0.6 ** octave
        ridge = height * (0.75 + 0.16 * ridge)
        bumps = rng.normal(0, height * 0.008, xs.size)
        vertices, faces = [], []
        for k, (y, z) in enumerate(((0.0, 0.0), (0.55, 0.12), (0.85, 0.26), (1.0, 0.4))):
            vertices += [(x, r * y + s, -distance * (1 + z)) for x, r, s in zip(xs, ridge, bumps)]
            if k:
                n = xs.size
                faces += [((k - 1) * n + i, (k - 1) * n + i + 1, k * n + i + 1, k * n + i) for i in range(n - 1)]
        mesh.indexed(vertices, faces, m.hillside(name, tone))
        mesh.to_object()


def build():
    """The whole scene, the same every time."""
    rng = random.Random(20)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    street.ground(rng).to_object()
    street.furniture(rng).to_object()
    _row(LEFT, -1, rng)
    _row(RIGHT, 1, rng)
    _closing_rows(rng)
    _church(-7.5, -128)
    _hills()

    kinds = [tree(f"tree {k}", 40 + k, height, 2.7)
             for k, height in enumerate((8.6, 7.6, 9.4))]
    grates = Mesh("grates")
    places = [(-5.1, z) for z in (8, -8, -27.5, -36.5, -46.5, -53, -63, -72)]
    places += [(5.2, z) for z in (9, -8.6, -29, -38.5, -57, -71, -79)]
    places += [(x, -88.8) for x in (-15, -4.2, 9.5, 17)]
    for k, (x, z) in enumerate(places):
        place(kinds[k % 3], f"tree at {x} {z}", (x, street.KERB, z), rng.uniform(0, 6.28), rng.uniform(0.85, 1.08))
        grate(grates, x, street.KERB, z)
    grates.to_object()

    models = {
        "blue": car("blue hatchback", "hatchback", (0.02, 0.05, 0.13)),
        "red": car("red hatchback", "hatchback", (0.26, 0.012, 0.012)),
        "grey": car("grey saloon", "saloon", (0.085, 0.09, 0.10)),
        "black": car("black saloon", "saloon", (0.012, 0.012, 0.014)),
        "green": car("green hatchback", "hatchback", (0.03, 0.08, 0.05)),
        "van": car("white van", "van", (0.60, 0.60, 0.58)),
    }
    # On the left they face the camera: a turn of pi, so the place given is the tail.
    for key, z in (("grey", -21.7), ("red", -32.6), ("van", -38.3), ("blue", -43.4), ("black", -49.2), ("green", -54.5),
                   ("grey", -61), ("red", -70), ("blue", 2)):
        park(models[key], f"{key} car", (-2.93 + rng.uniform(-0.06, 0.06), 0, z), math.pi + rng.uniform(-0.02, 0.02))
    for key, z in (("black", -30.6), ("green", -35.8), ("van", -57), ("grey", -64), ("blue", -70)):
        park(models[key], f"{key} car", (2.95 + rng.uniform(-0.06, 0.06), 0, z), rng.uniform(-0.02, 0.02))

    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("overcast")
    m.overcast_sky(scene.world)
    return scene


def moving_car():
    """The car that drives; its objects are moved by `drive`."""
    return park(car("moving hatchback", "hatchback", (0.16, 0.17, 0.18), headlights=True), "moving car", (0, 0, 0),
                math.pi)


def drive(things, front, length):
    """Bring the front of the car to a place; it faces the camera, so its tail is farther down -z."""
    for thing in things:
        thing.location = to_blender((front[0], front[1], front[2] - length))


def panoramic_camera(scene, position, lon0=-180.0, lon1=180.0, lat0=-90.0, lat1=90.0):
    """An equirectangular camera (Cycles) that looks down our -z; the patch is in degrees."""
    data = bpy.data.cameras.new("panorama")
    data.type = "PANO"
    data.clip_start, data.clip_end = 0.01, 5000
    data.cycles.panorama_type = "EQUIRECTANGULAR"
    aim(data, lon0, lon1, lat0, lat1)
    thing = bpy.data.objects.new("panorama", data)
    thing.location = to_blender(position)
    thing.rotation_euler = (math.pi / 2, 0, 0)
    scene.collection.objects.link(thing)
    scene.camera = thing
    return data


def aim(data, lon0, lon1, lat0, lat1):
    """Restrict a panoramic camera to a patch of the sphere, in degrees."""
    data.cycles.longitude_min, data.cycles.longitude_max = math.radians(lon0), math.radians(lon1)
    data.cycles.latitude_min, data.cycles.latitude_max = math.radians(lat0), math.radians(lat1)
