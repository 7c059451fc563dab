"""Exit code 5: folders, formats, names. Everything is checked before the first frame is rendered.

Permissions are no obstacle to root, so folders that cannot be written to are ones that nobody can write to: a path below
a file, /proc, and /dev/full for standard output."""
import os
import subprocess
import unittest

from support import CHEAP, OFF, VIRGA, CliTest, makeMovie, street, writeImage


def decoded(path):
    """The pictures' checksums: files of one run may differ from another's in what a container says of its making."""
    return subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-an", "-f", "framemd5", "-"], check=True, capture_output=True,
                          timeout=60).stdout


class Outputs(CliTest):
    @classmethod
    def makePlates(cls):
        makeMovie(cls.folder / "clip.mp4")
        writeImage(cls.folder / "still.png", street()[..., :3], "uint8")
        for frame in range(1, 4):
            writeImage(cls.folder / f"shot.{frame:04d}.exr", street(seed=frame))
        (cls.folder / "folder").mkdir()
        (cls.folder / "link.mp4").symlink_to("clip.mp4")

    def refusedOutput(self, output, *words, plate="clip.mp4"):
        with self.subTest(output=output):
            self.refused(5, [output, *words], "rain", "--quiet", plate, "-o", output)

    def test_folder(self):
        self.refusedOutput("none/out.mp4", "the folder none does not exist")
        self.refusedOutput("none/out.%04d.exr", "the folder none does not exist")
        self.refusedOutput("still.png/out.mp4", "still.png is not a folder")
        self.refusedOutput("folder", "is a folder")

    def test_folderThatCannotBeWrittenTo(self):
        self.refusedOutput("/proc/out.mp4")
        self.refused(5, "/proc/out.0000.exr", "rain", "--quiet", "clip.mp4", "-o", "/proc/out.%04d.exr", "--frames", "0",
                     *OFF)

    def test_format(self):
        self.refusedOutput("out.xyz", "'.xyz'", ".exr", ".mp4")
        self.refusedOutput("out", ".exr", ".mp4")
        self.refusedOutput("out.wav", "'.wav'")

    def test_gif(self):
        self.refused(5, "out.gif", "rain", "--quiet", "still.png", "-o", "out.gif", *OFF)

    def test_noName(self):
        self.refusedOutput("", "no name")

    def test_oneImageForManyFrames(self):
        self.refusedOutput("out.exr", "25 frames", "%04d")

    def test_outputIsThePlate(self):
        for output in ("clip.mp4", "./clip.mp4", "link.mp4"):
            self.refusedOutput(output, "is the plate itself")
        self.refusedOutput("still.png", "is the plate itself", plate="still.png")
        for output in ("shot.####.exr", "./shot.%04d.exr"):
            self.refusedOutput(output, "of the plate itself", plate="shot.%04d.exr")
        self.refused(5, ["shot.0002.exr", "of the plate itself"], "rain", "--quiet", "shot.%04d.exr", "--frames", "2", "-o",
                     "shot.0002.exr")

    def test_outputIsAnotherInput(self):
        for frame in range(1, 4):
            writeImage(self.folder / f"z.{frame:04d}.exr", street()[..., :1] + 5, "float", ["Z"])
        (self.folder / "look.exr").symlink_to("z.0002.exr")
        plate = ["rain", "--quiet", "shot.%04d.exr"]
        self.refused(5, ["z.0001.exr", "--depth"], *plate, "-o", "z.####.exr", "--depth", "z.%04d.exr")
        self.refused(5, ["look.exr", "--depth"], *plate, "--frames", "2", "-o", "look.exr", "--depth", "z.%04d.exr")
        for flag in ("--env", "--mattes", "--grade-from", "--lights", "--camera"):
            self.refused(5, ["still.png", flag], *plate, "--frames", "2", "-o", "still.png", flag, "still.png")
        self.refused(5, ["still.png", "--env"], *plate, "--frames", "2", "-o", "out.png", "--env", "./still.png", "--preview",
                     "still.png")

    def test_preview(self):
        for preview, words in (("none/sheet.png", "the folder none does not exist"), ("still.png/sheet.png", "not a folder"),
                               ("sheet.mp4", ".png"), ("folder", "is a folder")):
            with self.subTest(preview=preview):
                self.refused(5, [preview, words], "rain", "--quiet", "clip.mp4", "-o", "out.mp4", "--preview", preview)
        self.refused(5, "plate itself", "rain", "--quiet", "still.png", "-o", "out.png", "--preview", "./still.png")
        self.refused(5, "output itself", "rain", "--quiet", "still.png", "-o", "out.png", "--preview", "out.png")

    def test_saveSettings(self):
        self.refused(5, "none/look.toml", "rain", "still.png", "-o", "out.png", "--save-settings", "none/look.toml")
        self.refused(5, "plate itself", "rain", "still.png", "-o", "out.png", "--save-settings", "still.png")

    def test_fullStandardOutput(self):
        with open("/dev/full", "w") as full:
            done = subprocess.run([VIRGA, "rain", "--quiet", "--json", "still.png", "-o", "out.png", *OFF], cwd=self.folder,
                                  stdout=full, stderr=subprocess.PIPE, text=True)
        self.assertEqual((done.returncode, done.stderr), (5, "virga: standard output: cannot be written to\n"))

    def test_pipesAndDevices(self):
        os.mkfifo(self.folder / "pipe.mkv")
        self.refusedOutput("pipe.mkv", "is a pipe or a device", "-o -")
        os.remove(self.folder / "pipe.mkv")

    def test_namesWithColons(self):
        """What stands before a colon is no protocol of FFmpeg's."""
        self.succeeds("rain", "clip.mp4", "-o", "take:2.mp4", *OFF, "--reencode", "--frames", "0-3")
        self.succeeds("rain", "take:2.mp4", "-o", "http:3.mkv", *OFF, "--frames", "0-3")
        self.assertEqual(self.leftovers(), [])
        self.refused(3, "does not exist", "rain", "http://localhost:1/clip.mp4", "-o", "no.mp4")

    def test_twoRunsToOneOutput(self):
        """Each ends well, and what lies there is whole and one run's."""
        for name in ("two.mkv", "two.mp4", "two.png"):
            with self.subTest(output=name):
                runs = [["rain", "--quiet", "clip.mp4", "-o", name, "--frames", "3" if ".png" in name else "0-11", "--seed", str(seed), "--rate",
                         "100", *CHEAP, "--threads", "1"] for seed in (1, 2, 3)]
                alone = []
                for run in runs:
                    self.succeeds(*run)
                    alone.append(decoded(self.folder / name))
                self.assertEqual(len(set(alone)), 3)
                os.remove(self.folder / name)
                for process in [self.start(*run) for run in runs]:
                    out, err = process.communicate(timeout=120)
                    self.assertEqual((process.returncode, out, err), (0, b"", b""))
                self.assertIn(decoded(self.folder / name), alone)
                self.assertEqual(self.leftovers(), [])

    def test_whatAKilledRunLeft(self):
        """Half an image is removed; half a movie, which plays, is named and stays until a whole one is there."""
        (self.folder / ".cut.0003.partial-host-1-0.exr").write_text("half of a frame")
        (self.folder / ".cut.partial-host-1-0.mkv").write_text("half of a movie")
        run = self.succeeds("rain", "shot.%04d.exr", "-o", "cut.%04d.exr", "--frames", "1", *OFF)
        self.assertIn(".cut.0003.partial-host-1-0.exr", run.err)
        self.assertEqual(self.leftovers(), [self.path(".cut.partial-host-1-0.mkv")])
        run = self.virga("rain", "clip.mp4", "-o", "cut.mkv", "--env", "none.exr")
        self.assertEqual(self.leftovers(), [self.path(".cut.partial-host-1-0.mkv")], run)
        run = self.succeeds("rain", "clip.mp4", "-o", "cut.mkv", "--codec", "ffv1", *CHEAP, "--frames", "0-1")
        self.assertIn(".cut.partial-host-1-0.mkv", run.err)
        self.assertEqual(self.leftovers(), [])

    def test_whatWasThereIsReplacedOnlyBySomethingWhole(self):
        (self.folder / "old.mp4").write_text("yesterday's")
        self.refused(3, "none.exr", "rain", "--quiet", "clip.mp4", "-o", "old.mp4", "--env", "none.exr")
        self.assertEqual((self.folder / "old.mp4").read_text(), "yesterday's")


if __name__ == "__main__":
    unittest.main()
