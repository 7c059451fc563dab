"""Surroundings for one street, made of formulas: an overcast sky, a low sun ahead and behind, a night of lamps.

    skies.py FOLDER   writes overcast.exr, low_sun.exr, sun_behind.exr and night.exr (1024 x 512, scene-linear, docs/conventions.md)
"""

import pathlib
import sys

import numpy as np
import OpenImageIO as oiio

WIDTH, HEIGHT = 1024, 512


def directions():
    azimuth = ((np.arange(WIDTH) + 0.5) / WIDTH - 0.5) * 2 * np.pi
    polar = (np.arange(HEIGHT) + 0.5) / HEIGHT * np.pi
    azimuth, polar = np.meshgrid(azimuth, polar)
    return np.stack([np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)], axis=-1)


def towards(azimuth_deg, elevation_deg):
    a, e = np.radians([azimuth_deg, elevation_deg])
    return np.array([np.sin(a) * np.cos(e), np.sin(e), -np.cos(a) * np.cos(e)])


def houses(view, radiance, roof_deg=14):
    """Walls to both sides of the street, open ahead and behind; 1 where they stand."""
    elevation = np.degrees(np.arcsin(view[..., 1]))
    roof = roof_deg * np.abs(view[..., 0]) / np.hypot(view[..., 0], view[..., 2])
    wall = 1 / (1 + np.exp((elevation - roof) * 2)) * (view[..., 1] > 0)
    return wall[..., None], np.array(radiance)


def compose(view, sky, ground, wall):
    up = view[..., 1:2] > 0
    picture = np.where(up, sky, np.array(ground))
    share, radiance = wall
    return picture * (1 - share) + radiance * share


def overcast(view):
    # Moon & Spencer 1942: three times as bright overhead as at the horizon.
    sky = 0.4 * (1 + 2 * np.clip(view[..., 1:2], 0, 1)) * np.array([0.95, 1.0, 1.06])
    return compose(view, sky, [0.12, 0.12, 0.11], houses(view, [0.16, 0.14, 0.12]))


def low_sun(view, azimuth=-28, radiance=12000):
    sun = towards(azimuth, 9)
    cosine = np.clip(view @ sun, -1, 1)
    angle = np.degrees(np.arccos(cosine))[..., None]
    height = np.clip(view[..., 1:2], 0, 1)
    sky = np.array([0.28, 0.42, 0.75]) * (0.35 + 0.65 * height) + np.array([1.0, 0.62, 0.3]) * 0.5 * np.exp(-height * 5)
    sky = sky + np.array([1.0, 0.7, 0.4]) * (2.0 * np.exp(-angle / 4) + 0.5 * np.exp(-angle / 25))
    picture = compose(view, sky, [0.10, 0.085, 0.07], houses(view, [0.12, 0.09, 0.07], 8))
    # 0.53 degrees wide; its edge falls off over a pixel, as the map has it.
    disc = np.clip((0.265 - angle) / 0.35 + 0.5, 0, 1)
    return picture + disc * np.array([1.0, 0.62, 0.28]) * radiance


def sun_behind(view):
    return low_sun(view, 176, 60000)


def night(view):
    sky = np.array([0.010, 0.013, 0.022]) * (1 + 0.5 * view[..., 1:2])
    picture = compose(view, sky, [0.012, 0.010, 0.009], houses(view, [0.02, 0.016, 0.012]))
    for i, azimuth in enumerate([-50, -24, -11, 9, 21, 46, 130, 165, -150, -120]):
        angle = np.degrees(np.arccos(np.clip(view @ towards(azimuth, 30 - 20 * np.cos(np.radians(azimuth))), -1, 1)))
        color = [1.0, 0.55, 0.2] if i % 3 else [0.9, 0.95, 1.0]
        picture = picture + np.clip((0.6 - angle) / 0.35 + 0.5, 0, 1)[..., None] * np.array(color) * 60
    return picture


def main():
    folder = pathlib.Path(sys.argv[1])
    view = directions()
    for make in (overcast, low_sun, sun_behind, night):
        picture = np.ascontiguousarray(make(view), dtype=np.float32)
        image = oiio.ImageOutput.create("x.exr")
        path = folder / f"{make.__name__}.exr"
        image.open(str(path), oiio.ImageSpec(WIDTH, HEIGHT, 3, "half"))
        image.write_image(np.clip(picture, 0, 65504))
        image.close()


if __name__ == "__main__":
    main()
