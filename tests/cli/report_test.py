"""What virga rain says and writes beside the pictures: the report, the progress, settings files, the contact sheet."""
import os
import pty
import re
import subprocess
import unittest

import numpy as np
from support import CHEAP, HEIGHT, VIRGA, WIDTH, CliTest, Run, bits, makeMovie, readImage, street, writeImage

# docs/design.md: "`virga rain --json` reports at least".
FIELDS = {"frames": int, "width": int, "height": int, "fps_rendered": float, "seconds": float,
          "render_ms_per_frame": float, "strokes_per_frame": float, "passes": dict, "skipped": dict, "device": str,
          "peak_memory_mb": float}


class Report(CliTest):
    @classmethod
    def makePlates(cls):
        makeMovie(cls.folder / "clip.mp4", sound=False)
        writeImage(cls.folder / "still.exr", street())
        writeImage(cls.folder / "env.exr", np.random.default_rng(1).uniform(0.1, 1, (32, 64, 3)))

    def test_fields(self):
        report = self.rain("clip.mp4", "-o", "out.mp4", "--frames", "2-9x2", "--rate", "30")
        for field, kind in FIELDS.items():
            self.assertIsInstance(report[field], kind, field)
        self.assertEqual((report["frames"], report["width"], report["height"]), (4, WIDTH, HEIGHT))
        self.assertEqual((report["fps"], report["frame_range"]), (25, "2-8x2"))
        self.assertEqual(report["settings"]["rate"], 30)
        for field in ("fps_rendered", "seconds", "render_ms_per_frame", "strokes_per_frame", "peak_memory_mb"):
            self.assertGreater(report[field], 0, field)
        self.assertTrue(report["device"])
        self.assertTrue(all(ms >= 0 for ms in report["passes"].values()))
        self.assertTrue({"strokes", "composite"} <= set(report["passes"]))
        self.assertFalse(set(report["passes"]) & set(report["skipped"]))
        self.assertFalse(report["stopped"])

    def test_streams(self):
        """Without --json nothing is on standard output; with it the report alone. --quiet says nothing on success."""
        plain = self.succeeds("rain", "clip.mp4", "-o", "out.mp4", *CHEAP)
        self.assertEqual(plain.out, "")
        self.assertRegex(plain.err, r"frame 24 \(25 of 25\), [\d.]+ fps, 0:00:00 left")
        self.assertNotIn("\r", plain.err)  # no bar where there is no terminal
        self.assertTrue(all(line.startswith("virga: ") for line in plain.lines), plain)
        explained = self.succeeds("rain", "--json", "--explain", "clip.mp4", "-o", "out.mp4", *CHEAP)
        self.assertEqual(explained.report["frames"], 25)
        self.assertIn("strokes ", explained.err)
        quiet = self.succeeds("rain", "--quiet", "clip.mp4", "-o", "out.mp4", *CHEAP)
        self.assertEqual((quiet.out, quiet.err), ("", ""))

    def test_progressBarOnATerminal(self):
        main, side = pty.openpty()
        process = subprocess.Popen([VIRGA, "rain", "clip.mp4", "-o", "out.mp4", *CHEAP], cwd=self.folder, stderr=side)
        os.close(side)
        said = b""
        while True:
            try:
                piece = os.read(main, 4096)
            except OSError:
                break
            if not piece:
                break
            said += piece
        self.assertEqual(process.wait(), 0)
        os.close(main)
        self.assertRegex(said.decode(), r"\r\[#{24}\] frame 24 \(25 of 25\)")

    def test_savedSettingsGiveTheSameFrame(self):
        look = ["--rate", "40", "--wind", "-2.5,1", "--shutter", "90", "--fog", "0.01", "--fog-color", "0.2,0.3,0.1",
                "--seed", "4294967295", "--ground", "1.5,3", "--env", "env.exr", "--env-order", "4", "--threshold", "0.0123",
                "--darken", "0.3", "--blur", "1.5", "--background-boost", "0.1"]
        self.rain("still.exr", "-o", "first.exr", *look, "--save-settings", "look.toml")
        self.rain("still.exr", "-o", "second.exr", "--settings", "look.toml", "--save-settings", "again.toml")
        self.assertEqual((self.folder / "look.toml").read_text(), (self.folder / "again.toml").read_text())
        np.testing.assert_array_equal(bits(self.folder / "first.exr")[2], bits(self.folder / "second.exr")[2])
        self.rain("still.exr", "-o", "other.exr", "--settings", "look.toml", "--seed", "3")
        self.assertTrue((bits(self.folder / "first.exr")[2] != bits(self.folder / "other.exr")[2]).any())

    def test_flagsOverrideTheFile(self):
        (self.folder / "look.toml").write_text("paper = true\n[rain]\nrate = 40\nspeed = 2\nwind = [1, -2]\n")
        settings = self.rain("still.exr", "-o", "out.exr", "--settings", "look.toml", "--rate", "7",
                             "--paper=false")["settings"]
        self.assertEqual([settings[k] for k in ("rate", "speed", "wind", "paper")], [7, 2, [1, -2], False])

    def test_matchOverridesTheFileAndFlagsOverrideBoth(self):
        (self.folder / "look.toml").write_text("paper = true\n[rain]\nrate = 40\nspeed = 2\nopacity = 1\n")
        (self.folder / "report.json").write_text(
            '{"format": "virga-extract-report", "version": 1,'
            ' "match": {"rate": 31.2, "exposure": 0.006, "wind": [0.8, 0], "opacity": 4.1}}')
        plain = self.rain("still.exr", "-o", "out.exr")["settings"]
        matched = self.rain("still.exr", "-o", "out.exr", "--match", "report.json")["settings"]
        taken = {"rate": 31.2, "exposure": 0.006, "wind": [0.8, 0], "opacity": 4.1}
        self.assertEqual(matched, {**plain, **taken})
        # The order in which they are typed means nothing.
        for files in (["--match", "report.json", "--settings", "look.toml"],
                      ["--settings", "look.toml", "--match", "report.json"]):
            settings = self.rain("still.exr", "-o", "out.exr", "--rate", "7", *files)["settings"]
            self.assertEqual(settings, {**plain, **taken, "paper": True, "speed": 2, "rate": 7})
        settings = self.rain("still.exr", "-o", "out.exr", "--match", "report.json", "--shutter", "90")["settings"]
        self.assertEqual((settings["shutter"], settings["exposure"]), (90, "auto"))

    def test_contactSheet(self):
        """Before and after in two columns, a row for up to three frames, 8 pixels apart."""
        for arguments, rows in ((["clip.mp4", "-o", "out.mp4"], 3), (["still.exr", "-o", "out.exr"], 1)):
            self.rain(*arguments, "--preview", "sheet.png", "--rate", "100")
            sheet, _ = readImage(self.folder / "sheet.png")
            self.assertEqual(sheet.shape, (rows * HEIGHT + (rows - 1) * 8, 2 * WIDTH + 8, 3))
            before, after = sheet[:HEIGHT, :WIDTH], sheet[:HEIGHT, WIDTH + 8:]
            self.assertGreater(np.abs(before - after).max(), 0.01)
        writeImage(self.folder / "large.exr", street(1000, 40))
        self.rain("large.exr", "-o", "out.exr", "--preview", "sheet.png", *CHEAP)
        self.assertEqual(readImage(self.folder / "sheet.png")[0].shape, (20, 1008, 3))

    def test_parametersPageNamesEverySetting(self):
        page = self.succeeds("info", "--parameters").out
        settings = self.rain("still.exr", "-o", "out.exr", *CHEAP)["settings"]
        self.assertEqual(set(re.findall(r"\| `--([\w-]+)` \|", page)), set(settings))

    def test_info(self):
        run = self.succeeds("info")
        self.assertRegex(run.out, r"^virga \d")
        report = Run(["info", "--json"], self.folder).report
        self.assertTrue({"version", "devices", "libraries"} <= set(report))
        for device in report["devices"]:
            self.assertIn(device["renderer"], run.out)


if __name__ == "__main__":
    unittest.main()
