"""Exit code 2: flags, values and settings files. One sentence each that names the flag, the value and what is allowed."""
import unittest

from support import CliTest, Run, makeMovie, street, writeImage


class Words(CliTest):
    """Commands and flags themselves."""

    @classmethod
    def makePlates(cls):
        makeMovie(cls.folder / "clip.mp4", sound=False)

    def test_noCommand(self):
        self.refused(2, ["no command", "--help"])

    def test_unknownCommandIsSuggested(self):
        self.refused(2, ["'rian'", "did you mean 'rain'"], "rian", "clip.mp4")

    def test_mistypedFlagIsSuggested(self):
        for typed in (["--rat", "25"], ["--rat=25"]):
            self.refused(2, ["'--rat'", "'virga rain'", "did you mean '--rate'?"], "rain", "clip.mp4", "-o", "x.mp4", *typed)
        self.refused(2, ["'--wnd'", "'--wind'"], "rain", "clip.mp4", "-o", "x.mp4", "--wnd", "1,2")
        self.refused(2, ["'--parameter'", "'--parameters'"], "info", "--parameter")

    def test_farFetchedFlagIsNotSuggested(self):
        self.assertNotIn("did you mean", self.refused(2, "'--thunderstorm'", "rain", "a", "-o", "b", "--thunderstorm"))

    def test_shortFlag(self):
        self.refused(2, ["'-q'", "not a flag"], "rain", "clip.mp4", "-o", "x.mp4", "-q")

    def test_missingPlate(self):
        self.refused(2, ["PLATE", "required"], "rain", "-o", "x.mp4")

    def test_missingOutput(self):
        self.refused(2, ["--output", "required"], "rain", "clip.mp4")

    def test_oneArgumentTooMany(self):
        self.refused(2, ["'other.mp4'", "too many"], "rain", "clip.mp4", "other.mp4", "-o", "x.mp4")

    def test_flagWithoutValue(self):
        for flag in ("--rate", "--frames", "--codec", "--threads"):
            self.refused(2, [flag, "needs a value"], "rain", "clip.mp4", "-o", "x.mp4", flag)

    def test_flagTwice(self):
        self.refused(2, ["--rate", "more than once"], "rain", "clip.mp4", "-o", "x.mp4", "--rate", "1", "--rate", "2")

    def test_switchDoesNotSwallowThePlate(self):
        self.refused(3, "nothere.exr", "rain", "--float", "nothere.exr", "-o", "x.exr")
        self.refused(2, ["--paper", "'maybe'", "true or false"], "rain", "clip.mp4", "-o", "x.mp4", "--paper=maybe")

    def test_halfAndFloat(self):
        self.refused(2, ["--half", "--float"], "rain", "clip.mp4", "-o", "x.%04d.exr", "--half", "--float")


class Values(CliTest):
    """Values out of range or of the wrong kind. The plate is good, so that nothing else can be at fault."""

    @classmethod
    def makePlates(cls):
        makeMovie(cls.folder / "clip.mp4", sound=False)

    def refusedValue(self, flag, value, *words):
        with self.subTest(flag=flag, value=value):
            self.refused(2, [flag, value, *words], "rain", "clip.mp4", "-o", "x.mp4", flag, value)

    def test_numbers(self):
        for value in ("-1", "nan", "inf", "1e6", "abc", "5mm", " 5", "0x10"):
            self.refusedValue("--rate", value, "0 to 2000 mm/h")
        for value in ("-1", "3601"):
            self.refusedValue("--shutter", value, "0 to 3600 deg")
        for value in ("0", "180"):
            self.refusedValue("--fov", value, "0.1 to 179 deg")
        self.refusedValue("--seed", "1.5", "whole number", "4294967295")
        self.refusedValue("--env-order", "3.5", "whole number")
        self.refusedValue("--strokes", "0")

    def test_lists(self):
        for value in ("1", "1,2,3"):
            self.refusedValue("--wind", value, "2 numbers", "m/s")
        self.refusedValue("--wind", "a,b", "number")
        self.refusedValue("--fog-color", "1,2", "3 numbers")

    def test_choices(self):
        self.refusedValue("--on-error", "foo", "stop, skip or hold")
        self.refusedValue("--device", "foo", "auto, cpu, gpu or a device number")
        for value in ("-1", "abc", "1025", "1.5"):
            self.refusedValue("--threads", value, "0 to 1024")

    def test_ground(self):
        for value in ("x", "0", "-1", "1,2,3", "1,", "1,90", "nan"):
            self.refusedValue("--ground", value, "height[,pitch]")

    def test_frames(self):
        for value in ("abc", "5-1x2", "1-", "1-5x0", ",", "1-99999999"):
            with self.subTest(value=value):
                self.refused(2, ["frame range", value], "rain", "clip.mp4", "-o", "x.mp4", "--frames", value)

    def test_framesOutsideTheClip(self):
        self.refused(2, ["frames 25-30 are not in", "clip.mp4", "0-24"], "rain", "clip.mp4", "-o", "x.mp4", "--frames",
                     "20-30")
        self.refused(2, ["frame 500 is not in", "clip.mp4", "0-24"], "rain", "clip.mp4", "-o", "x.mp4", "--frames", "500")

    def test_nearAndFar(self):
        for near in ("5", "10"):
            self.refused(2, ["--far 5 m", f"--near {near} m"], "rain", "clip.mp4", "-o", "x.mp4", "--near", near, "--far",
                         "5")

    def test_strokesThatNobodySees(self):
        self.refused(2, ["--strokes 100", "--near 199", "--far 200", "--threshold 0.5"], "rain", "clip.mp4", "-o", "x.mp4",
                     "--strokes", "100", "--near", "199", "--far", "200", "--threshold", "0.5")

    def test_moreStrokesThanCanBeDrawn(self):
        self.refused(2, ["--rate 2000", "--threshold"], "rain", "clip.mp4", "-o", "x.mp4", "--rate", "2000", "--threshold",
                     "1e-5", "--thin", "0", "--far", "1e6", "--fov", "170")

    def test_layersOutsideExr(self):
        self.refused(2, ["x.mp4", "EXR"], "rain", "clip.mp4", "-o", "x.mp4", "--layers")

    def test_colourSpace(self):
        for flag in ("--colorspace", "--output-colorspace"):
            sentence = "'nope'"
            run = Run(["rain", "clip.mp4", "-o", "x.mp4", flag, "nope"], self.folder)
            self.assertEqual(run.code, 2, run)
            self.assertIn(sentence, run.err)

    def test_codec(self):
        self.refused(2, ["'nope'", "x.mp4", "libx264"], "rain", "clip.mp4", "-o", "x.mp4", "--codec", "nope")
        self.refused(2, ["'nope'", "zip"], "rain", "clip.mp4", "-o", "x.%04d.exr", "--codec", "nope")
        self.refused(2, ["'prores_ks'", "x.mp4"], "rain", "clip.mp4", "-o", "x.mp4", "--codec", "prores_ks")


class SettingsFiles(CliTest):
    """--settings: each fault with its file and line."""

    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "still.exr", street())

    def refusedFile(self, text, code, *words):
        (self.folder / "look.toml").write_text(text)
        self.refused(code, ["'look.toml'", *words], "rain", "still.exr", "-o", "x.exr", "--settings", "look.toml")

    def test_unknownKeyIsSuggested(self):
        self.refusedFile("[rain]\nrat = 25\n", 2, "line 2", "'rat'", "did you mean 'rate'")

    def test_unknownGroupIsSuggested(self):
        self.refusedFile("[rian]\nrate = 25\n", 2, "line 1", "'rian'", "did you mean 'rain'")

    def test_keyInAnotherGroup(self):
        self.refusedFile("[rain]\nfog = 0.1\n", 2, "line 2", "'fog'", "[scene]")

    def test_syntax(self):
        self.refusedFile("[rain]\nrate = = 25\n", 3, "line 2")

    def test_value(self):
        self.refusedFile("\n[rain]\nrate = 1e9\n", 2, "line 3", "--rate", "1000000000", "0 to 2000 mm/h")
        self.refusedFile("[rain]\nwind = [1]\n", 2, "line 2", "--wind", "2 numbers")
        self.refusedFile("[scene]\nfog = nan\n", 2, "line 2", "--fog", "nan")
        sentence = "'look.toml', line 1: 'rate' must be"
        self.refusedFile("rate = 1979-05-27\n", 2, sentence)
        self.refusedFile("[rain.rate]\na = 1\n", 2, "'rate'")

    def test_notAFile(self):
        self.refused(3, ["'none.toml'", "no such file"], "rain", "still.exr", "-o", "x.exr", "--settings", "none.toml")
        self.refused(3, ["'.'", "folder"], "rain", "still.exr", "-o", "x.exr", "--settings", ".")
        self.refused(3, ["'still.exr'"], "rain", "still.exr", "-o", "x.exr", "--settings", "still.exr")


class MatchFiles(CliTest):
    """--match: what virga extract wrote, each fault with its file."""

    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "still.exr", street())

    def refusedReport(self, text, code, *words):
        (self.folder / "report.json").write_text(text)
        self.refused(code, ["match 'report.json'", *words], "rain", "still.exr", "-o", "x.exr", "--match", "report.json")

    def refusedMatch(self, match, code, *words):
        report = '{"format": "virga-extract-report", "version": 1, "match": %s}'
        self.refusedReport(report % match, code, *words)

    def test_notAReport(self):
        self.refused(3, ["'none.json'", "no such file"], "rain", "still.exr", "-o", "x.exr", "--match", "none.json")
        self.refused(3, ["'.'", "folder"], "rain", "still.exr", "-o", "x.exr", "--match", ".")
        self.refused(3, ["'still.exr'", "not JSON"], "rain", "still.exr", "-o", "x.exr", "--match", "still.exr")
        self.refusedReport("rate = 25\n", 3, "not JSON")
        self.refusedReport('{"rate": 25}', 3, "no report of virga extract", "virga-extract-report")
        self.refusedReport('{"format": "virga-extract-report", "version": 7, "match": {}}', 3, "version 7", "version 1")

    def test_noRain(self):
        self.refusedMatch("null", 3, "found no rain")
        self.refusedReport('{"format": "virga-extract-report", "version": 1}', 3, "found no rain")

    def test_keysAndValues(self):
        self.refusedMatch('{"rat": 25}', 2, "'rat'", "did you mean 'rate'")
        self.refusedMatch('{"rate": 5000}', 2, "--rate", "'5000'", "0 to 2000 mm/h")
        self.refusedMatch('{"exposure": "long"}', 2, "--exposure", "'long'", "0 to 60 s")
        self.refusedMatch('"heavy"', 3, '"heavy"', "object")

    def test_mattesThatAreNotBesideTheReport(self):
        (self.folder / "extracted").mkdir()
        (self.folder / "extracted" / "report.json").write_text(
            '{"format": "virga-extract-report", "version": 1, "match": {"mattes": "atlas.exr"}}')
        self.refused(3, ["mattes 'extracted/atlas.exr'", "no such file"], "rain", "still.exr", "-o", "x.exr", "--match",
                     "extracted/report.json")


class Help(CliTest):
    """--help goes to standard output and fits a terminal of 100 columns."""

    def test_pages(self):
        for arguments in ([], ["rain"], ["model"], ["info"]):
            run = self.succeeds(*arguments, "--help")
            self.assertEqual(run.err, "", run)
            self.assertLessEqual(max(map(len, run.out.splitlines())), 100, run)

    def test_everyParameterWithUnitDefaultAndRange(self):
        page = self.succeeds("rain", "--help").out
        for line in self.succeeds("info", "--parameters").out.splitlines():
            if line.startswith("| `--"):
                flag, default, unit = [cell.strip(" `") for cell in line.split("|")[1:4]]
                self.assertRegex(page, rf"\n  {flag}( |\n)")
        self.assertIn("--rate mm/h", page)
        self.assertIn("(default 0.1; 0 to 1)", page)
        self.assertIn("Examples:", page)

    def test_version(self):
        self.assertRegex(self.succeeds("--version").out, r"^virga \d+\.\d+\.\d+\n$")


if __name__ == "__main__":
    unittest.main()
