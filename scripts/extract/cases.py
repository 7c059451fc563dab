#!/usr/bin/env python3
"""Makes test cases for `virga extract`: a still scene behind strokes, with the truth beside it.

usage: cases.py --out DIR [--slant DEG ...] [--noise LEVELS ...] [--wet SHARE ...] [--frames N] [--size N]
                [--color R,G,B] [--seed N]

A case for each combination of slant, noise and share, linear values throughout:
    NAME_I.png            frames stacked top to bottom, 16-bit RGB, value/65535: the input
    NAME_alpha_true.png   the strokes' alpha, 16-bit grey, stacked alike
    NAME_scene.exr        the scene, float
    NAME.json             slant_deg, noise_255, C, frames, and the rest of what it was made with
I = (1 - alpha) S + alpha C + noise, rounded to 16 bits. The same seed gives the same scene at every slant and noise.
Slant is from vertical, positive = lower end to the right. Needs python3-numpy and python3-openimageio.
"""
import argparse
import json
import pathlib
from dataclasses import dataclass

try:
    import numpy as np
    import OpenImageIO as oiio
except ImportError as missing:
    raise SystemExit(f"{missing}: apt-get install python3-numpy python3-openimageio")

WET = 0.05  # alpha above which a pixel counts as wet


def read_image(path):
    """Height x width x channels, integers as 0..1, and the channels' names."""
    file = oiio.ImageInput.open(str(path))
    if not file:
        raise SystemExit(f"{path}: {oiio.geterror()}")
    spec = file.spec()
    pixels = np.asarray(file.read_image(0, 0, 0, spec.nchannels, "float"))
    return pixels.reshape(spec.height, spec.width, spec.nchannels), list(spec.channelnames)


def write_image(path, pixels, kind):
    """Height x width x channels; kind "uint16" for values 0..1 rounded to that, or "float"."""
    pixels = np.ascontiguousarray(pixels, np.float32)
    file = oiio.ImageOutput.create(str(path))
    if not file or not file.open(str(path), oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)):
        raise SystemExit(f"{path}: {oiio.geterror()}")
    file.write_image(pixels)
    file.close()


def to_16_bits(values):
    return np.round(np.clip(values, 0, 1) * 65535) / 65535


@dataclass
class Case:
    name: str
    frames: np.ndarray  # [frame, y, x, channel]
    alpha: np.ndarray   # [frame, y, x], true
    scene: np.ndarray   # [y, x, channel], true
    facts: dict         # NAME.json

    @property
    def wet(self):
        return float((self.alpha > WET).mean())

    def write(self, folder):
        height, width, channels = self.scene.shape
        write_image(folder / f"{self.name}_I.png", self.frames.reshape(-1, width, channels), "uint16")
        write_image(folder / f"{self.name}_alpha_true.png", self.alpha.reshape(-1, width, 1), "uint16")
        write_image(folder / f"{self.name}_scene.exr", self.scene, "float")
        (folder / f"{self.name}.json").write_text(json.dumps(self.facts, indent=1) + "\n")


def unstack(path, count):
    pixels, _ = read_image(path)
    height = pixels.shape[0] // count
    if height * count != pixels.shape[0]:
        raise SystemExit(f"{path}: {pixels.shape[0]} rows cannot be {count} frames")
    return pixels.reshape(count, height, *pixels.shape[1:])


def read_case(facts_file):
    """From its NAME.json."""
    facts_file = pathlib.Path(facts_file)
    name, facts = facts_file.stem, json.loads(facts_file.read_text())
    beside = lambda ending: facts_file.with_name(name + ending)
    frames, alpha = (unstack(beside(ending), facts["frames"]) for ending in ("_I.png", "_alpha_true.png"))
    return Case(name, frames, alpha[..., 0], read_image(beside("_scene.exr"))[0], facts)


def filmed(scene, alpha, color, noise_255, rng):
    """Eq. (1) of Wang et al., with Gaussian noise, as 16 bits hold it."""
    alpha = alpha[..., None]
    clean = (1 - alpha) * scene + alpha * np.asarray(color)
    return to_16_bits(clean + rng.normal(0, 1, clean.shape) * noise_255 / 255)


def smooth_noise(rng, size, cells):
    """Values -1..1 on a lattice of cells x cells, interpolated with smoothstep."""
    lattice = rng.uniform(-1, 1, (cells + 1, cells + 1))
    place = np.arange(size) * cells / size
    whole = place.astype(int)
    t = place - whole
    t = t * t * (3 - 2 * t)
    rows = lattice[whole] * (1 - t[:, None]) + lattice[whole + 1] * t[:, None]
    return rows[:, whole] * (1 - t) + rows[:, whole + 1] * t


def make_scene(size, rng):
    """Slow shading, walls and discs with sharp edges (some of them upright, as strokes are), courses of brick and
    grain. 0.05 to 0.65, each channel with a range and a mixture of its own."""
    y, x = np.mgrid[0:size, 0:size] + 0.5
    step = lambda distance: np.clip(distance + 0.5, 0, 1)  # an edge of one pixel
    parts = [0.5 * smooth_noise(rng, size, 3), 0.25 * smooth_noise(rng, size, 6)]
    for _ in range(5):  # walls
        left, top = rng.uniform(-0.1, 0.8, 2) * size
        right, bottom = np.array([left, top]) + rng.uniform(0.15, 0.5, 2) * size
        wall = step(x - left) * step(right - x) * step(y - top) * step(bottom - y)
        parts.append(rng.uniform(-0.7, 0.7) * wall)
    for _ in range(4):
        center, radius = rng.uniform(0, size, 2), rng.uniform(0.05, 0.18) * size
        parts.append(rng.uniform(-0.5, 0.5) * step(radius - np.hypot(x - center[0], y - center[1])))
    slope = rng.uniform(0, 2 * np.pi)  # a roof's edge across it all
    parts.append(0.4 * step((x - size / 2) * np.cos(slope) + (y - size / 2) * np.sin(slope)))
    course = np.floor(y / 6)
    joint = np.minimum(y % 6, (x + 5 * (course % 2)) % 10) < 1.2
    parts.append(0.2 * joint * step((smooth_noise(rng, size, 4) - 0.1) * 20))
    for cells, strength in ((size // 6, 0.12), (size // 3, 0.08), (size, 0.04)):
        parts.append(strength * smooth_noise(rng, size, cells))
    scene = np.empty((size, size, 3))
    for channel, (low, high) in enumerate(((0.05, 0.65), (0.07, 0.58), (0.06, 0.48))):
        mixed = sum(part * rng.uniform(0.6, 1.4) for part in parts)
        mixed = (mixed - mixed.min()) / np.ptp(mixed)
        scene[..., channel] = low + (high - low) * mixed
    return scene.astype(np.float32).astype(float)


def stroke(size, rng, slant_deg):
    """The rows and columns that it touches, and its alpha there: means of 4 x 4 samples a pixel."""
    length, width = rng.uniform(10, 40), rng.uniform(1, 2.5)
    peak, slant = rng.uniform(0.1, 0.5), np.radians(slant_deg + rng.uniform(-1, 1))
    center = rng.uniform(-20, size + 20, 2)
    reach = np.abs([np.sin(slant), np.cos(slant)]) * length / 2 + width + 1
    first = np.clip(np.floor(center - reach), 0, size).astype(int)
    last = np.clip(np.ceil(center + reach), 0, size).astype(int)
    fine = lambda a, b: (np.arange(4 * a, 4 * b) + 0.5) / 4
    x, y = np.meshgrid(fine(first[0], last[0]) - center[0], fine(first[1], last[1]) - center[1])
    along = x * np.sin(slant) + y * np.cos(slant)
    across = x * np.cos(slant) - y * np.sin(slant)
    # Raised cosines: `width` is where half the peak is left, and the ends fade over a quarter of the length.
    profile = np.cos(np.pi / 2 * np.clip(across / width, -1, 1)) ** 2
    fade = np.clip((length / 2 - np.abs(along)) / (length / 4), 0, 1)
    samples = peak * profile * np.sin(np.pi / 2 * fade) ** 2
    alpha = samples.reshape(last[1] - first[1], 4, last[0] - first[0], 4).mean((1, 3))
    return slice(first[1], last[1]), slice(first[0], last[0]), alpha


def make_strokes(size, frames, wet, rng, slant_deg):
    """Each frame gets strokes until, with those before it, the share of wet pixels is reached."""
    alpha = np.zeros((frames, size, size))
    for k in range(frames):
        while (alpha[:k + 1] > WET).mean() < wet:
            rows, columns, more = stroke(size, rng, slant_deg)
            alpha[k, rows, columns] = 1 - (1 - alpha[k, rows, columns]) * (1 - more)
    return to_16_bits(alpha)


def make_case(name, slant_deg, noise_255, wet, frames=20, size=96, color=(0.78, 0.80, 0.82), seed=1):
    scene = make_scene(size, np.random.default_rng([seed, 0]))
    alpha = make_strokes(size, frames, wet, np.random.default_rng([seed, 1]), slant_deg)
    images = filmed(scene, alpha, color, noise_255, np.random.default_rng([seed, 2]))
    facts = {"width": size, "height": size, "frames": frames, "slant_deg": slant_deg, "noise_255": noise_255,
             "C": list(color), "wet": round(float((alpha > WET).mean()), 4), "seed": seed}
    return Case(name, images, alpha, scene, facts)


def color_of(text):
    values = tuple(float(word) for word in text.split(","))
    if len(values) != 3:
        raise argparse.ArgumentTypeError(f"'{text}': must be three numbers, as in 0.78,0.80,0.82")
    return values


def share(text):
    if not 0 < float(text) < 0.95:
        raise argparse.ArgumentTypeError(f"'{text}': must be above 0 and below 0.95")
    return float(text)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder, made if need be")
    parser.add_argument("--slant", type=float, nargs="+", default=[0.0], help="degrees (default 0)")
    parser.add_argument("--noise", type=float, nargs="+", default=[2.0],
                        help="standard deviation in 1/255 (default 2)")
    parser.add_argument("--wet", type=share, nargs="+", default=[0.16],
                        help=f"share of pixels with alpha above {WET} (default 0.16)")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--size", type=int, default=96, help="width and height (default 96)")
    parser.add_argument("--color", type=color_of, default=(0.78, 0.80, 0.82),
                        help="of the rain (default 0.78,0.80,0.82)")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if options.frames < 1 or options.size < 16:
        parser.error("--frames must be at least 1, --size at least 16")

    options.out.mkdir(parents=True, exist_ok=True)
    for slant in options.slant:
        for noise in options.noise:
            for wet in options.wet:
                name = (f"own_slant{slant:+g}_noise{noise:g}_wet{100 * wet:g}_frames{options.frames}"
                        f"_seed{options.seed}")
                case = make_case(name, slant, noise, wet, options.frames, options.size, options.color, options.seed)
                case.write(options.out)
                print(f"{options.out / name}_I.png  {100 * case.wet:.1f} % wet")


if __name__ == "__main__":
    main()
