"""Sequences of images: folders, single frames, holes, and going on with what is there (--resume)."""
import shutil
import time
import unittest

import numpy as np
from support import CHEAP, OFF, CliTest, bits, readImage, street, writeImage

FRAMES = (-2, -1, 0, 1, 2, 4, 5, 8)  # 3, 6 and 7 are missing


def shade(path):
    return float(readImage(path)[0][..., 0].mean())


class Sequences(CliTest):
    @classmethod
    def makePlates(cls):
        (cls.folder / "seq").mkdir()
        for frame in FRAMES:
            name = f"s.{frame:04d}.exr"
            writeImage(cls.folder / "seq" / name, np.full((16, 24, 3), 0.5 + 0.01 * frame, np.float32), "float")
        (cls.folder / "seq/.s.0009.exr.partial").write_bytes(b"half of a frame")
        (cls.folder / "seq/notes.txt").write_text("for the client")

    def setUp(self):
        self.out = self.folder / "out"
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()

    def written(self):
        return sorted(int(path.name.split(".")[1]) for path in self.out.glob("*.exr"))

    def render(self, *arguments):
        return self.rain(*arguments, *OFF, "-o", "out/o.%04d.exr")

    def test_holesStop(self):
        for plate in ("seq/s.%04d.exr", "seq/s.####.exr", "seq"):
            self.refused(3, ["frames 3,6-7 are missing", "s.", "-2-2,4-5,8", "--on-error skip or hold"], "rain", plate, "-o",
                         "out/o.%04d.exr", *OFF)

    def test_holesThatNobodyAskedFor(self):
        self.assertEqual(self.render("seq/s.%04d.exr", "--frames", "-2-2")["frame_range"], "-2-2")
        self.assertEqual(self.written(), [-2, -1, 0, 1, 2])

    def test_holesAreSkipped(self):
        report = self.render("seq", "--on-error", "skip")
        self.assertEqual(report["frames"], len(FRAMES))
        self.assertEqual(self.written(), list(FRAMES))
        self.assertEqual(report["repaired"]["frames"], [f"frame {n} was skipped" for n in (3, 6, 7)])

    def test_holesAreFilled(self):
        self.render("seq", "--on-error", "hold")
        self.assertEqual(self.written(), list(range(-2, 9)))
        for frame, held in ((3, 2), (6, 5), (7, 5), (8, 8), (-2, -2)):
            self.assertAlmostEqual(shade(self.out / f"o.{frame:04d}.exr"), 0.5 + 0.01 * held, places=5)

    def test_eachHoleIsNamedOnce(self):
        for word in ("skip", "hold"):
            run = self.succeeds("rain", "seq", "-o", "out/o.%04d.exr", *OFF, "--on-error", word)
            for frame in (3, 6, 7):
                self.assertEqual(run.err.count(f"s.{frame:04d}.exr"), 1, run)

    def test_rangesAndOrder(self):
        self.render("seq", "--frames", "8,-2--1 2-0x-2")
        self.assertEqual(self.written(), [-2, -1, 0, 2, 8])

    def test_oneFrameKeepsItsNumber(self):
        report = self.render("seq/s.0005.exr")
        self.assertEqual((report["frame_range"], self.written()), ("5", [5]))
        report = self.render("seq/s.-002.exr")
        self.assertEqual((report["frame_range"], self.written()), ("-2", [-2, 5]))

    def test_foldersThatAreNoPlate(self):
        (self.folder / "two").mkdir(exist_ok=True)
        for name in ("a.0001.png", "a.0002.png", "b.0001.png", "b.0002.png"):
            writeImage(self.folder / "two" / name, street(8, 8)[..., :3], "uint8")
        (self.folder / "none").mkdir(exist_ok=True)
        self.refused(3, ["two", "a.%04d.png, b.%04d.png"], "rain", "two", "-o", "out/o.%04d.exr")
        self.refused(3, ["none", "without images"], "rain", "none", "-o", "out/o.%04d.exr")


class Layers(CliTest):
    """Which channels of an EXR are the plate, and what is said of the others."""

    @classmethod
    def makePlates(cls):
        def write(name, *channels):
            values = np.stack([np.full((8, 12), value, np.float32) for _, value in channels], -1)
            writeImage(cls.folder / name, values, "half", [channel for channel, _ in channels])
        rgb = lambda layer, base: [(f"{layer}.{c}", base + 0.125 * i) for i, c in enumerate("RGB")]
        write("two.exr", ("Z", 7), *rgb("diffuse", 0.125), *rgb("spec", 1))
        write("one.exr", ("Z", 7), *rgb("diffuse", 0.125), ("diffuse.A", 0.5))
        write("render.exr", *rgb("ViewLayer.Combined", 0.25), *rgb("ViewLayer.Diffuse", 1))
        write("plain.exr", ("A", 1), ("B", 0.5), ("G", 0.375), ("R", 0.25), ("Z", 7), *rgb("spec", 1))
        write("data.exr", ("u", 1), ("v", 2), ("w", 3))

    def colours(self, name, *arguments):
        """The picture alone, as TIFF has no other channels, and what is said."""
        run = self.succeeds("rain", name, "-o", "out.tif", *OFF, *arguments)
        image, names = readImage(self.folder / "out.tif")
        return dict(zip(names, image[0, 0].tolist())), run.err

    def test_layers(self):
        self.assertEqual(self.colours("two.exr", "--layer", "spec")[0], {"R": 1, "G": 1.125, "B": 1.25})
        self.assertEqual(self.colours("two.exr", "--layer", "diffuse")[0], {"R": 0.125, "G": 0.25, "B": 0.375})
        self.assertEqual(self.colours("one.exr")[0], {"R": 0.125, "G": 0.25, "B": 0.375, "A": 0.5})
        self.assertEqual(self.colours("render.exr")[0], {"R": 0.25, "G": 0.375, "B": 0.5})
        found, said = self.colours("plain.exr")
        self.assertEqual(found, {"R": 0.25, "G": 0.375, "B": 0.5, "A": 1})
        self.assertRegex(said, r"out\.tif: holds the picture alone; left out of it are Z, spec\.\w, spec\.\w, spec\.\w")

    def test_whatHasToBeChosen(self):
        rain = ["rain", "--quiet", "-o", "out2.exr", *OFF]
        self.refused(3, ["two.exr", "diffuse", "spec", "--layer"], *rain, "two.exr")
        self.refused(3, ["two.exr", "no layer 'glow'", "diffuse", "spec"], *rain, "two.exr", "--layer", "glow")
        self.refused(3, ["data.exr", "holds no colours", "u, v, w"], *rain, "data.exr")


class Resume(CliTest):
    @classmethod
    def makePlates(cls):
        for frame in range(1, 6):
            writeImage(cls.folder / f"p.{frame:04d}.exr", street(64, 36, seed=frame), "half")
        writeImage(cls.folder / "z.exr", np.full((36, 64, 1), 20, np.float32), "float", ["Z"])

    def setUp(self):
        for path in self.folder.glob("o.*"):
            path.unlink()

    def render(self, *arguments, output="o.%04d.exr"):
        return self.rain("p.%04d.exr", "-o", output, "--rate", "50", *arguments)

    def stamps(self):
        return {path.name: path.stat().st_mtime_ns for path in sorted(self.folder.glob("o.*"))}

    def test_whatIsThereStays(self):
        self.render("--frames", "1-3")
        before, once = self.stamps(), bits(self.folder / "o.0002.exr")
        report = self.render("--resume")
        self.assertEqual((report["kept_frames"], report["frames"], report["frame_range"]), (3, 2, "4-5"))
        self.assertEqual({n: t for n, t in self.stamps().items() if n in before}, before)
        # All at once is the same picture.
        after = bits(self.folder / "o.0005.exr")
        self.render()
        for frame, words in ((2, once), (5, after)):
            np.testing.assert_array_equal(bits(self.folder / f"o.{frame:04d}.exr")[2], words[2])
        report = self.render("--resume")
        self.assertEqual((report["kept_frames"], report["frames"]), (5, 0))

    def test_otherSettingsOrFiles(self):
        self.render("--depth", "z.exr")
        for flags in (["--seed", "2"], ["--wind", "1,0"], ["--float"], ["--layers"], ["--codec", "piz"]):
            with self.subTest(flags=flags):
                self.assertEqual(self.render("--depth", "z.exr", "--resume", *flags)["kept_frames"], 0)
                self.render("--depth", "z.exr")
        self.assertEqual(self.render("--depth", "z.exr", "--resume", "--on-error", "hold")["kept_frames"], 5)
        time.sleep(0.01)
        writeImage(self.folder / "z.exr", np.full((36, 64, 1), 21, np.float32), "float", ["Z"])
        self.assertEqual(self.render("--depth", "z.exr", "--resume")["kept_frames"], 0)
        # Frame 2 is none of those that the light is made from with --env-frames 1, which is the middle one.
        self.render("--env-frames", "1")
        time.sleep(0.01)
        writeImage(self.folder / "p.0002.exr", street(64, 36, seed=2), "half")
        self.assertEqual(self.render("--env-frames", "1", "--resume")["frame_range"], "2")
        writeImage(self.folder / "p.0003.exr", street(64, 36, seed=3), "half")
        self.assertEqual(self.render("--env-frames", "1", "--resume")["kept_frames"], 0)

    def test_halfAFile(self):
        for name in ("o.%04d.exr", "o.%04d.png", "o.%04d.tif", "o.%04d.dpx"):
            with self.subTest(name=name):
                self.render(output=name)
                broken = self.folder / (name % 3)
                broken.write_bytes(broken.read_bytes()[:-400])
                report = self.render("--resume", output=name)
                self.assertEqual(report["frame_range"], "3")
                self.assertEqual(self.render("--resume", output=name)["kept_frames"], 5)

    def test_whereNothingCanBeKept(self):
        self.refused(2, ["--resume", "out.mkv"], "rain", "--quiet", "p.%04d.exr", "-o", "out.mkv", "--resume")
        self.refused(2, ["--resume", "o.%04d.webp", "EXR"], "rain", "--quiet", "p.%04d.exr", "-o", "o.%04d.webp", "--resume")


if __name__ == "__main__":
    unittest.main()
