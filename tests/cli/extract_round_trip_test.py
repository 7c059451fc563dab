"""Rain that virga made, taken out again by virga: what comes back beside what went in."""
import json
import unittest

import numpy as np

import support
from support import CliTest, readImage, writeImage

WIDTH, HEIGHT, FRAMES = 160, 120, 20
DRY = ["--gust", "0", "--turbulence", "0", "--fog", "0", "--darken", "0", "--desaturate", "0", "--splashes", "0"]


def wedge(width=16, height=64):
    """A matte that is brighter towards its lower end and darker on its left: no flip of it looks alike."""
    v = (np.arange(height) + 0.5)[:, None] / height
    u = (np.arange(width) + 0.5)[None, :] / width
    across = np.clip(1 - ((u - 0.5) / 0.35) ** 2, 0, None) * (0.6 + 0.4 * u)
    along = np.clip(np.minimum(v, 1 - v) / 0.08, 0, 1) * (0.25 + 0.75 * v)
    return (across * along / (across * along).max()).astype(np.float32)


class RoundTripTest(CliTest):
    @classmethod
    def makePlates(cls):
        y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
        plate = np.zeros((HEIGHT, WIDTH, 3), np.float32)
        for c in range(3):
            plate[..., c] = 0.2 + 0.1 * np.sin(x * 0.11 + c) * np.cos(y * 0.07) + 0.06 * np.sin(x * 0.5 + y * 0.37)
        plate[HEIGHT // 2:, WIDTH // 3:] *= 0.6  # an edge
        writeImage(cls.folder / "plate.exr", plate, "float", ["R", "G", "B"])
        writeImage(cls.folder / "white.exr", np.full((1, 2, 3), 0.9), "float", ["R", "G", "B"])
        writeImage(cls.folder / "wedge.exr", wedge(), "float", ["Y"])

    def rainThenExtract(self, name, *flags):
        self.succeeds("rain", "plate.exr", "-o", f"{name}.####.exr", "--env", "white.exr", "--frames", f"0-{FRAMES - 1}",
                      "--layers", "--float", "--quiet", *DRY, *flags)
        return self.succeeds("extract", f"{name}.####.exr", "-o", name, "--space", "linear", "--quiet", "--json").report

    def truth(self, name):
        frames = []
        for k in range(FRAMES):
            pixels, names = readImage(self.folder / f"{name}.{k:04d}.exr")
            frames.append(pixels[..., names.index("rain.A")])
        return np.stack(frames)

    def found(self, name):
        return np.stack([readImage(self.folder / name / f"alpha.{k:04d}.exr")[0][..., 0] for k in range(FRAMES)])

    def test_direction_and_alpha(self):
        """The direction within a degree of the true alphas' own, alpha's error under a fiftieth of what there is, colour and
        plate where they were: of a rain so short and light that pairs along its strokes leave the colour open."""
        for seed in range(1, 7):
            with self.subTest(seed=seed):
                self.checkDirectionAndAlpha(f"slanted{seed}", str(seed))

    def checkDirectionAndAlpha(self, name, seed):
        report = self.rainThenExtract(name, "--rate", "20", "--exposure", "0.006", "--wind", "1.5,0", "--seed", seed)
        true, found = self.truth(name), self.found(name)
        self.assertTrue(report["rain"]["found"])
        # What the drops themselves did while the shutter was open.
        path = np.zeros(2)
        for k in range(FRAMES):
            pixels, names = readImage(self.folder / f"{name}.{k:04d}.exr")
            alpha = pixels[..., names.index("rain.A")]
            path += [(alpha * pixels[..., names.index(f"rain.motion.{c}")]).sum() for c in "xy"]
        slant = np.degrees(np.arctan2(path[0], path[1]))
        self.assertAlmostEqual(report["rain"]["slant_deg"], slant, delta=1.0)
        error = np.sqrt(((true - found) ** 2).mean())
        self.assertLess(error, 0.02 * np.sqrt((true ** 2).mean()))
        self.assertEqual(report["rain"]["color_source"], "strokes")
        for value in report["rain"]["color"]:
            self.assertAlmostEqual(value, 0.9, delta=0.005)
        plate = readImage(self.folder / "plate.exr")[0]
        self.assertLess(np.abs(readImage(self.folder / name / "clean.exr")[0] - plate).mean(), 0.002)

    def test_shapes(self):
        """Strokes drawn with one matte come back as that matte: the mean tile is like it, and unlike its flip."""
        report = self.rainThenExtract("shaped", "--strokes", "8", "--drop-size", "3", "--exposure", "0.012", "--mattes", "wedge.exr",
                                      "--opacity", "2", "--fstop", "1000", "--near", "1", "--far", "2.5", "--fov", "15")
        self.assertGreaterEqual(report["atlas"]["strokes"], 12)
        sheet = readImage(self.folder / "shaped" / "atlas.exr")[0][..., 0]
        layout = json.loads((self.folder / "shaped" / "atlas.json").read_text())
        w, h, columns, count = (layout[k] for k in ("tile_width", "tile_height", "columns", "count"))
        tiles = [sheet[n // columns * h:(n // columns + 1) * h, n % columns * w:(n % columns + 1) * w]
                 for n in range(count)]
        along = np.mean([t.sum(1) / t.sum() for t in tiles], axis=0)
        true = wedge().sum(1)
        like = np.corrcoef(along, true)[0, 1]
        flipped = np.corrcoef(along, true[::-1])[0, 1]
        self.assertGreater(like, 0.9)
        self.assertGreater(like, flipped + 0.2)


if __name__ == "__main__":
    unittest.main()
