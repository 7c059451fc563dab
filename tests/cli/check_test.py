"""virga rain --check: what does not fit is said before anything is rendered, and nothing is written."""
import os
import shutil
import unittest

import numpy as np
from support import CHATTER, CliTest, ffmpeg, makeMovie, street, writeImage

WIDTH, HEIGHT = 64, 36
SHOT = ["rain", "shot.%04d.exr", "-o", "out.%04d.exr"]


class Check(CliTest):
    @classmethod
    def makePlates(cls):
        folder = cls.folder
        for frame in range(1001, 1005):
            writeImage(folder / f"shot.{frame}.exr", street(WIDTH, HEIGHT), "half")
        rows = np.linspace(60, 2, HEIGHT)[:, None] + np.linspace(0, 0.5, WIDTH)[None]
        for frame in range(1001, 1005):
            writeImage(folder / f"z.{frame}.exr", rows, "float", ["Z"])
        writeImage(folder / "mm.png", np.round(rows * 1000) / 65535, "uint16")
        writeImage(folder / "codes.png", np.round(rows * 4) / 255, "uint8")
        writeImage(folder / "square.exr", np.full((32, 32), 9.5), channels=["Z"])
        (folder / "shot.chan").write_text("".join(f"{f} {0.1 * f} 2 0 -5 30 0 40\n" for f in range(1001, 1005)))
        writeImage(folder / "pano.exr", np.ones((16, 32, 3)))

    def findings(self, *arguments, code=0, env=None):
        """The findings of a check, which must end with `code`, leave no file and say the same as a table."""
        before = self.content()
        run = self.virga(*arguments, "--check", "--json", env=env)
        self.assertEqual(run.code, code, run)
        self.assertNotRegex(run.err, CHATTER, run)
        report = run.report
        self.assertEqual(report["errors"] > 0, code == 3, run)
        table = self.virga(*arguments, "--check", env=env)
        self.assertEqual(table.code, code)
        for finding, line in zip(report["findings"], table.out.splitlines(), strict=True):
            self.assertTrue(line.startswith(finding["severity"]), line)
            if "memory" not in line and "free" not in line:  # these may change from one run to the next
                self.assertIn(finding["sentence"], line)
        self.assertEqual(self.content(), before, f"{run}\nthe folder has changed")
        return report["findings"]

    def says(self, findings, severity, source, *words, flag=None):
        for finding in findings:
            if finding["severity"] == severity and finding["input"] == source and all(w in finding["sentence"] for w in words):
                if flag is not None:
                    self.assertEqual(finding["flag"], flag)
                return
        self.fail(f"no {severity} of {source} with {words} in\n" + "\n".join(map(str, findings)))

    def test_allIsWell(self):
        findings = self.findings(*SHOT, "--depth", "z.%04d.exr", "--camera", "shot.chan", "--env", "pano.exr", "--fps", "25",
                                 "--colorspace", "Linear Rec.709")
        self.assertEqual({f["severity"] for f in findings}, {"ok"}, findings)
        self.says(findings, "ok", "plate", "64x36", "1001-1004")
        self.says(findings, "ok", "depth", "2 to 60.5 m")
        self.says(findings, "ok", "camera", ".chan", "4 poses")
        self.says(findings, "ok", "output", "can be written")
        self.says(findings, "ok", "output", "free")

    def test_guessesAreNotes(self):
        findings = self.findings(*SHOT)
        self.says(findings, "note", "plate", "Linear Rec.709", "guess", flag="--colorspace")
        self.says(findings, "note", "plate", "frame rate", flag="--fps")

    def test_plate(self):
        self.says(self.findings("rain", "none.exr", "-o", "o.exr", code=3), "error", "plate", "none.exr")
        findings = self.findings(*SHOT, "--frames", "1001-1010", code=3)
        self.says(findings, "error", "plate", "1005-1010")
        findings = self.findings(*SHOT, "--frames", "1001-1010", "--on-error", "skip")
        self.says(findings, "warning", "plate", "1005-1010", "skip")

    def test_everySizeOfASequenceIsLookedAt(self):
        for frame in (1, 2, 3):
            writeImage(self.folder / f"mixed.{frame:04d}.exr", street(WIDTH if frame < 3 else 32, HEIGHT))
        findings = self.findings("rain", "mixed.%04d.exr", "-o", "o.%04d.exr", code=3)
        self.says(findings, "error", "plate", "mixed.0003.exr", "32x36", "64x36")
        (self.folder / "mixed.0002.exr").write_bytes(b"nothing like it")
        findings = self.findings("rain", "mixed.%04d.exr", "-o", "o.%04d.exr", "--on-error", "hold")
        self.says(findings, "warning", "plate", "mixed.0002.exr")

    def test_movies(self):
        makeMovie(self.path("plate.mp4"), seconds=0.2, size="64x36")
        findings = self.findings("rain", "plate.mp4", "-o", "o.mp4")
        self.says(findings, "ok", "plate", "h264", "25 frames a second")
        self.says(findings, "note", "plate", "guess")
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x36:r=25:d=0.2", "-vf", "setsar=2,tinterlace=4", "-c:v", "mpeg2video", "-flags",
               "+ildct+ilme", self.path("tv.mkv"))
        findings = self.findings("rain", "tv.mkv", "-o", "o.mp4")
        self.says(findings, "warning", "plate", "as wide as high")
        self.says(findings, "warning", "plate", "interlaced", flag="--deinterlace")

    def test_depth(self):
        self.says(self.findings(*SHOT, "--depth", "mm.png"), "warning", "depth", "millimetres", flag="--depth-scale 0.001")
        scaled = self.findings(*SHOT, "--depth", "mm.png", "--depth-scale", "0.001")
        self.assertNotIn("warning", {f["severity"] for f in scaled}, scaled)
        self.says(self.findings(*SHOT, "--depth", "codes.png"), "warning", "depth", "8 bits", flag="--depth-range NEAR,FAR")
        self.says(self.findings(*SHOT, "--depth", "square.exr"), "warning", "depth", "32x32", "64x36", "shape")
        self.says(self.findings(*SHOT, "--depth", "none.exr", code=3), "error", "depth", "none.exr")
        self.says(self.findings(*SHOT, "--depth", "z.%04d.exr", "--rate", "0", "--fog", "0"), "note", "depth", "nothing")
        for frame in (1001, 1002):
            shutil.copy(self.path(f"z.{frame}.exr"), self.path(f"few.{frame}.exr"))
        self.says(self.findings(*SHOT, "--depth", "few.%04d.exr", code=3), "error", "depth", "1001-1002", "1003-1004 are missing")
        self.says(self.findings(*SHOT, "--depth", "few.%04d.exr", "--on-error", "hold"), "warning", "depth", "1003-1004")
        self.says(self.findings(*SHOT, "--depth", "z.1001.exr", "--camera", "shot.chan"), "warning", "depth", "one image", "moves")

    def test_camera(self):
        (self.folder / "other.chan").write_text("1 0 0 0 0 0 0\n4 1 0 0 0 0 0\n")
        findings = self.findings(*SHOT, "--camera", "other.chan")
        self.says(findings, "warning", "camera", "1-4", "1001-1004", flag="--camera-offset 1000")
        self.says(findings, "note", "camera", "60 deg", flag="--fov")
        (self.folder / "cm.chan").write_text("1001 0 0 0 0 0 0 40\n1004 3000 0 0 0 0 0 40\n")
        self.says(self.findings(*SHOT, "--camera", "cm.chan"), "warning", "camera", "1000 m a frame", flag="--camera-scale 0.01")
        (self.folder / "bad.chan").write_text("1001 0 0 0 0 0\n")
        self.says(self.findings(*SHOT, "--camera", "bad.chan", code=3), "error", "camera", "line 1")

    def test_light(self):
        writeImage(self.folder / "ldr.png", np.ones((16, 32, 3)), "uint8")
        self.says(self.findings(*SHOT, "--env", "ldr.png"), "warning", "env", "cut off", flag="--light-radiance")
        self.says(self.findings(*SHOT, "--env", "shot.1001.exr", code=3), "error", "env", "64x36", "twice as wide")
        self.says(self.findings(*SHOT, "--env", "none.exr", code=3), "error", "env", "none.exr")
        (self.folder / "bad.toml").write_text("[[light]]\n")
        self.says(self.findings(*SHOT, "--lights", "bad.toml", code=3), "error", "lights", "line 1")
        (self.folder / "lamps.toml").write_text("[[light]]\nposition = [0, 3, -9]\nintensity = [1, 1, 1]\n")
        self.says(self.findings(*SHOT, "--lights", "lamps.toml"), "ok", "lights", "1 lamp")
        self.says(self.findings(*SHOT, "--mattes", "square.exr", code=3), "error", "mattes", "square.exr")
        self.says(self.findings(*SHOT, "--grade-from", "none.png", code=3), "error", "grade-from", "none.png")

    def test_output(self):
        plate = ["rain", "shot.%04d.exr", "-o"]
        self.says(self.findings(*plate, "none/out.%04d.exr", code=3), "error", "output", "none")
        self.says(self.findings(*plate, "out.exr", code=3), "error", "output", "4 frames")
        self.says(self.findings(*plate, "out.xyz", code=3), "error", "output", "out.xyz")
        self.says(self.findings(*plate, "shot.%04d.exr", code=3), "error", "output", "plate itself")
        self.says(self.findings(*plate, "out.mp4", "--codec", "nonesuch", code=3), "error", "output", "nonesuch")
        self.says(self.findings(*SHOT, "--output-colorspace", "nonesuch", code=3), "error", "output", "nonesuch")
        self.says(self.findings(*plate, "z.%04d.exr", "--depth", "z.%04d.exr", code=3), "error", "output", "--depth")
        shutil.copy(self.path("shot.1001.exr"), self.path("out.1002.exr"))
        try:
            self.says(self.findings(*SHOT), "note", "output", "1 file")
        finally:
            os.remove(self.path("out.1002.exr"))

    def test_colourConfiguration(self):
        self.says(self.findings(*SHOT, "--ocio", "none.ocio", code=3), "error", "plate", "none.ocio")

    def test_anotherRunsFileIsLeftAlone(self):
        (self.folder / ".out.partial-host-1-0.mp4").write_bytes(b"another run at work")
        self.findings("rain", "shot.%04d.exr", "-o", "out.mp4")  # compares the folder's content
        os.remove(self.path(".out.partial-host-1-0.mp4"))

    def test_noDeviceIsNeeded(self):
        self.findings(*SHOT, "--depth", "z.%04d.exr", env={"EGL_PLATFORM": "nonesuch", "__EGL_VENDOR_LIBRARY_FILENAMES": "/none"})

    def test_usage(self):
        self.refused(2, ["--check", "--save-settings"], *SHOT, "--check", "--save-settings", "s.toml")
        self.refused(2, ["--check", "pipe"], "rain", "-", "-o", "o.mp4", "--check")
        self.refused(2, "--rate", *SHOT, "--check", "--rate", "-1")

    def test_aNormalRunWarnsOfWhatIsSerious(self):
        (self.folder / "apart.chan").write_text("1 0 0 0 0 0 0 40\n4 1 0 0 0 0 0 40\n")
        shot = ["rain", "shot.%04d.exr", "-o", "wet.%04d.exr"]
        run = self.succeeds(*shot, "--depth", "mm.png", "--camera", "apart.chan", "--frames", "1001-1003")
        self.assertEqual(run.err.count("millimetres"), 1, run)
        self.assertEqual(run.err.count("--camera-offset 1000"), 1, run)
        self.assertNotIn("warning", self.succeeds(*shot, "--depth", "z.%04d.exr", "--camera", "shot.chan").err)


if __name__ == "__main__":
    unittest.main()
