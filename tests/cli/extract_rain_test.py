"""virga extract: what it finds in rain that was drawn."""
import unittest

import numpy as np
from footage import (FRAMES, RAIN, SIZE, WET, ExtractTest, rained, rmse, scene, srgb, strokes, writeSequence, writeStack)
from support import CliTest, readImage


class Findings(ExtractTest):
    """Rain that was drawn, its truth known."""

    def test_drawnRain(self):
        for seed in (1, 2, 5):
            with self.subTest(seed=seed):
                alpha = strokes(FRAMES, SIZE, SIZE, seed=seed)
                rainy = rained(self.ground, alpha, seed=seed)
                writeStack(self.folder / "rain.png", rainy)
                report = self.extract("rain.png", "--stack", FRAMES, "--linear")
                rain = report["rain"]
                self.assertIs(rain["found"], True)
                self.assertAlmostEqual(rain["slant_deg"], 8, delta=0.5)
                self.assertAlmostEqual(rain["strokes_slant_deg"], 8, delta=0.5)
                allowed = max(0.06, 4 * rain["color_error"])
                self.assertLess(np.abs(np.array(rain["color"]) - RAIN).max(), allowed)
                self.assertEqual(rain["color_source"], "strokes")
                found = self.images("alpha.%04d.exr", range(FRAMES))[..., 0]
                self.assertLess(rmse(found, alpha), 0.2 * rmse(0, alpha))
                clean = self.images("clean.%04d.exr", range(FRAMES))[..., :3]
                self.assertLess(rmse(clean, self.ground), rmse(rainy, self.ground) / 3)
                self.assertAlmostEqual(rain["wet_share"], (alpha > WET).mean(), delta=0.03)
                objective = np.array(report["model"]["objective"])
                self.assertTrue(np.isfinite(objective).all() and objective[-1] > 0)

    def test_slants(self):
        for slant in (-35, 0, 25):
            writeStack(self.folder / "rain.png", rained(self.ground, strokes(FRAMES, SIZE, SIZE, slant=slant)))
            rain = self.extract("rain.png", "--stack", FRAMES, "--linear")["rain"]
            self.assertAlmostEqual(rain["slant_deg"], slant, delta=0.5)

    def test_whatIsGivenIsUsed(self):
        report = self.extract(*self.STACK, "--rain-color", "0.7,0.9,1.1", "--slant", "11")
        rain = report["rain"]
        np.testing.assert_allclose(rain["color"], [0.7, 0.9, 1.1], rtol=1e-5)
        self.assertEqual((rain["color_source"], rain["color_error"]), ("given", 0))
        self.assertAlmostEqual(rain["slant_deg"], 11, places=5)
        self.assertAlmostEqual(rain["strokes_slant_deg"], 8, delta=0.7)  # the strokes' own
        # More of a darker C is in the same light.
        darker = self.extract(*self.STACK, "--rain-color", "0.65,0.65,0.65", out="dark")["rain"]["wet_share"]
        brighter = self.extract(*self.STACK, "--rain-color", "3,3,3", out="bright")["rain"]["wet_share"]
        self.assertGreater(darker, 1.5 * brighter)
        self.assertEqual(self.extract(*self.STACK, "--lambda", "0.5", "--mu", "0.25")["model"]["lambda"], 0.5)

    def test_spaceThatIsGiven(self):
        for space in ("linear", "display"):
            writeSequence(self.folder, "s.%04d.png", srgb(self.rainy), "uint16")
            model = self.extract("s.%04d.png", "--space", space)["model"]
            self.assertEqual((model["space"], model["space_chosen"]), (space, "--space"))

    def test_unitsOfTheFootage(self):
        """Footage times a factor has the same alphas and C times the factor."""
        wanted = self.extract(*self.STACK)
        alphas = self.images("alpha.%04d.exr", range(FRAMES))
        for factor in (100, 1e-2):
            writeSequence(self.folder, "times.%04d.exr", factor * self.rainy, "float", first=0)
            rain = self.extract("times.%04d.exr", "--space", "linear")["rain"]
            np.testing.assert_allclose(np.array(rain["color"]) / factor, wanted["rain"]["color"], atol=0.01)
            self.assertLess(rmse(self.images("alpha.%04d.exr", range(FRAMES)), alphas), 0.003)

    def test_paper(self):
        report = self.extract(*self.STACK, "--paper", "--rain-color", ",".join(map(str, RAIN)))
        found = self.images("alpha.%04d.exr", range(FRAMES))[..., 0]
        self.assertLess(found.min(), -0.01)  # nothing bounds it
        self.assertLess(rmse(found, self.alpha), 0.2 * rmse(0, self.alpha))
        objective = report["model"]["objective"]
        self.assertEqual(len(objective), 20)
        self.assertTrue(all(b <= a * (1 + 1e-6) for a, b in zip(objective, objective[1:])), objective)
        self.assertLess(objective[-1], objective[0])
        self.assertEqual((report["model"]["paper"], report["model"]["lambda"], report["model"]["mu"]), (True, 0.05, 0.25))
        self.assertIsNone(report["rain"]["found"])
        self.assertIsNone(report["atlas"])
        self.assertEqual(len(self.extract(*self.STACK, "--paper", "--iterations", "3")["model"]["objective"]), 3)

    def test_aManWalksThrough(self):
        ground = scene(160, 200)
        walks = rained(ground, strokes(FRAMES, 160, 200))
        for k in range(FRAMES):
            walks[k, 100:124, 15 * k:15 * k + 8] = (0.02, 0.02, 0.03)
        writeStack(self.folder / "walks.png", walks)
        told = self.extract("walks.png", "--stack", FRAMES, "--linear")
        self.assertGreater(told["model"]["moving_share"], 0.005)
        self.assertLess(rmse(readImage(self.folder / "out/clean.exr")[0], ground), 0.02)
        self.assertEqual(self.extract("walks.png", "--stack", FRAMES, "--linear", "--still")["model"]["moving_share"], 0)

    def test_noiseIsNoRain(self):
        found = []
        for seed in range(1, 5):
            dry = rained(self.ground, 0 * self.alpha, noise=1 / 255, seed=seed)
            writeSequence(self.folder, "dry.%04d.png", srgb(dry))
            found.append(self.extract("dry.%04d.png")["rain"]["found"])
        self.assertEqual(found, [False] * len(found))

    def test_rainIsNoCameraMove(self):
        rainy = rained(self.ground, strokes(45, SIZE, SIZE))
        writeSequence(self.folder, "still.%04d.png", srgb(rainy[[4, 22, 44]]))
        self.assertEqual(self.extract("still.%04d.png")["footage"]["frames"], 3)

    def test_aLampLeavesTheRainAlone(self):
        lit = self.rainy.copy()
        lit[:, 10:14, 10:14] = 100
        writeSequence(self.folder, "lamp.%04d.exr", lit, "float")
        rain = self.extract("lamp.%04d.exr")["rain"]
        self.assertIs(rain["found"], True)
        self.assertLess(np.abs(np.array(rain["color"]) - RAIN).max(), 0.1)


class Camera(CliTest):
    """A camera that pans by 2 pixels a frame."""

    STEP, COUNT = 2, 10

    @classmethod
    def makePlates(cls):
        wide = scene(160, 240, seed=3)
        cls.ground = np.stack([wide[:, cls.STEP * k:cls.STEP * k + 200] for k in range(cls.COUNT)])
        cls.rainy = rained(cls.ground, strokes(cls.COUNT, 160, 200, slant=6))
        writeSequence(cls.folder, "pan.%04d.png", srgb(cls.rainy))

    def test_isToldAndStabilized(self):
        sentence = self.refused(3, ["'pan.%04d.png'", "no scene stands still", "the camera moves", "--stabilize",
                                    "--force"], "extract", "pan.%04d.png", "-o", "out")
        self.assertRegex(sentence, r"by \d+\.\d px")
        report = self.succeeds("extract", "--json", "pan.%04d.png", "-o", "out", "--stabilize").report
        self.assertAlmostEqual(report["stabilized"]["motion_px"], self.STEP * self.COUNT / 2, delta=0.5)
        self.assertLess(report["stabilized"]["residual_px"], 0.5)
        self.assertIs(report["rain"]["found"], True)
        self.assertAlmostEqual(report["rain"]["slant_deg"], 6, delta=1)
        clean = np.stack([readImage(self.folder / f"out/clean.{n:04d}.exr")[0] for n in range(1, self.COUNT + 1)])
        self.assertLess(rmse(clean, self.ground), rmse(self.rainy, self.ground) / 3)
        for n in range(1, self.COUNT + 1):
            alpha, _ = readImage(self.folder / f"out/alpha.{n:04d}.exr")
            self.assertTrue(alpha.min() >= 0 and alpha.max() <= 1)

    def test_force(self):
        run = self.succeeds("extract", "--json", "pan.%04d.png", "-o", "forced", "--force")
        self.assertIn("warning: 'pan.%04d.png': no scene stands still", run.err)
        self.assertEqual(run.report["footage"]["frames"], self.COUNT)

    def test_cuts(self):
        frames = [scene(64, 64, seed) for seed in range(8)]
        writeSequence(self.folder, "cuts.%04d.png", srgb(np.stack(frames)))
        self.refused(3, ["'cuts.%04d.png'", "no scene stands still", "--force"], "extract", "cuts.%04d.png", "-o", "cuts")


del ExtractTest  # only a base


if __name__ == "__main__":
    unittest.main()
