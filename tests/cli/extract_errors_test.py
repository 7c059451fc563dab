"""virga extract: footage and outputs that it refuses, and Ctrl-C."""
import json
import os
import signal
import time
import unittest

import numpy as np
from footage import FRAMES, SIZE, ExtractTest, rained, srgb, strokes, writeSequence
from support import CHATTER, makeMovie, probe, readImage, writeImage


class Inputs(ExtractTest):
    """Exit code 3."""

    @classmethod
    def makePlates(cls):
        super().makePlates()
        makeMovie(cls.folder / "clip.mp4", sound=False)
        writeSequence(cls.folder, "shot.%04d.png", srgb(cls.rainy[:6]))
        (cls.folder / "empty.png").touch()
        (cls.folder / "text.exr").write_text("no picture\n")
        (cls.folder / "empty").mkdir()

    def refusedFootage(self, words, *arguments):
        with self.subTest(footage=arguments):
            self.refused(3, words, "extract", "--quiet", *arguments, "-o", "out")

    def test_missing(self):
        for name in ("none.png", "none.mp4"):
            self.refusedFootage([name, "does not exist"], name)
        self.refusedFootage(["none/shot.%04d.exr", "folder none does not exist"], "none/shot.%04d.exr")
        self.refusedFootage(["empty/shot.%04d.exr", "no file matches"], "empty/shot.%04d.exr")
        self.refusedFootage(["empty", "folder"], "empty")
        self.refusedFootage(["no name"], "")
        self.refusedFootage(["empty.png", "empty"], "empty.png")
        self.refusedFootage(["text.exr", "not an image"], "text.exr")

    def test_stackThatDoesNotDivide(self):
        self.refusedFootage(["stack.png", f"{FRAMES * SIZE} rows", "7 frames"], "stack.png", "--stack", "7")
        self.refusedFootage(["shot.%04d.png", "one image, not a pattern"], "shot.%04d.png", "--stack", "2")

    def test_framesThatAreNotThere(self):
        self.refusedFootage(["7-9", "shot.%04d.png", "1-6"], "shot.%04d.png", "--frames", "4-9")
        self.refusedFootage(["12-20", "stack.png", "0-11"], *self.STACK, "--frames", "10-20")
        self.refused(2, ["25-30", "clip.mp4", "0-24"], "extract", "clip.mp4", "-o", "out", "--frames", "20-30")

    def damage(self, *numbers):
        for number in numbers:
            path = self.folder / f"bad.{number:04d}.png"
            path.write_bytes(path.read_bytes()[:600])

    def test_damagedFrame(self):
        writeSequence(self.folder, "bad.%04d.png", srgb(self.rainy))
        self.damage(5)
        self.refusedFootage(["bad.0005.png", "damaged or cut off"], "bad.%04d.png")
        report = self.extract("bad.%04d.png", "--on-error", "skip")
        self.assertEqual((report["footage"]["frames"], report["footage"]["frame_range"]), (11, "1-4,6-12"))
        self.assertEqual(report["repaired"]["frames"], ["frame 5 was skipped"])
        self.assertIn("bad.0005.png: is damaged", self.said)
        self.assertNotIn("alpha.0005.exr", self.names())
        report = self.extract("bad.%04d.png", "--on-error", "hold")
        self.assertEqual(report["footage"]["frames"], FRAMES)
        self.assertEqual(len(report["repaired"]["frames"]), 1)
        self.assertIn("held from frame 4", report["repaired"]["frames"][0])
        np.testing.assert_array_equal(*(readImage(self.folder / f"out/alpha.000{n}.exr")[0] for n in (4, 5)))

    def test_damagedFramesInWindows(self):
        """No more is left out than cannot be read, and each is told once in the report."""
        rainy = rained(self.ground, strokes(30, SIZE, SIZE, seed=2), seed=2)
        writeSequence(self.folder, "bad.%04d.png", srgb(rainy))
        self.damage(1, 2, 3, 4, 17)
        report = self.extract("bad.%04d.png", "--on-error", "skip", "--window", "8", "--clean", "none")
        self.assertEqual(report["footage"]["frame_range"], "5-16,18-30")
        self.assertEqual(sorted(report["repaired"]["frames"]), sorted(f"frame {n} was skipped" for n in (1, 2, 3, 4, 17)))
        self.assertEqual(len([n for n in self.names() if n.startswith("alpha")]), 25)

    def test_noFrameCanBeRead(self):
        writeSequence(self.folder, "bad.%04d.png", srgb(self.rainy[:3]))
        self.damage(1, 2, 3)
        for path in self.folder.glob("bad.*"):
            if path.stat().st_size > 600:
                path.unlink()
        run = self.virga("extract", "bad.%04d.png", "-o", "out", "--on-error", "skip")
        self.assertEqual(run.code, 3, run)
        self.assertNotRegex(run.err, CHATTER, run)

    def test_framesOfTwoSizes(self):
        writeSequence(self.folder, "two.%04d.png", srgb(self.rainy[:4]))
        writeImage(self.folder / "two.0003.png", srgb(self.rainy[0, :48]), "uint8")
        self.refusedFootage(["two.0003.png"], "two.%04d.png")


class Outputs(ExtractTest):
    """Exit code 5, before there is work to lose."""

    def refusedOutput(self, words, *arguments):
        with self.subTest(arguments=arguments):
            self.refused(5, words, "extract", "--quiet", *arguments)

    def test_folder(self):
        self.refusedOutput(["'no/such'", "cannot be made"], *self.STACK, "-o", "no/such")
        self.refusedOutput(["'stack.png'", "file, not a folder"], *self.STACK, "-o", "stack.png")
        self.refusedOutput(["'stack.png/in'", "cannot be made"], *self.STACK, "-o", "stack.png/in")
        self.refusedOutput(["cannot be made"], *self.STACK, "-o", "")

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_folderThatCannotBeWrittenTo(self):
        (self.folder / "shut").mkdir()
        (self.folder / "shut").chmod(0o555)
        self.refusedOutput(["shut"], *self.STACK, "-o", "shut")
        (self.folder / "shut").chmod(0o755)
        (self.folder / "shut").rmdir()

    def test_namesOfTheCleanFootage(self):
        for name, words in (("x.####.txt", [".txt", "no format"]), ("none/x.mov", ["out/none does not exist"]),
                            ("one.exr", ["one image", "12 frames"]), ("a.%04d.%04d.exr", ["two places"]),
                            *((taken, ["taken"]) for taken in ("alpha.####.exr", "alpha.%04d.exr", "confidence.####.exr",
                                                               "clean.exr", "confidence.exr", "atlas.exr", "sheet.png"))):
            self.refusedOutput(["--clean" if words == ["taken"] else name, *words], *self.STACK, "-o", "out", "--clean", name)

    def test_footageIsNotOverwritten(self):
        self.extract(*self.STACK, "--confidence")
        for name in ("alpha.####.exr", "alpha.%04d.exr", "confidence.%04d.exr", "clean.####.exr", "clean.exr",
                     "confidence.exr", "sheet.png", "atlas.exr"):
            self.refusedOutput([name.split(".")[0], "itself"], "out/" + name, "-o", "out")
        self.refusedOutput(["sheet.png", "itself"], "./out/sheet.png", "-o", self.path("out"))

    def test_aFolderThatIsThereIsWrittenInto(self):
        (self.folder / "there").mkdir()
        (self.folder / "there/note.txt").write_text("mine")
        self.succeeds("extract", *self.STACK, "-o", "there/")
        self.assertEqual((self.folder / "there/note.txt").read_text(), "mine")
        self.succeeds("extract", *self.STACK, "-o", "there", "--iterations", "1")  # and over what it left


class Interrupts(ExtractTest):
    """Ctrl-C while windows are solved."""

    def interrupted(self, how, *arguments):
        rainy = rained(self.ground, strokes(60, SIZE, SIZE, seed=3), seed=3)
        writeSequence(self.folder, "long.%04d.png", srgb(rainy))
        # Enough rounds that a window takes a while on any machine.
        process = self.start("extract", "--json", "long.%04d.png", "-o", "out", "--window", "6", "--iterations", "60",
                             "--tolerance", "1e-7", *arguments)
        deadline = time.monotonic() + 100
        while process.poll() is None and time.monotonic() < deadline:
            if any((self.folder / "out").glob("alpha.*.exr")):
                break
            time.sleep(0.02)
        self.assertIsNone(process.poll(), "it was over before the signal came")
        process.send_signal(how)
        out, said = process.communicate(timeout=120)
        return process.returncode, out.decode(), said.decode()

    def test_whatIsWrittenIsWhole(self):
        code, out, said = self.interrupted(signal.SIGINT, "--clean", "clean.mkv")
        self.assertEqual(code, 130, said)
        self.assertIn("stopped on request", said)
        self.assertNotRegex(said, CHATTER)
        report = json.loads((self.folder / "out/report.json").read_text())
        self.assertEqual(json.loads(out), report)
        self.assertTrue(report["stopped"])
        count = report["footage"]["frames"]
        self.assertTrue(0 < count < 60, count)
        alphas = sorted(n for n in self.names() if n.startswith("alpha"))
        # Mattes go out a few at a time; those beyond the last that counts are whole as well.
        self.assertEqual(alphas[:count], [f"alpha.{n:04d}.exr" for n in range(1, count + 1)])
        for name in alphas:
            self.assertTrue(np.isfinite(readImage(self.folder / "out" / name)[0]).all())
        self.assertEqual(int(probe(self.folder / "out/clean.mkv")["nb_read_frames"]), count)
        self.assertEqual(self.spec("clean.exr")[0], (SIZE, SIZE))
        self.assertEqual(self.leftovers(), [])


del ExtractTest  # only a base


if __name__ == "__main__":
    unittest.main()
