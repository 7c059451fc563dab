"""virga extract: flags and values that it refuses, exit code 2."""
import unittest

from footage import ExtractTest


class Usage(ExtractTest):
    """Exit code 2, with footage that is good."""

    def refusedFlags(self, words, *flags):
        with self.subTest(flags=flags):
            self.refused(2, words, "extract", "--quiet", *self.STACK, "-o", "out", *flags)

    def test_outOfRange(self):
        for flag, values, allowed in (
                ("--window", ("3", "1001"), "4 to 1000 frames"), ("--strokes", ("0", "4097"), "1 to 4096"),
                ("--tolerance", ("0", "nan"), "1e-09 to 0.1"), ("--fov", ("0", "171"), "170 deg"),
                ("--lambda", ("1e+13", "nan"), "0 to 1e+12"), ("--mu", ("-1",), "0 to 1e+12"),
                ("--iterations", ("0", "1001"), "1 to 1000"), ("--exposure", ("0", "61"), "at most 60 s"),
                ("--slant", ("91", "nan", "5deg", ""), "auto or -90 to 90 deg"),
                ("--rain-color", ("1,2", "1,2,3,4", "1,2,", "-1,0,0", "nan,0,0", "1e7,0,0", "0x1,0,0"),
                 "auto or three numbers r,g,b, each 0 to 1e+06"),
                ("--tile", ("16", "3x64", "16x64x2", "99999999999x64"), "4x16 to 256x1024"),
                ("--space", ("srgb",), "auto, linear or display"), ("--on-error", ("foo",), "stop, skip or hold"),
                ("--threads", ("-1",), "0 to 1024")):
            for value in values:
                self.refusedFlags([flag, f"'{value}'", "must be", allowed], flag, value)
        for value in ("0", "nan"):
            self.refusedFlags(["fps", "10000"], "--fps", value)

    def test_wordsForNumbers(self):
        for flag in ("--window", "--lambda", "--fps"):
            self.refusedFlags([f"{flag} 'x'", "must be a number"], flag, "x")
        for flag in ("--strokes", "--iterations"):
            self.refusedFlags([f"{flag} '1.5'", "must be a whole number"], flag, "1.5")

    def test_framesAreARange(self):
        for value in ("abc", "5-", ","):
            self.refusedFlags(["frame range", value], "--frames", value)

    def test_stack(self):
        for value in ("0", "-1", "10001"):
            self.refused(2, ["--stack", f"'{value}'", "1 to 10000"], "extract", "stack.png", "-o", "out", "--stack", value)

    def test_excluding(self):
        self.refusedFlags(["--half", "--float"], "--half", "--float")
        self.refusedFlags(["--linear", "--colorspace"], "--colorspace", "sRGB")
        self.refusedFlags(["--paper", "--stabilize"], "--paper", "--stabilize")

    def test_words(self):
        self.refusedFlags(["'--windo'", "did you mean '--window'"], "--windo", "5")
        self.refusedFlags(["'more.png'", "too many"], "more.png")
        self.refused(2, ["FOOTAGE", "required"], "extract", "-o", "out")
        self.refused(2, ["--output", "required"], "extract", "stack.png")
        self.refused(2, ["'nonsense'"], "extract", "stack.png", "-o", "out", "--colorspace", "nonsense")

    def test_help(self):
        page = self.succeeds("extract", "--help").out
        for word in ("--stack N", "--stabilize", "--paper", "Examples:", "virga rain street.mp4"):
            self.assertIn(word, page)
        self.assertLessEqual(max(map(len, page.splitlines())), 100)


del ExtractTest  # only a base


if __name__ == "__main__":
    unittest.main()
