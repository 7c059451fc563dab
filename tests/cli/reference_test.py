"""virga rain --reference: the slow, exact picture, through the same writers, and what it refuses."""
import unittest

import numpy as np
from support import CHEAP, OFF, CliTest, bits, readImage, street, writeImage

SMALL = ["--splashes", "0", "--env", "env.exr"]


class Reference(CliTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "plate.exr", street(48, 32), "float")
        writeImage(cls.folder / "env.exr", np.full((8, 16, 3), 0.5), "float")
        writeImage(cls.folder / "env.0001.exr", np.full((8, 16, 3), 0.5), "float")

    def layers(self, name, *arguments):
        report = self.rain("plate.exr", "-o", name, "--layers", "--float", *SMALL, *arguments)
        pixels, names = readImage(self.folder / name)
        return report, {n: pixels[..., i].astype(float) for i, n in enumerate(names)}

    def test_isThePictureThatTheRendererMakes(self):
        _, fast = self.layers("fast.exr", "--rate", "80")
        report, true = self.layers("true.exr", "--rate", "80", "--reference=drawn")
        self.assertEqual(report["device"], "the reference")
        self.assertEqual(fast.keys(), true.keys())
        mean = np.mean([fast[f"plate.{c}"].mean() for c in "RGB"])
        self.assertGreater(true["rain.A"].mean(), 1e-3)
        for c in "RGB":
            self.assertLess(np.sqrt(np.mean((fast[c] - true[c]) ** 2)), 0.01 * mean)
        seen = np.isfinite(fast["rain.Z"]) & np.isfinite(true["rain.Z"])
        self.assertGreater(seen.sum(), 10)
        self.assertLess(np.median(np.abs(fast["rain.Z"][seen] - true["rain.Z"][seen])), 0.2)

    def test_drawsEveryDropUnlessToldOtherwise(self):
        drawn, faint = self.layers("a.exr", "--far", "6", "--reference=drawn")
        every, all_ = self.layers("b.exr", "--far", "6", "--reference")
        self.assertGreater(every["strokes_per_frame"], 20 * drawn["strokes_per_frame"])
        self.assertLess(all_["fog.A"].max(), 0.2 * faint["fog.A"].max())

    def test_isTheSameTwice(self):
        for name in ("one.exr", "two.exr"):
            self.layers(name, "--far", "6", "--reference", "--reference-samples", "4")
        np.testing.assert_array_equal(bits(self.folder / "one.exr")[2], bits(self.folder / "two.exr")[2])

    def test_ofNothingIsThePlate(self):
        self.rain("plate.exr", "-o", "same.exr", "--float", *OFF, "--reference")
        np.testing.assert_array_equal(readImage(self.folder / "same.exr")[0], readImage(self.folder / "plate.exr")[0])

    def test_doesNotTakeThePlateForItsValue(self):
        self.rain("--reference", "plate.exr", "-o", "out.exr", "--far", "4", *SMALL, *CHEAP)

    def test_refusesWhatItDoesNotDo(self):
        rain = ["rain", "plate.exr", "-o", "no.exr", "--reference"]
        self.refused(2, ["--reference", "splashes", "--splashes 0"], *rain, "--ground", "1.6")
        self.refused(2, ["--reference", "--paper"], *rain, "--paper")
        self.refused(2, ["--reference", "--background-boost"], *rain, "--background-boost", "1")
        self.refused(2, ["--reference", "sequence of panoramas"], *rain, "--env", "env.####.exr")
        self.refused(2, ["--far 200", "lower --far to"], *rain, *SMALL)
        self.refused(2, ["--reference 'some'", "all", "drawn"], *rain[:-1], "--reference=some")
        for samples in ("0", "257"):
            self.refused(2, ["--reference-samples", samples, "1 to 256"], *rain, *SMALL, "--far", "4", "--reference-samples",
                         samples)
        self.refused(2, ["--reference", "--resume"], *rain, "--resume", "--far", "4")

    def test_leavesNoFrameThatResumeWouldKeep(self):
        frames = ["rain", "plate.exr", "-o", "seq.%04d.exr", "--frames", "1", *SMALL, "--far", "4"]
        self.succeeds(*frames, "--reference=drawn")
        report = self.succeeds(*frames, "--resume", "--json", "--quiet").report
        self.assertEqual(report["kept_frames"], 0)


if __name__ == "__main__":
    unittest.main()
