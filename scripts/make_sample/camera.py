"""The camera's move, shared by the render and the post-processing. NumPy only.

A nodal move: an operator pans a tripod head slowly to the right and a touch up. Because the lens stays in one
place, one panorama holds every frame's light and depth exactly.

World: right-handed, +y up, metres. The camera looks down its -z. Angles rx, ry, rz follow Nuke's default rotation
order ZXY: roll first, then tilt, then pan, so the matrix that takes camera directions to the world is
    worldFromCamera = Ry(ry) Rx(rx) Rz(rz).
"""

import numpy as np

FRAMES, FPS = 96, 24
WIDTH, HEIGHT = 960, 540
HFOV = 60.0                       # degrees
POSITION = (2.2, 1.65, 0.0)       # metres; the road is y = 0
FOCAL = WIDTH / 2 / np.tan(np.radians(HFOV) / 2)         # pixels
LIGHT_SCALE, DEPTH_SCALE = 22.75, 45.5                   # pixels per degree of the panoramas
VFOV = float(np.degrees(2 * np.arctan(HEIGHT / 2 / FOCAL)))


def angles(frame):
    """(rx, ry, rz) in degrees: an eased pan and tilt, with the drift of a hand on the head."""
    t = frame / (FRAMES - 1)
    eased = t * t * t * (t * (6 * t - 15) + 10)
    s = frame / FPS
    rx = 4.6 + 1.1 * eased + 0.06 * np.sin(2.3 * s + 0.4) + 0.03 * np.sin(5.9 * s)
    ry = 9.5 - 7.5 * eased + 0.07 * np.sin(1.7 * s) + 0.03 * np.sin(6.7 * s + 1.0)
    rz = 0.05 * np.sin(1.9 * s + 2.0) + 0.02 * np.sin(4.7 * s)
    return float(rx), float(ry), float(rz)


def world_from_camera(rx, ry, rz):
    a, b, c = np.radians((rx, ry, rz))
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return about_y @ about_x @ about_z


def rays(frame, width=WIDTH, height=HEIGHT):
    """Camera-space directions with z = -1, and world directions (not unit), through pixel centres: H x W x 3."""
    focal = FOCAL * width / WIDTH
    x = (np.arange(width) + 0.5 - width / 2) / focal
    y = -(np.arange(height) + 0.5 - height / 2) / focal
    local = np.stack(np.broadcast_arrays(x[None, :], y[:, None], -1.0), -1)
    return local, local @ world_from_camera(*angles(frame)).T


def longitude_latitude(direction):
    """Radians; longitude 0 is down -z and grows to the right."""
    x, y, z = direction[..., 0], direction[..., 1], direction[..., 2]
    return np.arctan2(x, -z), np.arctan2(y, np.hypot(x, z))


def direction_to(point):
    """Longitude and latitude of a world point as the camera sees it, in degrees."""
    lon, lat = longitude_latitude(np.asarray(point, float) - POSITION)
    return float(np.degrees(lon)), float(np.degrees(lat))


def field(margin=0.4):
    """The patch of sphere (degrees: lon0, lon1, lat0, lat1) that the whole move sees, on a half-degree grid."""
    lo, hi = np.full(2, np.inf), np.full(2, -np.inf)
    for frame in range(FRAMES):
        _, world = rays(frame, 48, 27)
        lonlat = np.degrees(np.stack(longitude_latitude(world), -1)).reshape(-1, 2)
        lo, hi = np.minimum(lo, lonlat.min(0)), np.maximum(hi, lonlat.max(0))
    lo = np.floor((lo - margin - 0.5) * 2) / 2
    hi = np.ceil((hi + margin + 0.5) * 2) / 2
    return lo[0], hi[0], lo[1], hi[1]


def panorama_size(scale, patch):
    """(width, height) in pixels of a patch (degrees) at `scale` pixels per degree."""
    return int(round((patch[1] - patch[0]) * scale)), int(round((patch[3] - patch[2]) * scale))


# --- The car that comes down the street --------------------------------------------------------------------------

CAR_LENGTH = 4.08   # metres, the hatchback of cars.py


def car_front(frame):
    """Where the front of the moving car stands at a frame, world metres: 25 km/h towards the camera."""
    return -0.95, 0.0, -58.0 + 7.0 * frame / FPS


def car_patch(frame, size):
    """The part of field() that the car can change, with its reflection in the road and its shadow:
    (column0, column1, row0, row1) in a panorama of field() that is `size` = (width, height) pixels."""
    x, _, z = car_front(frame)
    corners = [direction_to((x + dx, y, z + dz)) for dx in (-1.35, 1.35) for y in (-1.25, 1.75)
               for dz in (0.3, -CAR_LENGTH)]
    lon0, lat0 = np.min(corners, 0)
    lon1, lat1 = np.max(corners, 0)
    left, right, bottom, top = field()
    assert left < lon0 and lon1 < right and bottom < lat0 and lat1 < top
    per_lon, per_lat = size[0] / (right - left), size[1] / (top - bottom)
    return (int((lon0 - left) * per_lon) - 3, int((lon1 - left) * per_lon) + 4,
            int((top - lat1) * per_lat) - 3, int((top - lat0) * per_lat) + 4)
