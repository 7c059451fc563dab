"""virga extract: what lies in the folder afterwards, and how it goes into virga rain."""
import json
import unittest

import numpy as np
from footage import (FRAMES, SIZE, ExtractTest, rained, rmse, scene, srgb, strokes, writeSequence, writeStack)
from support import ffmpeg, probe, readImage, street, writeImage


class Results(ExtractTest):
    def test_stack(self):
        report = self.extract(*self.STACK)
        self.checkFolder(range(FRAMES), (SIZE, SIZE), "float")
        footage = report["footage"]
        self.assertEqual((footage["width"], footage["height"], footage["frames"], footage["frame_range"]),
                         (SIZE, SIZE, FRAMES, f"0-{FRAMES - 1}"))
        self.assertEqual((footage["colorspace"], report["model"]["space"]), ("Linear Rec.709", "linear"))
        self.assertEqual(report["files"], {"alpha": "alpha.####.exr", "atlas": "atlas.exr", "clean": "clean.####.exr",
                                           "confidence": "confidence.exr", "plate": "clean.exr", "sheet": "sheet.png"})
        self.assertFalse(report["stopped"])
        self.assertEqual(report["repaired"], {"values": 0, "frames": []})

    def test_sheetAndAtlas(self):
        report = self.extract(*self.STACK, "--strokes", "20", "--tile", "8x32")
        self.assertEqual(report["atlas"], {"strokes": 20, "tile_width": 8, "tile_height": 32})
        atlas, _ = readImage(self.folder / "out/atlas.exr")
        self.assertEqual(atlas.shape, (2 * 32, 16 * 8, 1))  # 16 a row
        self.assertTrue(0.2 < atlas.max() <= 1 and atlas.min() >= 0)
        self.assertEqual(len(json.loads((self.folder / "out/atlas.json").read_text())["strokes"]), 20)
        sheet, _ = readImage(self.folder / "out/sheet.png")
        self.assertGreater(sheet.shape[0], 2 * SIZE)
        # Frame, alpha, plate, frame without rain: the first differs from the last, which is nearly the third.
        frame, _, plate, clean = (sheet[y:y + SIZE, x:x + SIZE] for y in (0, SIZE + 8) for x in (0, SIZE + 8))
        self.assertGreater(rmse(frame, plate), 2 * rmse(clean, plate))

    def test_depthOfFiles(self):
        for name, kind, flags, wanted in (("s.%04d.png", "uint8", [], "half"), ("s.%04d.png", "uint8", ["--float"], "float"),
                                          ("d.%04d.png", "uint16", [], "float"), ("d.%04d.png", "uint16", ["--half"], "half"),
                                          ("h.%04d.exr", "half", [], "half"), ("f.%04d.exr", "float", [], "float")):
            with self.subTest(name=name, flags=flags):
                frames = self.rainy[:4] if name.endswith("exr") else srgb(self.rainy[:4])
                writeSequence(self.folder, name, frames, kind)
                self.extract(name, *flags)
                for picture in ("alpha.0002.exr", "clean.0002.exr"):
                    self.assertEqual(self.spec(picture)[2], wanted)

    def test_sequenceKeepsItsNumbersAndColours(self):
        writeSequence(self.folder, "shot.%04d.png", srgb(self.rainy), first=1001)
        report = self.extract("shot.%04d.png", "--confidence")
        numbers = range(1001, 1001 + FRAMES)
        self.checkFolder(numbers, (SIZE, SIZE), "half", [f"confidence.{n}.exr" for n in numbers])
        self.assertEqual((report["footage"]["frame_range"], report["footage"]["colorspace"]), ("1001-1012", "sRGB"))
        confidence = self.images("confidence.%04d.exr", numbers)
        self.assertTrue(confidence.min() >= 0 and confidence.max() <= 1)
        # The frames are linear light, as the scene is.
        clean = self.images("clean.%04d.exr", numbers)[..., :3]
        self.assertLess(rmse(clean, self.ground), rmse(self.rainy, self.ground) / 3)
        self.assertLess(rmse(readImage(self.folder / "out/clean.exr")[0], self.ground), 0.01)

    def test_frames(self):
        writeSequence(self.folder, "shot.%04d.png", srgb(self.rainy), first=1001)
        report = self.extract("shot.####.png", "--frames", "1009,1002-1006x2")
        self.assertEqual((report["footage"]["frames"], report["footage"]["frame_range"]), (4, "1002-1006x2,1009"))
        self.checkFolder((1002, 1004, 1006, 1009), (SIZE, SIZE), "half")

    def test_movie(self):
        # What a movie's coder does to rain this fine is its own affair: here it does next to nothing.
        writeSequence(self.folder, "in.%04d.png", srgb(self.rainy))
        ffmpeg("-r", "25", "-i", self.folder / "in.%04d.png", "-c:v", "libx264", "-qp", "4", "-pix_fmt", "yuv444p",
               self.folder / "rain.mkv")
        report = self.extract("rain.mkv")
        self.checkFolder(range(FRAMES), (SIZE, SIZE), "half")
        self.assertEqual((report["footage"]["fps"], report["footage"]["frames"]), (25, FRAMES))
        for name in ("clean.mov", "clean.mkv"):
            self.assertEqual(self.extract("rain.mkv", "--clean", name)["files"]["clean"], name)
            picture = probe(self.folder / "out" / name)
            self.assertEqual((int(picture["nb_read_frames"]), picture["width"], picture["height"]), (FRAMES, SIZE, SIZE))
            self.assertNotIn("clean.0000.exr", self.names())
        self.assertNotIn("clean", self.extract("rain.mkv", "--clean", "none")["files"])
        self.assertEqual([n for n in self.names() if n.startswith("clean")], ["clean.exr"])
        self.assertEqual(self.extract("rain.mkv", "--fps", "50")["footage"]["fps"], 50)

    def test_cleanByAnotherName(self):
        report = self.extract(*self.STACK, "--clean", "dry.%03d.png")
        self.assertEqual(report["files"]["clean"], "dry.%03d.png")
        self.assertEqual([n for n in self.names() if n.startswith("dry")], [f"dry.{n:03d}.png" for n in range(FRAMES)])

    def test_windows(self):
        alpha = strokes(45, SIZE, SIZE, seed=2)
        rainy = rained(self.ground, alpha, seed=2)
        writeSequence(self.folder, "long.%04d.png", srgb(rainy), first=101)
        numbers = range(101, 146)
        report = self.extract("long.%04d.png", "--window", "10", "--clean", "clean.mkv")
        self.assertGreater(report["model"]["windows"], 3)
        self.assertEqual((report["footage"]["frames"], report["footage"]["frame_range"]), (45, "101-145"))
        self.assertEqual([n for n in self.names() if n.startswith("alpha")], [f"alpha.{n:04d}.exr" for n in numbers])
        self.assertEqual(int(probe(self.folder / "out/clean.mkv")["nb_read_frames"]), 45)
        self.assertLess(rmse(readImage(self.folder / "out/clean.exr")[0], self.ground), 0.01)
        found = self.images("alpha.%04d.exr", numbers)[..., 0]
        errors = [rmse(a, b) for a, b in zip(found, alpha)]
        self.assertLess(max(errors), 0.35 * rmse(0, alpha), "each frame has the alpha of its own")

    def test_windowsDoNotShow(self):
        """A scene that brightens as it goes: no two clean frames differ by much more than others, where windows meet or
        not."""
        drift = np.linspace(0, 0.3, 45)[:, None, None, None] * np.linspace(0, 1, SIZE)[:, None]
        rainy = rained(self.ground, strokes(45, SIZE, SIZE, seed=2), seed=2) + drift
        writeSequence(self.folder, "drifts.%04d.exr", rainy, "float", first=1)
        self.extract("drifts.%04d.exr", "--window", "10", "--space", "linear")
        clean = self.images("clean.%04d.exr", range(1, 46))[..., :3]
        steps = [np.abs(a - b).mean() for a, b in zip(clean, clean[1:])]
        self.assertLess(max(steps), 1.17 * np.median(steps), "1.28 without fading, 1.08 with it")

    def test_exposureThatBreathes(self):
        """Each frame keeps the exposure that it has, in whichever window it is solved."""
        breath = 1 + 0.1 * np.sin(np.arange(30) * 0.9)[:, None, None, None]
        alpha = strokes(30, SIZE, SIZE, seed=2)
        writeSequence(self.folder, "breath.%04d.png", rained(self.ground, alpha, seed=2) * breath, "uint16")
        for window in ("8", "30"):
            self.extract("breath.%04d.png", "--window", window, "--linear", "--clean", "clean.####.exr")
            clean = self.images("clean.%04d.exr", range(1, 31))[..., :3]
            kept = clean.mean((1, 2, 3)) / (self.ground * breath).mean((1, 2, 3))
            self.assertLess(np.abs(kept - 1).max(), 0.02, window)

    def test_eightBitsComeBack(self):
        codes = np.round(255 * srgb(rained(self.ground, 0 * self.alpha[:6])))
        writeSequence(self.folder, "dry.%04d.png", codes / 255)
        report = self.extract("dry.%04d.png")
        self.assertFalse(report["rain"]["found"])
        self.assertEqual(np.abs(self.images("alpha.%04d.exr", range(1, 7))).max(), 0)
        clean = self.images("clean.%04d.exr", range(1, 7))[..., :3]
        np.testing.assert_array_equal(np.round(255 * srgb(clean)), codes)
        self.extract("dry.%04d.png", "--clean", "c.####.png")
        written = np.stack([readImage(self.folder / f"out/c.{n:04d}.png", "uint8")[0] for n in range(1, 7)])
        np.testing.assert_array_equal(written[..., :3], codes)

    def test_alphaOfTheFootagePasses(self):
        coverage = np.ones((6, SIZE, SIZE, 1))
        coverage[:, :20], coverage[2, 50:60, :30] = 0.5, 0.75
        writeSequence(self.folder, "rgba.%04d.exr", np.concatenate([self.rainy[:6] * coverage, coverage], -1), "half")
        self.extract("rgba.%04d.exr")
        clean = self.images("clean.%04d.exr", range(1, 7))
        self.assertEqual(self.spec("clean.0001.exr")[1], ("R", "G", "B", "A"))
        np.testing.assert_array_equal(clean[..., 3:], coverage)
        writeSequence(self.folder, "rgb.%04d.exr", self.rainy[:6], "half")
        self.extract("rgb.%04d.exr")
        self.assertEqual(self.spec("clean.0001.exr")[1], ("R", "G", "B"))

    def test_greyFootage(self):
        grey = self.rainy.mean(-1)
        writeSequence(self.folder, "grey.%04d.png", srgb(grey), "uint16")
        report = self.extract("grey.%04d.png")
        self.assertTrue(report["rain"]["found"])
        self.assertEqual(report["model"]["channels"], 1)
        self.assertLess(rmse(readImage(self.folder / "out/clean.exr")[0], self.ground.mean(-1)[..., None]), 0.01)

    def test_severalThreadsAreOne(self):
        self.extract(*self.STACK, "--threads", "1", out="one")
        self.extract(*self.STACK, "--threads", "3", out="three")
        for name in ("alpha.0005.exr", "clean.exr", "atlas.exr"):
            np.testing.assert_array_equal(*(readImage(self.folder / out / name)[0] for out in ("one", "three")))


class IntoRain(ExtractTest):
    """What was taken out goes back in."""

    @classmethod
    def makePlates(cls):
        super().makePlates()
        writeImage(cls.folder / "dry.exr", street(160, 90))
        plate = np.ones((180, 320, 4))
        plate[..., :3] = scene(180, 320)
        writeSequence(cls.folder, "plate.%04d.exr", [plate] * FRAMES, "half")

    def test_mattes(self):
        self.extract(*self.STACK)
        self.rain("dry.exr", "-o", "wet.exr", "--mattes", "out/atlas.exr", "--fog", "0", "--rate", "100")
        self.rain("dry.exr", "-o", "own.exr", "--fog", "0", "--rate", "100")
        dry, wet, own = (readImage(self.folder / name)[0] for name in ("dry.exr", "wet.exr", "own.exr"))
        self.assertGreater(np.abs(wet - dry).max(), 0.02)
        self.assertGreater(np.abs(wet - own).max(), 0.01)

    def test_match(self):
        self.rain("plate.%04d.exr", "-o", "wet.%04d.exr", "--rate", "60", "--wind", "2,0", "--exposure", "0.01", "--fog", "0",
                  "--darken", "0", "--desaturate", "0", "--splashes", "0", "--blur", "0", "--seed", "4")
        report = self.extract("wet.%04d.exr")
        rain, match = report["rain"], report["match"]
        self.assertIs(rain["found"], True)
        self.assertEqual(set(match), {"rate", "exposure", "opacity", "wind", "mattes", "env-gain", "fog-color"})
        self.assertEqual((match["rate"], match["exposure"]), (rain["rate_mm_h"], rain["exposure_s"]))
        low, high = rain["rate_range_mm_h"]
        self.assertTrue(low < 60 < high, rain)
        self.assertAlmostEqual(match["wind"][0], 2, delta=0.7)
        settings = self.rain("dry.exr", "-o", "again.exr", "--match", "out/report.json")["settings"]
        for name in ("rate", "exposure", "opacity"):
            self.assertAlmostEqual(settings[name], match[name], places=9)
        self.assertEqual(settings["mattes"], "out/atlas.exr")
        np.testing.assert_allclose(settings["wind"], match["wind"])
        # What is known of the shutter goes before what is estimated.
        self.assertEqual(self.extract("wet.%04d.exr", "--exposure", "0.01")["match"]["exposure"], 0.01)

    def test_noRainIsNoMatch(self):
        writeStack(self.folder / "dry.png", rained(self.ground, 0 * self.alpha))
        report = self.extract("dry.png", "--stack", FRAMES, "--linear")
        self.assertIsNone(report["match"])
        self.refused(3, ["out/report.json", "found no rain"], "rain", "dry.exr", "-o", "x.exr", "--match",
                     "out/report.json")


del ExtractTest  # only a base


if __name__ == "__main__":
    unittest.main()
