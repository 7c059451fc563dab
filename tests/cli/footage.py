"""Footage of rain with the truth beside it, a still scene behind strokes that fall, and what the tests of virga extract
share."""
import json
import shutil

import numpy as np
import OpenImageIO as oiio
from support import CliTest, readImage, writeImage

FRAMES, SIZE = 12, 96        # of ExtractTest's footage
RAIN = (0.78, 0.80, 0.82)  # what the drops of rained() return of the light
WET = 0.05                 # alpha above which a pixel counts as wet


def lattice(random, height, width, cells):
    """Values -1..1 on a lattice of cells x cells, linear in between."""
    nodes = random.uniform(-1, 1, (cells + 1, cells + 1))
    y, x = (np.linspace(0, cells, n, endpoint=False) for n in (height, width))
    rows, columns = y.astype(int), x.astype(int)
    v, u = (y - rows)[:, None], (x - columns)[None]
    at = lambda down, right: nodes[np.ix_(rows + down, columns + right)]
    return (1 - v) * ((1 - u) * at(0, 0) + u * at(0, 1)) + v * ((1 - u) * at(1, 0) + u * at(1, 1))


def scene(height, width, seed=1):
    """Shading, walls with sharp edges and grain, 0.05 to 0.6; height x width x 3."""
    random = np.random.default_rng([seed, 0])
    y, x = np.mgrid[0:height, 0:width]
    tone = 0.5 * lattice(random, height, width, 3) + 0.15 * lattice(random, height, width, max(4, width // 4))
    for _ in range(6):
        top, left = random.uniform(-0.1, 0.8, 2) * (height, width)
        tall, wide = random.uniform(0.15, 0.5, 2) * (height, width)
        tone += random.uniform(-0.6, 0.6) * ((y > top) & (y < top + tall) & (x > left) & (x < left + wide))
    tone = (tone - tone.min()) / max(np.ptp(tone), 1e-9)
    return np.stack([low + (high - low) * tone ** power for low, high, power in
                     ((0.05, 0.60, 1.0), (0.06, 0.55, 1.2), (0.06, 0.48, 0.8))], -1)


def strokes(frames, height, width, slant=8.0, wet=0.12, length=(10, 40), seed=1):
    """Alphas of strokes, the lower end `slant` degrees to the right, until the share `wet` of a frame's pixels is wet;
    frames x height x width."""
    random = np.random.default_rng([seed, 1])
    y, x = np.mgrid[0:height, 0:width]
    alpha = np.zeros((frames, height, width))
    for frame in alpha:
        for _ in range(5000):
            if (frame > WET).mean() >= wet:
                break
            long, half = random.uniform(*length), random.uniform(1, 2.5)
            peak, tilt = random.uniform(0.1, 0.5), np.radians(slant + random.uniform(-1, 1))
            down, right = y - random.uniform(-20, height + 20), x - random.uniform(-20, width + 20)
            along = right * np.sin(tilt) + down * np.cos(tilt)
            across = right * np.cos(tilt) - down * np.sin(tilt)
            fade = np.clip((long / 2 - np.abs(along)) / (long / 4), 0, 1)
            frame += (1 - frame) * peak * np.cos(np.pi / 2 * np.clip(across / half, -1, 1)) ** 2 * fade
    return alpha


def rained(ground, alpha, color=RAIN, noise=2 / 255, seed=1):
    """(1 - alpha) S + alpha C + noise, 0..1; frames x height x width x 3."""
    alpha = alpha[..., None]
    frames = (1 - alpha) * ground + alpha * np.asarray(color)
    return np.clip(frames + np.random.default_rng([seed, 2]).normal(0, noise, frames.shape), 0, 1)


def srgb(linear):
    """Linear light -> display-referred values, IEC 61966-2-1."""
    linear = np.asarray(linear)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * np.maximum(linear, 0.0031308) ** (1 / 2.4) - 0.055)


def writeStack(path, frames):
    """Frames top to bottom in one 16-bit PNG, values as they stand."""
    frames = np.asarray(frames)
    writeImage(path, frames.reshape(-1, *frames.shape[2:]), "uint16")


def writeSequence(folder, pattern, frames, kind="uint8", first=1, channels=None):
    for number, frame in enumerate(frames, first):
        writeImage(folder / (pattern % number), frame, kind, channels)


def rmse(a, b):
    return float(np.sqrt(np.mean((np.asarray(a) - b) ** 2)))


class ExtractTest(CliTest):
    """A stack of drawn rain, linear values; self.ground, self.alpha, self.rainy are the truth and what was filmed of it."""

    @classmethod
    def makePlates(cls):
        cls.ground, cls.alpha = scene(SIZE, SIZE), strokes(FRAMES, SIZE, SIZE)
        cls.rainy = rained(cls.ground, cls.alpha)
        writeStack(cls.folder / "stack.png", cls.rainy)

    STACK = ("stack.png", "--stack", FRAMES, "--linear")

    def extract(self, *arguments, out="out"):
        """virga extract into a fresh folder, which must succeed; its report, which must be what report.json says."""
        shutil.rmtree(self.folder / out, ignore_errors=True)
        run = self.succeeds("extract", "--json", *arguments, "-o", out)
        report = run.report
        self.assertEqual(report, json.loads((self.folder / out / "report.json").read_text()))
        self.assertEqual((report["format"], report["version"]), ("virga-extract-report", 1))
        self.assertEqual(self.leftovers(), [])
        self.said = run.err
        return report

    def names(self, out="out"):
        return sorted(p.name for p in (self.folder / out).iterdir())

    def images(self, name, numbers, out="out"):
        """Frames x height x width x channels."""
        return np.stack([readImage(self.folder / out / (name % n))[0] for n in numbers])

    def spec(self, name, out="out"):
        file = oiio.ImageInput.open(str(self.folder / out / name))
        self.assertIsNotNone(file, name)
        spec = file.spec()
        file.close()
        return (spec.width, spec.height), tuple(spec.channelnames), str(spec.format)

    def checkFolder(self, numbers, size, kind, extra=(), out="out"):
        """The usual results for footage with rain, and nothing else."""
        wanted = {"clean.exr", "confidence.exr", "atlas.exr", "atlas.json", "sheet.png", "report.json", *extra}
        wanted |= {f"{name}.{n:04d}.exr" for n in numbers for name in ("alpha", "clean")}
        self.assertEqual(self.names(out), sorted(wanted))
        for n in numbers:
            self.assertEqual(self.spec(f"alpha.{n:04d}.exr", out), (size, ("A",), kind))
            self.assertEqual(self.spec(f"clean.{n:04d}.exr", out)[::2], (size, kind))
        self.assertEqual(self.spec("clean.exr", out), (size, ("R", "G", "B"), "float"))
        self.assertEqual(self.spec("confidence.exr", out)[0], size)
        alphas = self.images("alpha.%04d.exr", numbers, out)
        self.assertTrue(np.isfinite(alphas).all() and alphas.min() >= 0 and alphas.max() <= 1)
        confidence, _ = readImage(self.folder / out / "confidence.exr")
        self.assertTrue(confidence.min() >= 0 and confidence.max() <= 1)
