"""No effect, no change: with every effect off, what comes out is what went in, bit for bit, and no device is opened."""
import subprocess
import unittest

import numpy as np
from support import OFF, CliTest, bits, ffmpeg, readImage, writeImage

EVERY_PASS = {"strokes", "fog", "splashes", "blur", "darken", "color-transfer", "depth", "environment", "lights",
              "background-boost", "camera-motion", "layers", "composite"}


def awkward(kind, seed):
    """Values that conversions lose: negative, over 1, tiny, huge, under alpha 0 and between."""
    random = np.random.default_rng(seed)
    pixels = random.normal(0.3, 1, (36, 64, 4)).astype(np.float32)
    pixels[..., 3] = random.uniform(0, 1, (36, 64))
    pixels[0, :, 3] = 0
    pixels[1, :8, 0] = [0, -0.0, 65504, -65504, 6e-8, 1e-7, 1 / 3, 1000]
    if kind == "float":
        pixels[2, :6, 1] = [1e30, -1e30, 1e-38, 1e6, 3.0000002, 0.1]
    return pixels


class Passthrough(CliTest):
    @classmethod
    def makePlates(cls):
        for kind in ("half", "float"):
            for frame in range(8, 11):
                writeImage(cls.folder / f"{kind}.{frame:04d}.exr", awkward(kind, frame), kind)

    def checkSequence(self, kind, *arguments):
        report = self.rain(f"{kind}.%04d.exr", "-o", "out.%04d.exr", *OFF, *arguments)
        self.assertEqual(report["frames"], 3)
        self.assertEqual(report["device"], "")
        self.assertEqual(report["passes"], {})
        self.assertLessEqual(EVERY_PASS, set(report["skipped"]))
        self.assertTrue(all(report["skipped"].values()), report["skipped"])
        for frame in range(8, 11):
            before, after = bits(self.folder / f"{kind}.{frame:04d}.exr"), bits(self.folder / f"out.{frame:04d}.exr")
            self.assertEqual(after[:2], before[:2])
            np.testing.assert_array_equal(after[2], before[2])

    def test_half(self):
        self.checkSequence("half")

    def test_float(self):
        self.checkSequence("float")

    def test_whateverElseIsAskedFor(self):
        (self.folder / "moves.chan").write_text("8 0 0 0 0 0 0\n10 1 0 0 0 9 0\n")
        self.checkSequence("half", "--camera", "moves.chan", "--ground", "1.5", "--paper", "--layers", "--env", "none.exr")

    def test_halfIsForced(self):
        self.rain("float.%04d.exr", "-o", "out.%04d.exr", *OFF, "--half", "--frames", "9")
        self.assertEqual(bits(self.folder / "out.0009.exr")[0], "half")

    def test_floatIsForced(self):
        self.rain("half.%04d.exr", "-o", "out.%04d.exr", *OFF, "--float", "--frames", "9")
        kind, _, _ = bits(self.folder / "out.0009.exr")
        self.assertEqual(kind, "float")
        np.testing.assert_array_equal(readImage(self.folder / "out.0009.exr")[0],
                                      readImage(self.folder / "half.0009.exr")[0])

    def test_losslessMovie(self):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=96x54:r=25:d=0.4", "-f", "lavfi", "-i", "sine=d=0.4", "-pix_fmt", "yuv420p",
               "-c:v", "ffv1", "-c:a", "flac", self.folder / "clip.mkv")
        self.rain("clip.mkv", "-o", "same.mkv", *OFF)
        for stream in ("v:0", "a:0"):
            self.assertEqual(decoded(self.folder / "same.mkv", stream), decoded(self.folder / "clip.mkv", stream))


def decoded(path, stream):
    return subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", f"0:{stream}", "-f", "md5", "-"], check=True,
                          capture_output=True).stdout


if __name__ == "__main__":
    unittest.main()
