"""virga extract where there is next to nothing to solve, or far too much: each ends in finite pictures with alphas 0 to 1,
or in one sentence with its exit code."""
import unittest

import numpy as np
from footage import FRAMES, SIZE, ExtractTest, rained, rmse, srgb, strokes, writeSequence
from support import readImage, writeImage


class StressTest(ExtractTest):
    def bounded(self, frames, *flags, code=0, kind="float", out="out"):
        """Extracts footage of these linear values. Success leaves a frame's worth for each and finite pictures alone;
        its report. Else one sentence and an untouched folder; the sentence."""
        for path in self.folder.glob("in.*"):
            path.unlink()
        writeSequence(self.folder, "in.%04d.exr", np.asarray(frames), kind)
        if code != 0:
            return self.refused(code, "'in.%04d.exr'", "extract", "--quiet", "in.%04d.exr", "-o", "refused", *flags)
        report = self.extract("in.%04d.exr", *flags, out=out)
        numbers = range(1, len(frames) + 1)
        self.assertEqual(report["footage"]["frames"], len(frames))
        alphas, clean = (self.images(name, numbers, out) for name in ("alpha.%04d.exr", "clean.%04d.exr"))
        self.assertTrue(np.isfinite(alphas).all() and alphas.min() >= 0 and alphas.max() <= 1)
        self.assertEqual(clean.shape[:3], frames.shape[:3])
        self.assertTrue(np.isfinite(clean).all())
        for name in self.names(out):
            if name.endswith((".exr", ".png")):
                self.assertTrue(np.isfinite(readImage(self.folder / out / name)[0]).all(), name)
        self.assertFalse(report["model"]["objective_rose"])
        return report

    def dry(self, frames, *flags, **more):
        """The same for footage without rain: nothing found, nothing changed."""
        report = self.bounded(frames, *flags, **more)
        self.assertIs(report["rain"]["found"], False)
        self.assertIn("no rain found", self.said)
        self.assertIsNone(report["atlas"])
        self.assertIsNone(report["match"])
        self.assertNotIn("atlas.exr", self.names())
        self.assertNotIn("atlas", report["files"])
        numbers = range(1, len(frames) + 1)
        self.assertEqual(self.images("alpha.%04d.exr", numbers).max(), 0)
        clean = self.images("clean.%04d.exr", numbers)[..., :3]
        np.testing.assert_allclose(clean, frames, rtol=1e-4, atol=1e-6)
        return report


class FewFrames(StressTest):
    def test_twoAndThree(self):
        for count in (2, 3):
            report = self.bounded(self.rainy[:count])
            self.assertIs(report["rain"]["found"], True)
            self.assertAlmostEqual(report["rain"]["slant_deg"], 8, delta=1)

    def test_one(self):
        self.dry(self.rainy[:1])
        writeImage(self.folder / "still.png", srgb(self.rainy[0]), "uint8")
        report = self.extract("still.png")
        self.assertEqual(report["footage"]["frames"], 1)
        self.assertEqual(len([n for n in self.names() if n.startswith("alpha")]), 1)
        self.assertIs(self.extract("stack.png", "--stack", "1")["rain"]["found"], False)

    def test_aGapInTheSequence(self):
        writeSequence(self.folder, "gap.%04d.png", srgb(self.rainy))
        (self.folder / "gap.0004.png").unlink()
        self.refused(3, ["frame 4 is missing", "gap.%04d.png", "--on-error"], "extract", "gap.%04d.png", "-o", "none")
        report = self.extract("gap.%04d.png", "--on-error", "skip")
        self.assertIn("frame 4 is left out", self.said)
        self.assertEqual((report["footage"]["frames"], report["footage"]["frame_range"]), (11, "1-3,5-12"))
        self.assertNotIn("alpha.0004.exr", self.names())
        self.assertAlmostEqual(report["rain"]["slant_deg"], 8, delta=0.5)
        run = self.virga("extract", "--quiet", "gap.%04d.png", "-o", "refused", "--frames", "3-5")
        self.assertEqual(run.code, 3, run)
        self.assertIn("4", run.lines[-1])
        self.assertFalse((self.folder / "refused").exists())


class Flat(StressTest):
    """Footage that says nothing."""

    def test_oneTone(self):
        for value in (0, 0.3, 1):
            with self.subTest(value=value):
                self.dry(np.full((6, 24, 24, 3), value))

    def test_whatEqualsTheRain(self):
        for space in ("linear", "display"):
            report = self.dry(np.full((6, 24, 24, 3), 0.5), "--rain-color", "0.5,0.5,0.5", "--space", space)
            np.testing.assert_allclose(report["rain"]["color"], 0.5, rtol=1e-5)
        wall = self.rainy.copy()  # a wall of the rain's colour in footage that has rain
        wall[:, 30:60] = (0.78, 0.80, 0.82)
        self.bounded(wall, "--rain-color", "0.78,0.80,0.82")

    def test_noiseAlone(self):
        self.dry(rained(self.ground, 0 * self.alpha))
        self.dry(rained(self.ground, strokes(30, SIZE, SIZE, wet=0)), "--window", "8")


class Light(StressTest):
    def test_clippedSky(self):
        sky = self.rainy.copy()
        sky[:, :40] = 1
        self.assertAlmostEqual(self.bounded(sky)["rain"]["slant_deg"], 8, delta=0.5)

    def test_brightAndDark(self):
        for factor in (1e4, 1e-3):
            self.assertAlmostEqual(self.bounded(factor * self.rainy, "--float")["rain"]["slant_deg"], 8, delta=0.5)

    def test_lamps(self):
        lamp = self.rainy.copy()
        lamp[:, 10:14, 10:14] = 1e4
        self.bounded(lamp)
        lamp[5, 50:53, 50:53] = 1e4  # a flash
        self.bounded(lamp)

    def test_moreThanHalfFloatHolds(self):
        self.bounded(1e6 * self.rainy, "--half")
        self.assertIn("beyond the range of half float", self.said)

    def test_negativeValues(self):
        below = self.rainy.copy()
        below[:, 40:60] -= 0.3
        self.bounded(below)

    def test_whatIsNoNumber(self):
        broken = self.rainy.copy()
        broken[3, 5:9, 7], broken[4, 50, 50, 1], broken[5, 20, 20] = np.nan, np.inf, -np.inf
        report = self.bounded(broken)
        self.assertEqual(report["repaired"]["values"], 4 * 3 + 1 + 3)
        self.assertIn("16 values of the footage were NaN or infinite", self.said)
        alphas = self.images("alpha.%04d.exr", range(1, FRAMES + 1))[..., 0]
        self.assertLess(rmse(alphas, self.alpha), 0.2 * rmse(0, self.alpha))
        broken[7] = np.nan
        self.assertLess(rmse(readImage(self.folder / "out/clean.exr")[0], self.ground), 0.01)
        self.assertEqual(self.bounded(broken, "--window", "6")["repaired"]["values"], 16 + 3 * SIZE * SIZE)

    def test_noNumberAtAll(self):
        self.bounded(np.nan * self.rainy, code=3)


class Shapes(StressTest):
    def test_thin(self):
        for height, width in ((SIZE, 1), (1, SIZE), (1, 1), (17, 3)):
            with self.subTest(height=height, width=width):
                self.bounded(self.rainy[:, :height, :width])

    def test_odd(self):
        report = self.bounded(self.rainy[:, :61, :53])
        self.assertAlmostEqual(report["rain"]["slant_deg"], 8, delta=1)

    def test_smallWithAllThereIs(self):
        self.bounded(self.rainy[:, :16, :16], "--stabilize", "--confidence", "--strokes", "4096", "--tile", "auto", "--force")


class Rain(StressTest):
    def test_nearlyLevel(self):
        for slant in (80, -80):
            rain = self.bounded(rained(self.ground, strokes(FRAMES, SIZE, SIZE, slant=slant)))["rain"]
            self.assertAlmostEqual(rain["slant_deg"], slant, delta=1)

    def test_snow(self):
        report = self.bounded(rained(self.ground, strokes(FRAMES, SIZE, SIZE, slant=20, length=(2, 4))))
        self.assertIsNone(report["rain"]["rate_mm_h"])
        self.assertIsNone(report["match"])

    def test_downpour(self):
        self.bounded(rained(self.ground, strokes(FRAMES, SIZE, SIZE, wet=0.6)), "--force")

    def test_weights(self):
        for smooth in ("0", "1e9"):
            for along in ("0", "1e9"):
                with self.subTest(smooth=smooth, along=along):
                    report = self.bounded(self.rainy, "--lambda", smooth, "--mu", along)
                    self.assertEqual((report["model"]["lambda"], report["model"]["mu"]), (float(smooth), float(along)))
        report = self.extract("stack.png", "--stack", FRAMES, "--linear", "--paper", "--lambda", "0", "--mu", "0")
        self.assertTrue(np.isfinite(report["model"]["objective"]).all())

    def test_whatIsGivenIsAbsurd(self):
        self.bounded(self.rainy, "--rain-color", "0,0,0")
        self.bounded(self.rainy, "--rain-color", "1000000,0,0")
        self.bounded(self.rainy, "--slant", "90", "--iterations", "1", "--tolerance", "0.1")


del ExtractTest, StressTest  # only bases


if __name__ == "__main__":
    unittest.main()
