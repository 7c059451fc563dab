"""Exit code 3: plates, depth, panoramas, mattes, tracks and stills that are missing, damaged or of the wrong kind; and
input that is odd but can be worked with, which the report then says."""
import unittest

import numpy as np
from support import CHEAP, HEIGHT, OFF, WIDTH, CliTest, makeMovie, readImage, street, writeImage


class InputTest(CliTest):
    @classmethod
    def makePlates(cls):
        folder = cls.folder
        for frame in range(1, 4):
            writeImage(folder / f"shot.{frame:04d}.exr", street(seed=frame))
        (folder / "empty.exr").touch()
        (folder / "cut.exr").write_bytes((folder / "shot.0001.exr").read_bytes()[:3000])
        (folder / "text.exr").write_text("not a picture\n")
        (folder / "folder").mkdir()

    def refusedShot(self, words, *arguments):
        self.refused(3, words, "rain", "--quiet", "shot.%04d.exr", "-o", "out.%04d.exr", *arguments)

    def rainShot(self, *arguments):
        return self.rain("shot.%04d.exr", "-o", "out.%04d.exr", *arguments)

    def refusedFiles(self, flag):
        """What no flag that names an image file accepts."""
        for name, words in (("none.exr", []), ("empty.exr", ["empty"]), ("cut.exr", ["damaged or cut off"]),
                            ("text.exr", ["not an image"]), ("folder", ["folder"])):
            with self.subTest(file=name):
                self.refusedShot([name, *words], flag, name)


class Plates(InputTest):
    @classmethod
    def makePlates(cls):
        super().makePlates()
        folder = cls.folder
        makeMovie(folder / "clip.mp4")
        movie = (folder / "clip.mp4").read_bytes()
        (folder / "cut.mp4").write_bytes(movie[: len(movie) // 2])
        (folder / "empty.mp4").touch()
        (folder / "text.mp4").write_text("not a movie\n")
        writeImage(folder / "still.png", street()[..., :3], "uint8")
        (folder / "cut.png").write_bytes((folder / "still.png").read_bytes()[:600])

    def refusedPlate(self, plate, *words):
        with self.subTest(plate=plate):
            self.refused(3, [plate, *words], "rain", "--quiet", plate, "-o", "out.mp4")

    def test_missing(self):
        for plate in ("none.mp4", "none.exr", "none/shot.%04d.exr"):
            self.refusedPlate(plate, "does not exist")
        self.refusedPlate("none.%04d.exr", "no file matches")
        self.refusedPlate("", "no name")

    def test_empty(self):
        for plate in ("empty.mp4", "empty.exr"):
            self.refusedPlate(plate, "empty")

    def test_truncated(self):
        self.refusedPlate("cut.mp4")
        self.refusedPlate("cut.exr", "damaged or cut off")

    def test_truncatedPng(self):
        self.refused(3, ["cut.png", "damaged or cut off"], "rain", "--quiet", "cut.png", "-o", "out.mp4")

    def test_folder(self):
        self.refusedPlate("folder", "folder")

    def test_textUnderAMoviesName(self):
        self.refusedPlate("text.mp4", "not a movie")
        self.refusedPlate("text.exr", "not an image")

    def test_framesOutsideTheSequence(self):
        self.refused(3, ["frames 4-5 are missing", "shot.%04d.exr", "1-3", "--on-error"], "rain", "shot.%04d.exr", "-o", "out.%04d.exr",
                     "--frames", "2-5")

    def test_damagedFrame(self):
        plate = self.folder / "shot.0002.exr"
        whole = plate.read_bytes()
        try:
            plate.write_bytes(whole[:3000])
            run = self.virga("rain", "--quiet", "shot.%04d.exr", "-o", "stop.%04d.exr", *CHEAP)
            self.assertEqual(run.code, 3, run)
            self.assertEqual(len(run.lines), 1, run)
            self.assertIn("shot.0002.exr", run.err)
            self.assertFalse((self.folder / "stop.0002.exr").exists())
            self.assertEqual(self.leftovers(), [])

            report = self.rain("shot.%04d.exr", "-o", "skip.%04d.exr", "--on-error", "skip", *CHEAP)
            self.assertEqual((report["frames"], report["frame_range"]), (2, "1,3"))
            self.assertIn("2", " ".join(report["repaired"]["frames"]))
            self.assertFalse((self.folder / "skip.0002.exr").exists())

            report = self.rain("shot.%04d.exr", "-o", "hold.%04d.exr", "--on-error", "hold", *CHEAP)
            self.assertEqual(report["frames"], 3)
            self.assertIn("2", " ".join(report["repaired"]["frames"]))
            self.assertTrue((self.folder / "hold.0002.exr").exists())
        finally:
            plate.write_bytes(whole)

    def test_nanInfAndHugePixels(self):
        pixels = street()
        pixels[3, 4, 1], pixels[5, 6, 0], pixels[7, 8, 2] = np.nan, np.inf, -np.inf
        pixels[30, 10, :3] = 1e6
        writeImage(self.folder / "odd.exr", pixels, "float")
        report = self.rain("odd.exr", "-o", "odd_rain.exr", "--blur", "2", "--splashes", "0")
        self.assertEqual(report["repaired"]["plate_values"], 3)
        rained, _ = readImage(self.folder / "odd_rain.exr")
        self.assertTrue(np.isfinite(rained).all())
        # And where nothing is done, nothing is repaired.
        report = self.rain("odd.exr", "-o", "odd_off.exr", *OFF)
        self.assertEqual(report["repaired"]["plate_values"], 0)
        off, _ = readImage(self.folder / "odd_off.exr")
        np.testing.assert_array_equal(off, pixels)

    def test_nameThatIsNotUtf8(self):
        name = b"stra\xdfe.exr"
        (self.folder / "shot.0001.exr").rename(self.folder / "keep")
        try:
            with open(bytes(self.folder) + b"/" + name, "wb") as copy:
                copy.write((self.folder / "keep").read_bytes())
            report = self.rain(name.decode(errors="surrogateescape"), "-o", "out.exr", *OFF)
            self.assertIn("stra", report["plate"]["path"])
        finally:
            (self.folder / "keep").rename(self.folder / "shot.0001.exr")


class Depth(InputTest):
    @classmethod
    def makePlates(cls):
        super().makePlates()
        folder = cls.folder
        metres = np.full((HEIGHT, WIDTH), 20.0)
        writeImage(folder / "depth.exr", metres, channels=["Z"])
        writeImage(folder / "small.exr", metres[::2, ::2], channels=["Z"])
        writeImage(folder / "nan.exr", metres * np.nan, channels=["Z"])
        writeImage(folder / "zero.exr", metres * 0, channels=["Z"])
        writeImage(folder / "sky.exr", metres * np.inf, channels=["Z"])
        holes = metres.copy()
        holes[:5], holes[5:8], holes[8:12] = np.nan, -1, np.inf
        writeImage(folder / "holes.exr", holes, channels=["Z"])
        writeImage(folder / "picture.jpg", street()[..., :3], "uint8")
        for frame in (1, 3):
            writeImage(folder / f"z.{frame:04d}.exr", metres, channels=["Z"])

    def test_files(self):
        self.refusedFiles("--depth")
        self.refusedShot(["none.%04d.exr", "no frame"], "--depth", "none.%04d.exr")

    def test_noPixelIsADepth(self):
        for name in ("nan.exr", "zero.exr"):
            self.refusedShot([name, f"{WIDTH * HEIGHT} pixels"], "--depth", name)

    def test_anotherSizeWorksAndIsSaid(self):
        run = self.succeeds("rain", "--json", "shot.%04d.exr", "-o", "out.%04d.exr", "--depth", "small.exr")
        self.assertTrue(run.report["repaired"]["depth_resampled"])
        said = [line for line in run.lines if "small.exr" in line]
        self.assertEqual(len(said), 1, run)
        for words in (f"{WIDTH // 2}x{HEIGHT // 2}", f"{WIDTH}x{HEIGHT}", "resampled"):
            self.assertIn(words, said[0])
        self.assertFalse(self.rainShot("--depth", "depth.exr")["repaired"]["depth_resampled"])

    def test_holesAreCounted(self):
        repaired = self.rainShot("--depth", "holes.exr")["repaired"]
        self.assertEqual(repaired["depth_pixels"], 8 * WIDTH)
        self.assertEqual(repaired["depth_nan"] + repaired["depth_non_positive"] + repaired["depth_no_value"], 8 * WIDTH)

    def test_allSky(self):
        repaired = self.rainShot("--depth", "sky.exr")["repaired"]
        self.assertEqual(repaired["depth_pixels"], 0)
        self.assertGreater(repaired["depth_infinite"], 0)

    def test_pictureInsteadOfDepth(self):
        run = self.succeeds("rain", "shot.%04d.exr", "-o", "out.%04d.exr", "--depth", "picture.jpg")
        self.assertIn("'picture.jpg' has 8 bits", run.err)
        self.assertIn("no channel Z", run.err)

    def test_missingFrameIsFoundBeforeTheFirstIsRendered(self):
        self.refusedShot(["z.%04d.exr", "frame 2 is missing", "there are 1,3"], "--depth", "z.%04d.exr")

    def test_missingFrameIsSkippedOrHeld(self):
        report = self.rainShot("--depth", "z.%04d.exr", "--on-error", "skip")
        self.assertEqual(report["frame_range"], "1,3")
        self.assertIn("z.0002.exr", report["repaired"]["frames"][0])
        run = self.succeeds("rain", "--json", "shot.%04d.exr", "-o", "out.%04d.exr", "--depth", "z.%04d.exr", "--on-error",
                            "hold", "--preview", "sheet.png")
        self.assertEqual(run.report["frames"], 3)
        self.assertIn("held from frame 1", run.err)

    def test_missingFrameThatNobodyLooksAt(self):
        self.assertEqual(self.rainShot("--depth", "z.%04d.exr", *OFF)["frames"], 3)


class Light(InputTest):
    @classmethod
    def makePlates(cls):
        super().makePlates()
        random = np.random.default_rng(1)
        for name, height, width in (("good", 32, 64), ("band", 32, 96), ("dot", 1, 1), ("photo", 36, 64)):
            writeImage(cls.folder / f"{name}.exr", random.uniform(0.2, 1, (height, width, 3)))
        writeImage(cls.folder / "nan.exr", np.full((32, 64, 3), np.nan))
        writeImage(cls.folder / "white.jpg", np.ones((32, 64, 3)), "uint8")

    def test_files(self):
        self.refusedFiles("--env")

    def test_noPixelIsANumber(self):
        self.refusedShot(["nan.exr", "2048 pixels"], "--env", "nan.exr")

    def test_photograph(self):
        self.refusedShot(["photo.exr", "64 x 36", "twice as wide as high"], "--env", "photo.exr")

    def test_bandAroundTheHorizon(self):
        run = self.succeeds("rain", "shot.%04d.exr", "-o", "out.%04d.exr", "--env", "band.exr")
        self.assertIn("96 x 32", run.err)
        self.assertIn("band", run.err)

    def test_onePixelIsLightFromEverywhere(self):
        self.assertEqual(self.rainShot("--env", "dot.exr")["light"]["source"], "dot.exr")

    def test_good(self):
        for name in ("good.exr", "white.jpg"):
            self.assertEqual(self.rainShot("--env", name)["light"]["source"], name)


class Others(InputTest):
    """Mattes, tracks, stills."""

    def test_mattes(self):
        self.refusedFiles("--mattes")
        self.refusedShot(["none.%04d.exr"], "--mattes", "none.%04d.exr")
        writeImage(self.folder / "odd.exr", np.zeros((30, 30)), channels=["A"])
        self.refusedShot(["odd.exr", "30x30", "16x64"], "--mattes", "odd.exr")
        writeImage(self.folder / "nan.exr", np.full((64, 16), np.nan), channels=["A"])
        self.refusedShot(["nan.exr", "not finite"], "--mattes", "nan.exr")

    def test_gradeFrom(self):
        self.refusedFiles("--grade-from")
        writeImage(self.folder / "nan.exr", np.full((8, 8, 3), np.nan))
        self.refusedShot(["nan.exr", "no finite pixel"], "--grade-from", "nan.exr")

    def test_lights(self):
        self.refusedShot(["none.toml", "no such file"], "--lights", "none.toml")
        for text, words in (("[[light]\n", ["line 1"]), ("[[light]]\npositoin = [0, 1, 2]\n", ["line 2", "did you mean 'position'"]),
                            ("[[light]]\nposition = [0, nan, 2]\n", ["line 2", "'position'", "nan"]),
                            ("[[light]]\nposition = [0, 1, 2]\n", ["line 1", "'intensity'"])):
            with self.subTest(text=text):
                (self.folder / "bad.toml").write_text(text)
                self.refusedShot(["bad.toml", *words], "--lights", "bad.toml")

    def test_camera(self):
        self.refusedShot(["none.chan"], "--camera", "none.chan")
        for text, words in (("", ["no frame"]), ("# nothing\n", ["no frame"]), ("1 0 0 0 0 0\n", ["line 1", "6 numbers"]),
                            ("1 0 0 0 0 0 0\n2 0 0 abc 0 0 0\n", ["line 2", "'abc'"]), ("1 0 0 0 0 0 nan\n", ["'nan'"]),
                            ("1 0 0 0 0 0 0 0\n", ["0 deg"])):
            with self.subTest(text=text):
                (self.folder / "bad.chan").write_text(text)
                self.refusedShot(["bad.chan", *words], "--camera", "bad.chan")

    def test_cameraUnderTheGround(self):
        (self.folder / "sinks.chan").write_text("1 0 0 0 0 0 0\n3 0 -9 0 0 0 0\n")
        run = self.virga("rain", "--quiet", "shot.%04d.exr", "-o", "sunk.%04d.exr", "--camera", "sinks.chan", "--ground",
                         "1.5")
        self.assertEqual(run.code, 3, run)
        self.assertEqual(len(run.lines), 1, run)
        self.assertIn("frame 2", run.err)
        self.assertEqual(self.leftovers(), [])


del InputTest  # only a base


if __name__ == "__main__":
    unittest.main()
