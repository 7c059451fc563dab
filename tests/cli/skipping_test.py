"""What is skipped is told: plates that do not change, drops behind the depth, lamps whose light does not arrive."""
import unittest

import numpy as np
from support import CHEAP, HEIGHT, WIDTH, CliTest, bits, ffmpeg, street, writeImage


class Skipping(CliTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "plate.exr", street())
        writeImage(cls.folder / "wall.exr", np.full((HEIGHT, WIDTH), 2.5), channels=["Z"])
        writeImage(cls.folder / "sky.exr", np.full((HEIGHT, WIDTH), np.inf), kind="float", channels=["Z"])
        (cls.folder / "lamps.toml").write_text("[[light]]\nposition = [1, 2, -5]\nintensity = [5, 4, 3]\n"
                                               "[[light]]\nposition = [0, 0, 50000]\nintensity = [5, 4, 3]\n")
        # 8 frames, of which two and two are the same; without losses, so that they stay so.
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={WIDTH}x{HEIGHT}:r=12:d=0.34,fps=24", "-frames:v", "8", "-c:v", "ffv1",
               cls.folder / "held.mkv")
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={WIDTH}x{HEIGHT}:r=24:d=0.34", "-frames:v", "8", "-c:v", "ffv1",
               cls.folder / "moving.mkv")

    def test_stillsAreReadOnce(self):
        report = self.rain("plate.exr", "-o", "still.%04d.exr", "--frames", "1-4")
        self.assertEqual(report["left_out"]["unchanged_plates"], 3)
        self.assertEqual(report["frames"], 4)
        self.rain("plate.exr", "-o", "alone.exr", "--frames", "3")
        for one, other in zip(bits(self.path("still.0003.exr")), bits(self.path("alone.exr"))):
            self.assertTrue(np.array_equal(one, other))
        self.assertFalse(np.array_equal(bits(self.path("still.0003.exr"))[2], bits(self.path("still.0004.exr"))[2]))

    def test_framesThatAMovieHolds(self):
        # Lit by each frame: the light of a frame that is held is, too.
        report = self.rain("held.mkv", "-o", "held.%04d.exr", "--env-frames", "0")
        self.assertEqual(report["left_out"]["unchanged_plates"], 4)
        report = self.rain("moving.mkv", "-o", "moving.mkv.mkv", "--env-frames", "0")
        self.assertEqual(report["left_out"]["unchanged_plates"], 0)
        self.rain("held.mkv", "-o", "one.%04d.exr", "--frames", "3", "--env-frames", "0")
        for one, other in zip(bits(self.path("held.0003.exr")), bits(self.path("one.0003.exr"))):
            self.assertTrue(np.array_equal(one, other))

    def test_dropsBehindTheDepth(self):
        for depth, some in (("wall.exr", True), ("sky.exr", False)):
            report = self.rain("plate.exr", "-o", "depth.exr", "--depth", depth, "--threshold", "0.002", *CHEAP)
            self.assertEqual(report["left_out"]["cells_behind_depth_per_frame"] > 100, some, depth)

    def test_lampsFarAway(self):
        report = self.rain("plate.exr", "-o", "lamps.exr", "--lights", "lamps.toml")
        self.assertEqual(report["left_out"]["lamps_per_frame"], 1)
        (self.folder / "far.toml").write_text("[[light]]\nposition = [0, 0, 50000]\nintensity = [5, 4, 3]\n")
        report = self.rain("plate.exr", "-o", "far.exr", "--lights", "far.toml")
        self.assertEqual(report["skipped"]["lights"], "no light of 'far.toml' reaches a drop")
        self.rain("plate.exr", "-o", "without.exr")
        for one, other in zip(bits(self.path("far.exr")), bits(self.path("without.exr"))):
            self.assertTrue(np.array_equal(one, other))


if __name__ == "__main__":
    unittest.main()
