"""A frame is a pure function of settings and frame number; a movie's frames, times and sound are kept."""
import os
import unittest
from pathlib import Path

import numpy as np
from support import CHEAP, CliTest, bits, frameTimes, makeMovie, packetTable, probe, readImage, street, writeImage

# Everything that draws: a camera that moves, wind, fog, blur, splashes.
LOOK = ["--rate", "50", "--ground", "1.6", "--camera", "pan.chan", "--wind", "2,1", "--gust", "1", "--blur", "1"]


class Frames(CliTest):
    @classmethod
    def makePlates(cls):
        for frame in range(1, 7):
            writeImage(cls.folder / f"shot.{frame:04d}.exr", street(seed=frame))
        (cls.folder / "pan.chan").write_text("1 0 1.6 0 0 0 0\n6 0.5 1.6 -1 0 9 0\n")
        makeMovie(cls.folder / "clip.mp4")

    def frame(self, name):
        return bits(self.folder / name)[2]

    def test_oneFrameAloneIsThatOfTheWholeRun(self):
        self.rain("shot.%04d.exr", "-o", "all.%04d.exr", *LOOK)
        for frames in ("3", "6,1,4"):
            self.rain("shot.%04d.exr", "-o", "some.%04d.exr", *LOOK, "--frames", frames)
            for frame in map(int, frames.split(",")):
                np.testing.assert_array_equal(self.frame(f"some.{frame:04d}.exr"), self.frame(f"all.{frame:04d}.exr"))
        self.assertTrue((self.frame("all.0003.exr") != self.frame("all.0004.exr")).any())

    def test_threads(self):
        for threads in (1, 2):
            self.rain("shot.%04d.exr", "-o", f"t{threads}.%04d.exr", *LOOK, "--threads", threads, "--frames", "2,5")
        for frame in ("0002", "0005"):
            np.testing.assert_array_equal(self.frame(f"t1.{frame}.exr"), self.frame(f"t2.{frame}.exr"))

    def test_frameOfAMovie(self):
        self.rain("clip.mp4", "-o", "all.%04d.png", *LOOK)
        self.rain("clip.mp4", "-o", "one.%04d.png", *LOOK, "--frames", "17")
        np.testing.assert_array_equal(readImage(self.folder / "one.0017.png")[0], readImage(self.folder / "all.0017.png")[0])

    def test_farFrames(self):
        """A still stands for any frame; frame 10,000,000 has as much rain as frame 1, and other rain."""
        pictures, strokes = [], []
        for frame in ("1", "10000000"):
            strokes.append(self.rain("shot.0001.exr", "-o", "far.%d.exr", "--frames", frame)["strokes_per_frame"])
            pictures.append(readImage(self.folder / f"far.{frame}.exr")[0])
        self.assertTrue((pictures[0] != pictures[1]).any())
        # Poisson counts: 6 sigma.
        self.assertLess(abs(strokes[0] - strokes[1]), 6 * np.sqrt(sum(strokes)))


class Movies(CliTest):
    @classmethod
    def makePlates(cls):
        makeMovie(cls.folder / "clip.mp4", seconds=1.2, rate="30000/1001")

    def checkMovie(self, plate, output, *arguments):
        report = self.rain(plate, "-o", output, *arguments)
        before, after = probe(self.path(plate)), probe(self.path(output))
        self.assertEqual(after["nb_read_frames"], before["nb_read_frames"])
        self.assertEqual(report["frames"], int(before["nb_read_frames"]))
        self.assertEqual(after["avg_frame_rate"], before["avg_frame_rate"])
        was, now = np.array(frameTimes(self.path(plate))), np.array(frameTimes(self.path(output)))
        np.testing.assert_allclose(now - now[0], was - was[0], atol=1e-3)
        self.assertEqual(probe(self.path(output), "a:0")["codec_name"], probe(self.path(plate), "a:0")["codec_name"])
        self.assertEqual(packetTable(self.path(output), "a:0"), packetTable(self.path(plate), "a:0"))
        return before, after

    def test_framesRateAndSoundAreKept(self):
        before, after = self.checkMovie("clip.mp4", "out.mp4")
        self.assertEqual(after["r_frame_rate"], "30000/1001")
        self.assertEqual((after["width"], after["height"]), (before["width"], before["height"]))

    def test_anotherContainer(self):
        self.checkMovie("clip.mp4", "out.mov")

    def test_yard(self):
        """A telephone's clip: variable rate, turned by its display matrix, AAC."""
        folder = os.environ.get("VIRGA_FOOTAGE_DIR", "")
        footage = Path(folder) / "rain-yard" / "yard_original.mp4"
        if not folder or not footage.exists():
            self.skipTest("VIRGA_FOOTAGE_DIR has no rain-yard/yard_original.mp4")
        (self.folder / "yard.mp4").symlink_to(footage)
        self.checkMovie("yard.mp4", "yard_rain.mp4", "--codec", "mjpeg", "--rate", "5", *CHEAP)


if __name__ == "__main__":
    unittest.main()
