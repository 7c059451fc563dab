"""Where the light of drops comes from: few frames of the plate, each of them, one panorama or a sequence of panoramas."""
import unittest

import numpy as np
from support import CHEAP, CliTest, bits, readImage, street, writeImage


def pieces(seed):
    """A picture of blocks: another seed is another scene."""
    blocks = np.random.default_rng(seed).uniform(0.05, 0.9, (9, 16))
    pixels = np.ones((54, 96, 4), np.float32)
    pixels[..., :3] = np.kron(blocks, np.ones((6, 6)))[..., None]
    return pixels


class FromThePlate(CliTest):
    @classmethod
    def makePlates(cls):
        for frame in range(1, 8):
            writeImage(cls.folder / f"still.{frame:04d}.exr", street(seed=frame))
            writeImage(cls.folder / f"cuts.{frame:04d}.exr", pieces(frame))
            writeImage(cls.folder / f"dusk.{frame:04d}.exr", pieces(1) * np.array([0.8 ** frame] * 3 + [1]))
        (cls.folder / "pan.chan").write_text("1 0 1.6 0 0 0 0\n7 0 1.6 0 0 40 0\n")

    def source(self, plate, *arguments):
        return self.rain(f"{plate}.%04d.exr", "-o", "out.%04d.exr", *CHEAP, *arguments)["light"]["source"]

    def test_aSteadyShotIsJudgedByAFewFrames(self):
        self.assertEqual(self.source("still"), "plate, frames 1-2,4-5,7")
        self.assertEqual(self.source("still", "--env-frames", "3"), "plate, frames 1-7x3")
        self.assertEqual(self.source("still", "--env-frames", "1"), "plate, frame 4")
        self.assertEqual(self.source("still", "--env-frames", "0"), "plate, each frame")

    def test_byTheSameFramesWhateverIsRendered(self):
        self.rain("still.%04d.exr", "-o", "all.%04d.exr", *CHEAP)
        self.assertEqual(self.source("still", "--frames", "6"), "plate, frames 1-2,4-5,7")
        np.testing.assert_array_equal(bits(self.folder / "out.0006.exr")[2], bits(self.folder / "all.0006.exr")[2])

    def test_whatChangesIsLitFrameByFrame(self):
        self.assertEqual(self.source("cuts"), "plate, each frame: the picture moves")
        self.assertEqual(self.source("dusk"), "plate, each frame: its light changes")

    def test_aTrackTellsWhereFramesLook(self):
        self.assertEqual(self.source("cuts", "--camera", "pan.chan"), "plate, frames 1-2,4-5,7")
        (self.folder / "drive.chan").write_text("1 0 1.6 0 0 0 0\n7 0 1.6 -9 0 0 0\n")
        self.assertEqual(self.source("cuts", "--camera", "drive.chan"), "plate, each frame: the camera travels")

    def test_aBrokenFrameElsewhereIsNoReasonToFail(self):
        for frame in range(1, 8):
            writeImage(self.folder / f"torn.{frame:04d}.exr", street(seed=frame))
        torn = self.folder / "torn.0007.exr"
        torn.write_bytes(torn.read_bytes()[:3000])
        self.assertEqual(self.source("torn", "--frames", "2"), "plate, frames 1-2,4-5")

    def test_nothingIsReadWhereNothingIsLit(self):
        report = self.rain("cuts.%04d.exr", "-o", "out.%04d.exr", "--rate", "0", *CHEAP)
        self.assertEqual(report["light"]["source"], "")


class CutOffAtWhite(CliTest):
    """A sun that an 8-bit panorama cut off at white, straight behind the rain."""

    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "plate.exr", np.concatenate([np.zeros((54, 96, 3)), np.ones((54, 96, 1))], -1), "float")
        sky = np.full((128, 256, 3), 0.3)
        sky[64:] = 0.1
        sky[58:62, 126:130] = 1.0
        codes = np.where(sky <= 0.0031308, 12.92 * sky, 1.055 * sky ** (1 / 2.4) - 0.055)  # sRGB
        writeImage(cls.folder / "sun.png", codes, "uint8")
        writeImage(cls.folder / "sun.exr", sky, "half")

    def light(self, env, *arguments):
        run = self.succeeds("rain", "plate.exr", "-o", "rain.exr", "--layers", "--float", *CHEAP, "--env", env, *arguments)
        pixels, names = readImage(self.folder / "rain.exr")
        return pixels[..., names.index("rain.G")].astype(float).sum() / pixels[..., names.index("rain.A")].sum(), run

    def test_integersAreRepairedFloatsAreTakenAtTheirWord(self):
        asIs, quiet = self.light("sun.exr")
        estimated, told = self.light("sun.png")
        self.assertGreater(estimated, 1.2 * asIs)
        self.assertIn("sun.png", told.err)
        self.assertNotIn("sun.exr: ", quiet.err)

    def test_theUsersWordCounts(self):
        dim, bright = (self.light("sun.png", "--light-radiance", str(radiance))[0] for radiance in (100, 1000))
        self.assertGreater(bright, 5 * dim)


class FromASequence(CliTest):
    """Panoramas at frames 10 and 20 of radiance 1 and 3: what rain returns, over what it hides, goes from 1 to 3."""

    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "plate.exr", np.concatenate([np.zeros((54, 96, 3)), np.ones((54, 96, 1))], -1), "float")
        for frame, radiance in ((10, 1), (20, 3)):
            writeImage(cls.folder / f"env.{frame:04d}.exr", np.full((8, 16, 3), radiance), "float")

    def radianceAt(self, frame):
        self.rain("plate.exr", "-o", "rain.%04d.exr", "--layers", "--float", *CHEAP, "--env", "env.####.exr", "--frames", frame)
        pixels, names = readImage(self.folder / f"rain.{frame:04d}.exr")
        rain = {channel: pixels[..., names.index(f"rain.{channel}")].astype(float).sum() for channel in "GA"}
        return rain["G"] / rain["A"]

    def test_isBlended(self):
        for frame, radiance in ((1, 1), (10, 1), (14, 1.8), (20, 3), (30, 3)):
            self.assertAlmostEqual(self.radianceAt(frame), radiance, delta=1e-5)

    def test_thatDoesNotExist(self):
        self.refused(3, "none.####.exr", "rain", "plate.exr", "-o", "out.exr", "--env", "none.####.exr")


if __name__ == "__main__":
    unittest.main()
