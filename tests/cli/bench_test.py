"""virga bench: the files that it leaves and what it refuses. How long things take is never tested."""
import csv
import os
import re
import subprocess
import unittest
import xml.etree.ElementTree as ElementTree
from html.parser import HTMLParser
from pathlib import Path

from support import CliTest, makeMovie

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
TINY = ["--samples", SAMPLES, "--footage", "", "--columns", "32", "--seeds", "2"]
VOID = {"meta", "img", "br"}
OPTIONAL_END = {"td", "th"}


class Page(HTMLParser):
    """Tags that open and close in pairs, and what they point to."""

    def __init__(self):
        super().__init__()
        self.open, self.sources, self.links = [], [], []

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag == "img":
            self.sources.append(attributes["src"])
        if tag == "a":
            self.links.append(attributes["href"])
        if tag not in VOID | OPTIONAL_END:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open}"
        self.open.pop()


class Curves(CliTest):
    def check(self, out, knob, values=None):
        """Table, charts and page of one knob in the folder `out`; returns the table's rows."""
        folder = self.folder / out
        with open(folder / f"{knob}.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertTrue(rows)
        for row in rows:
            self.assertNotIn(None, row, "more cells than columns")
            self.assertNotIn(None, row.values(), "fewer cells than columns")
            for name, cell in row.items():
                if name not in ("clip", "variant") and not (name == "value" and cell == ""):
                    self.assertTrue(abs(float(cell)) < 1e12, f"{name}: {cell}")
        if values:
            self.assertEqual({float(row["value"]) for row in rows if row["value"]}, set(values))
        charts = ElementTree.parse(folder / f"{knob}.svg").getroot()
        self.assertTrue(charts.tag.endswith("svg"))
        self.assertIn("default", "".join(charts.itertext()))
        page = Page()
        page.feed((folder / "index.html").read_text())
        self.assertEqual(page.open, [])
        self.assertIn(f"{knob}.svg", page.sources)
        for name in page.sources + page.links:
            self.assertTrue((folder / name).is_file(), f"index.html points to {name}")
        self.assertEqual(self.leftovers(), [])
        return rows

    def test_threshold(self):
        self.succeeds("bench", "curves", "-o", "t", "--only", "threshold", "--values", "0.5,0.02", *TINY)
        rows = self.check("t", "threshold", [0.5, 0.02])
        self.assertEqual(len(rows), 2 * 2 * 2 + 1)  # values, --thin or not, seeds; and the base line
        for row in rows:
            self.assertGreater(float(row["rmse"]), 0)
            self.assertLessEqual(float(row["rmse"]), float(row["max"]))
        pictures = sorted(p.name for p in (self.folder / "t").glob("threshold_street_*.png"))
        self.assertEqual(len(pictures), 9, pictures)  # the truth; each value, --thin or not, and its difference

    def test_layersInFloatAreTheBeauty(self):
        self.succeeds("bench", "curves", "-o", "l", "--only", "layers", "--values", "10,23", *TINY)
        by = {float(row["value"]): float(row["rmse"]) for row in self.check("l", "layers", [10, 23])}
        self.assertLess(by[23], 1e-6)
        self.assertLess(by[10], 1e-3)
        self.assertGreater(by[10], 10 * by[23])

    def test_twoKnobsOnOnePage(self):
        self.succeeds("bench", "curves", "-o", "two", "--only", "layers,blur", "--values", "2,10", *TINY)
        page = (self.folder / "two" / "index.html").read_text()
        self.assertEqual(re.findall(r'<h2 id="(\w+)"', page), ["layers", "blur"])

    def curve(self, knob, values, seeds=1):
        """Rows of a knob at a few values and its default."""
        self.succeeds("bench", "curves", "-o", knob, "--only", knob, "--values", values, "--samples", SAMPLES, "--footage", "",
                      "--columns", "32", "--seeds", seeds)
        return self.check(knob, knob)

    def test_moreClassesFallMoreTruly(self):
        rows = self.curve("size-classes", "8")
        for rate in ("5 mm/h", "25 mm/h", "100 mm/h"):
            by = {row["value"]: float(row["speed_rms"]) for row in rows if row["clip"] == rate}
            self.assertLess(by["32"], 0.35 * by["8"])
            self.assertLess(by["32"], 0.015)
        self.assertLess(max(float(row["size_distance"]) for row in rows), 0.012)

    def test_cellsDoNotChangeTheRain(self):
        for row in self.curve("cell-size", "1,64"):
            self.assertLess(abs(float(row["count"])), 4.5, row)
            self.assertLess(float(row["size_distance"]), 0.012, row)
            self.assertGreaterEqual(float(row["listed"]), 1)

    def test_coverageConverges(self):
        rows = self.curve("coverage", "1,8")
        for look in {row["clip"] for row in rows}:
            by = {row["variant"] or row["value"]: row for row in rows if row["clip"] == look}
            self.assertLess(float(by["8"]["rmse"]), 0.2 * float(by["1"]["rmse"]))
            self.assertLess(float(by["as drawn"]["rmse"]), float(by["1"]["rmse"]))
            self.assertAlmostEqual(float(by["as drawn"]["mass"]), 1, delta=0.01)

    def test_mattes(self):
        for row in self.curve("mattes", "4"):
            self.assertAlmostEqual(float(row["mass"]), 1, delta=0.02)

    def test_finerStepsStackBetter(self):
        rows = self.curve("stacking", "12")
        for pile in {row["clip"] for row in rows}:
            by = {row["value"]: float(row["rmse"]) for row in rows if row["clip"] == pile}
            self.assertLess(by["18"], 0.1 * by["12"])
            self.assertLess(by["18"], 1e-4)

    def test_light(self):
        by = {row["variant"] or row["value"]: float(row["rms"]) for row in self.curve("light-order", "1,16")}
        self.assertLess(by["16"], by["auto"])
        self.assertLess(by["auto"], 0.0075)  # half as much again as --env-order auto aims at
        self.assertGreater(by["1"], 0.1)
        by = {row["variant"] or row["value"]: float(row["rms"]) for row in self.curve("light-map", "16,256")}
        self.assertGreater(by["16"], 3 * by["256"])
        self.assertAlmostEqual(by["as baked"], by["256"], delta=0.001)

    def test_projection(self):
        by = {row["variant"] or row["value"]: float(row["rms"]) for row in self.curve("env-projection", "32")}
        self.assertLess(by["whole"], 1e-4)
        self.assertGreater(by["32"], 0.01)

    def test_fogTable(self):
        by = {row["value"]: float(row["max"]) for row in self.curve("fog-table", "16")}
        self.assertLess(by["256"], 0.2 * by["16"])

    def test_extraction(self):
        for knob, value in (("extract-rounds", "1"), ("extract-pyramid", "3")):
            for row in self.curve(knob, value):
                self.assertLess(float(row["alpha_rmse"]), 0.02)

    @unittest.skipUnless(os.environ.get("VIRGA_FOOTAGE_DIR"), "VIRGA_FOOTAGE_DIR is not set")
    def test_footage(self):
        tiny = [a for a in TINY if a not in ("--footage", "")]
        self.succeeds("bench", "curves", "-o", "f", "--only", "layers", "--values", "10", *tiny)
        clips = {row["clip"] for row in self.check("f", "layers", [10])}
        self.assertEqual(clips, {"street", "yard", "highway", "balcony"})


class Tables(CliTest):
    """The papers' own figures stand beside ours."""

    def test_wang(self):
        run = self.succeeds("bench", "tables", "--only", "wang", "--frames", "1", "--largest", "20000", "--device", "cpu", "--json", "--quiet")
        rows = run.report["rows"]
        self.assertEqual([(r["case"], r["paper_fps"]) for r in rows], [("10,000 strokes", 790), ("20,000 strokes", 328)])
        for row in rows:
            self.assertEqual((row["width"], row["height"]), (720, 480))
            self.assertGreater(row["fps"], 0)
            wanted = float(row["case"].split()[0].replace(",", ""))
            self.assertLess(abs(row["drawn"] / wanted - 1), 0.1, "as many strokes as the paper drew")

    def test_everyFigureOfThePapers(self):
        """Nothing is drawn: the smallest case has more drops."""
        run = self.succeeds("bench", "tables", "--frames", "1", "--largest", "1000", "--device", "cpu")
        self.assertNotIn("| wang", run.out)
        figures = [float(line.split("|")[3]) for line in run.out.splitlines() if line.startswith("| 1,000 drops")]
        self.assertEqual(figures, [196, 187, 174, 162, 148, 134])  # Rousseau's Table 5, all resolutions
        self.assertIn("rousseau, Table 5", run.err)

    def test_nvidiaHasBothTables(self):
        rows = self.succeeds("bench", "tables", "--only", "nvidia", "--frames", "1", "--largest", "2e5", "--device", "cpu", "--json", "--quiet").report["rows"]
        self.assertEqual([(r["paper_fps"], r["timed"]) for r in rows], [(574, "cells and drops"), (545, "strokes and composite")])


class EndToEnd(CliTest):
    @classmethod
    def makePlates(cls):
        makeMovie(cls.folder / "clip.mp4")

    def test_ratio(self):
        report = self.succeeds("bench", "e2e", "clip.mp4", "--runs", "1", "--device", "cpu", "--json", "-o", "kept", "--",
                               "--fov", "50").report
        self.assertAlmostEqual(report["ratio"], report["rain"]["seconds"] / report["transcode"]["seconds"])
        self.assertGreater(report["processor_ratio"], 0)
        self.assertGreater(report["decode"]["seconds"], 0)
        self.assertIn("strokes", report["passes"])
        self.assertGreater(report["strokes_per_frame"], 0, "the same as virga rain without more flags draws")
        settings = []
        for name in ("plain.mp4", "rain.mp4"):
            movie = self.folder / "kept" / name
            frames = subprocess.run(["ffprobe", "-v", "error", "-count_packets", "-select_streams", "v", "-show_entries",
                                     "stream=nb_read_packets", "-of", "csv=p=0", movie], capture_output=True, check=True)
            self.assertEqual(int(frames.stdout.decode().strip().strip(",")), report["frames"])
            # x264 writes its settings into the stream.
            settings.append(re.search(rb"x264 - core .*? options: ([ -~]+)", movie.read_bytes()).group(1).split())
        self.assertEqual(*settings, "the codec's settings are the same")

    def test_text(self):
        run = self.succeeds("bench", "e2e", "clip.mp4", "--runs", "1", "--device", "cpu")
        for word in ("ratio", "ffmpeg, transcode", "virga rain", "rendering"):
            self.assertIn(word, run.out)
        self.assertFalse(list(self.folder.glob("plain.*")))

    def test_refusals(self):
        self.refused(3, ["no.mp4"], "bench", "e2e", "no.mp4")
        self.refused(2, ["--codec 'prores_ks'", "CRF", "libx264"], "bench", "e2e", "clip.mp4", "--codec", "prores_ks")
        self.refused(3, ["virga", "failed", "--rate"], "bench", "e2e", "clip.mp4", "--runs", "1", "--", "--rate", "-1")
        self.refused(3, ["'ffmpeg' cannot be started"], "bench", "e2e", "clip.mp4", env={"PATH": "/nowhere"})
        self.refused(2, ["MOVIE", "required"], "bench", "e2e")


class Refusals(CliTest):
    def test_noPart(self):
        self.refused(2, ["no part is given", "curves", "--help"], "bench")

    def test_unknownPart(self):
        self.refused(2, ["'curve' is not a part of 'virga bench'", "did you mean 'curves'?"], "bench", "curve")

    def test_unknownKnob(self):
        self.refused(2, ["--only 'treshold'", "did you mean 'threshold'", "layers"],
                     "bench", "curves", "-o", "x", "--only", "treshold", *TINY)

    def test_unknownPaper(self):
        self.refused(2, ["--only 'garg'", "wang, nvidia, rousseau"], "bench", "tables", "--only", "garg")

    def test_ranges(self):
        for flag, value in (("--columns", "15"), ("--columns", "wide"), ("--seeds", "0"), ("--opacity", "-1"), ("--values", "a")):
            self.refused(2, [flag, value], "bench", "curves", "-o", "x", flag, value)

    def test_noSample(self):
        self.refused(3, ["nowhere", "street.mp4"], "bench", "curves", "-o", "x", "--samples", "nowhere", "--footage", "")

    def test_noFolderToWriteTo(self):
        (self.folder / "file").write_text("")
        self.refused(5, ["'file/x'"], "bench", "curves", "-o", "file/x", "--only", "blur", *TINY)
        (self.folder / "file").unlink()


if __name__ == "__main__":
    unittest.main()
