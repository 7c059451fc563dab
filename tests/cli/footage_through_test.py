"""Real footage with every effect off comes back as ffmpeg and OpenImageIO decode it: right side up, in time, in colour,
with its sound."""
import os
import subprocess
import unittest
from pathlib import Path

import numpy as np
from support import OFF, CliTest, bits, frameTimes, packetTable, probe, readImage

FOOTAGE = Path(os.environ.get("VIRGA_FOOTAGE_DIR", "/nonexistent"))
FRAMES = 40  # of each movie


def codes(path, frames=FRAMES):
    """Checksums of the pictures as they are shown, in the movie's own samples."""
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:v:0", "-frames:v", str(frames), "-vsync",
                           "passthrough", "-f", "framemd5", "-"], check=True, capture_output=True, text=True, timeout=240)
    return [line.split(",")[-1].strip() for line in done.stdout.splitlines() if line and not line.startswith("#")]


def pixels(path):
    image, _ = readImage(path, "uint8")
    return image


@unittest.skipUnless(FOOTAGE.is_dir(), "VIRGA_FOOTAGE_DIR names no folder with footage")
class FootageThrough(CliTest):
    def checkMovie(self, name):
        """Into FFV1, which loses nothing: what was decoded is what comes back, code for code."""
        clip, result = FOOTAGE / name, self.folder / "same.mkv"
        self.rain(clip, "-o", result, *OFF, "--codec", "ffv1", "--frames", f"0-{FRAMES - 1}")
        self.assertEqual(codes(result), codes(clip))
        self.assertEqual(len(codes(result)), FRAMES)
        times, expected = frameTimes(result)[:FRAMES], frameTimes(clip)[:FRAMES]
        # Matroska has milliseconds.
        np.testing.assert_allclose(np.array(times) - times[0], np.array(expected) - expected[0], atol=1.1e-3)
        return clip, result

    def test_variableRateTurnedWithSound(self):
        clip, result = self.checkMovie("rain-yard/yard_original.mp4")
        shown = probe(result)
        self.assertEqual((shown["width"], shown["height"]), (368, 640))
        self.assertNotIn("side_data_list", shown)  # it is upright: nobody shall turn it again
        sound = packetTable(result, "a:0")
        self.assertGreater(len(sound), 40)
        self.assertEqual(sound, packetTable(clip, "a:0")[:len(sound)])

    def test_losslessMatroska(self):
        self.checkMovie("rain-yard/yard_000-149.mkv")

    def test_surveillance(self):
        self.checkMovie("clean-vtest/vtest_000-149.mp4")

    def test_dashCamera(self):
        self.checkMovie("clean-highway/solidWhiteRight.mp4")

    def test_panningPhone(self):
        self.checkMovie("pan-street/street1.mp4")

    def test_pngSequence(self):
        self.rain(FOOTAGE / "rain-pair-pedestrian/rain/%04d.png", "-o", "same.%04d.png", *OFF)
        names = sorted((FOOTAGE / "rain-pair-pedestrian/rain").glob("*.png"))
        for source in names:
            same = pixels(self.folder / f"same.{source.name}")
            before = pixels(source)
            np.testing.assert_array_equal(same, np.broadcast_to(before, same.shape), source.name)

    def test_jpegSequence(self):
        self.rain(FOOTAGE / "rain-ntu-ra1/frames/%05d.jpg", "-o", "same.%05d.png", *OFF, "--frames", "1-5")
        for frame in range(1, 6):
            np.testing.assert_array_equal(pixels(self.folder / f"same.{frame:05d}.png"),
                                          pixels(FOOTAGE / f"rain-ntu-ra1/frames/{frame:05d}.jpg"))

    def test_panoramas(self):
        """Bit for bit; what was compressed with loss is not so once more: DWA comes back as it decodes, values below 0 too."""
        for source in sorted((FOOTAGE / "hdri").glob("*.exr")):
            self.rain(source, "-o", "same.exr", *OFF)
            kind, names, words = bits(source)
            after = bits(self.folder / "same.exr")
            self.assertEqual((after[0], after[1]), (kind, names), source.name)
            np.testing.assert_array_equal(after[2], words, source.name)
            if "dwaa" in source.name:
                self.assertTrue((readImage(source)[0] < 0).any())

    def test_depthAndColour(self):
        self.rain(FOOTAGE / "clean-rgbd-7scenes/color/frame-%06d.jpg", "-o", "rain.%06d.png", "--rate", "80", "--depth",
                  FOOTAGE / "clean-rgbd-7scenes/depth/frame-%06d.png", "--depth-scale", "0.001", "--depth-no-value", "65535",
                  "--frames", "0-2")
        self.assertEqual(len(list(self.folder.glob("rain.*.png"))), 3)


if __name__ == "__main__":
    unittest.main()
