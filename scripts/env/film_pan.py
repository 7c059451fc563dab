"""Films a panorama with a camera that turns: footage whose truth is known.

    film_pan.py PANORAMA.exr FOLDER [frames [degrees [fov]]]

Writes FOLDER/pan.####.exr, 640x360, from half of `degrees` to the left of -z to as far to the right, nodding a little,
and with an exposure that wanders by a quarter of a stop.
"""
import math
import sys

import numpy as np
import OpenImageIO as oiio

WIDTH, HEIGHT = 640, 360


def sample(panorama, d):
    """Bilinear, docs/conventions.md."""
    h, w, _ = panorama.shape
    x = (np.arctan2(d[..., 0], -d[..., 2]) / (2 * np.pi) + 0.5) * w - 0.5
    y = np.arccos(np.clip(d[..., 1], -1, 1)) / np.pi * h - 0.5
    x0, y0 = np.floor(x).astype(int), np.clip(np.floor(y).astype(int), 0, h - 1)
    y1 = np.minimum(y0 + 1, h - 1)
    a, b = (x - x0)[..., None], np.clip(y - y0, 0, 1)[..., None]
    return ((1 - b) * ((1 - a) * panorama[y0, x0 % w] + a * panorama[y0, (x0 + 1) % w]) +
            b * ((1 - a) * panorama[y1, x0 % w] + a * panorama[y1, (x0 + 1) % w]))


def main(path, folder, frames=24, degrees=200.0, fov=60.0):
    panorama = oiio.ImageBuf(path).get_pixels(oiio.FLOAT)[..., :3]
    focal = WIDTH / 2 / math.tan(math.radians(fov) / 2)
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5 - WIDTH / 2, HEIGHT / 2 - np.arange(HEIGHT) - 0.5)
    camera = np.stack([x, y, np.full_like(x, -focal)], -1) / np.sqrt(x * x + y * y + focal * focal)[..., None]
    for i in range(frames):
        yaw = math.radians(degrees * (i / (frames - 1) - 0.5))
        pitch = math.radians(6 * math.sin(0.6 * i))
        up = np.array([[1, 0, 0], [0, math.cos(pitch), -math.sin(pitch)], [0, math.sin(pitch), math.cos(pitch)]])
        right = np.array([[math.cos(yaw), 0, -math.sin(yaw)], [0, 1, 0], [math.sin(yaw), 0, math.cos(yaw)]])
        frame = np.minimum(sample(panorama, camera @ up.T @ right.T) * 2 ** (0.25 * math.sin(0.9 * i)), 1)
        out = oiio.ImageOutput.create("a.exr")
        spec = oiio.ImageSpec(WIDTH, HEIGHT, 3, "half")
        assert out.open(f"{folder}/pan.{i:04d}.exr", spec), oiio.geterror()
        out.write_image(np.ascontiguousarray(frame, np.float32))
        out.close()


if __name__ == "__main__":
    main(*sys.argv[1:3], *(kind(text) for kind, text in zip((int, float, float), sys.argv[3:])))
