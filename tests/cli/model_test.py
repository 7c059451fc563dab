"""virga model: fields, numbers against the reference tables, what is refused, the charts."""
import json
import math
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np

from support import CliTest, writeImage

DATA = Path(__file__).resolve().parent.parent / "data"
MODELS = ["transfer", "fresnel", "shape", "airlight", "velocity", "sizes", "extinction", "radiance"]


def table(name):
    return json.loads((DATA / name).read_text())


class ModelTest(CliTest):
    def model(self, *arguments):
        return self.succeeds("model", *arguments, "--json").report

    def near(self, found, expected, tolerance, relative=False):
        found, expected = np.asarray(found, float), np.asarray(expected, float)
        self.assertEqual(found.shape, expected.shape)
        error = np.abs(found - expected) / (np.abs(expected) if relative else 1)
        self.assertLessEqual(error.max(), tolerance)


class Transfer(ModelTest):
    def test_fields(self):
        report = self.model("transfer")
        self.assertEqual(report["n"], 1.333)
        self.assertEqual(report["order"], len(report["f"]) - 1)
        self.assertEqual(report["terms"], "inf")
        self.near(report["f"][0], 1, 1e-12)
        self.assertEqual(report["g"], report["f"][1])
        self.near(sum(report["energy_by_path"]) + report["energy_beyond"], 1, 1e-12)
        self.assertEqual(len(report["angle_deg"]), len(report["D_per_sr"]))
        # The means of D over equal steps of the angle, times their solid angles, are all of the light.
        edges = np.linspace(0, math.pi, 181)
        self.near(np.dot(report["D_per_sr"], 2 * math.pi * (np.cos(edges[:-1]) - np.cos(edges[1:]))), 1, 1e-12)

    def test_referenceNumbers(self):
        numbers = table("transfer_zonal.json")
        for model, flags in (("polar", []), ("paper", ["--paper"])):
            for terms, key in (("9", "terms_9"), ("inf", "terms_all")):
                report = self.model("transfer", "--order", "64", "--terms", terms, *flags)
                self.near(report["f"], numbers[model][key], 1e-13)
                self.near(np.cumsum(report["energy_by_path"][:9]), numbers[model]["energy_of_first"], 1e-14)

    def test_otherIndicesOrdersAndTerms(self):
        for other in table("transfer_zonal.json")["others"][::3]:  # the rest in tests/optics
            report = self.model("transfer", "--n", other["index"], "--order", other["order"], "--terms",
                                other["terms"] or "inf", *(["--paper"] if other["model"] == "paper" else []))
            self.assertEqual(len(report["f"]), other["order"] + 1)
            self.near([report["f"][l] for l in other["l"]], other["f"], 1e-12)
            count = min(6, len(report["energy_by_path"]))
            self.near(report["energy_by_path"][:count], other["energy"][:count], 1e-13)

    def test_paperHasNineTermsUnlessTold(self):
        self.assertEqual(self.model("transfer", "--paper")["terms"], 9)
        self.assertEqual(self.model("transfer", "--paper", "--terms", "inf")["terms"], "inf")
        self.assertEqual(len(self.model("transfer", "--terms", "3")["energy_by_path"]), 3)

    def test_lowestOrder(self):
        report = self.model("transfer", "--order", "0", "--bins", "0")
        self.assertEqual(len(report["f"]), 1)
        self.near(report["g"], self.model("transfer")["g"], 1e-14)
        self.assertEqual(report["D_per_sr"], [])

    def test_refused(self):
        for flag, value in (("--n", "1"), ("--order", "2.5"), ("--terms", "0"), ("--terms", "all")):
            self.refused(2, [flag, f"'{value}'", "must be"], "model", "transfer", flag, value)


class Surface(ModelTest):
    def test_fresnelReferenceNumbers(self):
        numbers = table("fresnel.json")
        report = self.model("fresnel", "--angles", ",".join(map(str, numbers["angle_deg"])))
        self.assertEqual(report["angle_deg"], numbers["angle_deg"])
        for name in ("R", "Rs", "Rp"):
            self.near(report[name], numbers[name], 1e-14)
        self.near(report["brewster_deg"], numbers["brewster_deg"], 1e-12)
        self.near(report["critical_deg"], numbers["critical_deg"], 1e-12)

    def test_fromWithinTheWater(self):
        report = self.model("fresnel", "--n", repr(1 / 1.333), "--angles", "0,48,49,90")
        self.near(report["R"][0], (0.333 / 2.333) ** 2, 1e-15)
        self.assertLess(report["R"][1], 1)
        self.assertEqual(report["R"][2:], [1, 1])
        self.near(report["critical_deg"], table("fresnel.json")["critical_deg"], 1e-12)

    def test_refused(self):
        for value in ("0,91", "1,x", "nan"):
            self.refused(2, ["--angles", f"'{value}'", "0 to 90 deg"], "model", "fresnel", "--angles", value)

    def test_airlight(self):
        # As through airlight_test.cpp: twice the distances and half the extinction is a quarter.
        near = self.model("airlight", "--extinction", "0.02", "--distance", "10", "--angles", "1,30,170")
        far = self.model("airlight", "--extinction", "0.01", "--distance", "20", "--angles", "1,30,170")
        self.near(near["airlight_per_m2"], 4 * np.array(far["airlight_per_m2"]), 1e-12, relative=True)
        cut = self.model("airlight", "--surface", "5", "--angles", "30")["airlight_per_m2"][0]
        self.assertLess(cut, self.model("airlight", "--angles", "30")["airlight_per_m2"][0])


class Rain(ModelTest):
    def test_shapeReferenceNumbers(self):
        numbers = table("microphysics.json")["shapes"]
        report = self.model("shape", "--radii", ",".join(str(s["radius_undistorted_mm"]) for s in numbers))
        self.assertEqual(report["radius_mm"], [s["radius_undistorted_mm"] for s in numbers])
        self.near(report["axis_ratio"], [s["axis_ratio_height_over_width"] for s in numbers], 1e-12)
        self.near(report["volume_mm3"], [s["sphere_volume_mm3"] for s in numbers], 1e-12, relative=True)
        self.near(report["width_mm"], [s["width_mm"] * s["factor_to_conserve_volume"] for s in numbers], 1e-11)
        f2 = np.sqrt(8 * 0.0728 / (998.2 * (1e-3 * np.array(report["radius_mm"])) ** 3)) / (2 * math.pi)
        self.near(report["oscillation_mode2_Hz"], f2, 1e-12, relative=True)

    def test_velocity(self):
        report = self.model("velocity", "--diameters", "0,0.1,1,2,5.8")
        self.assertEqual(report["diameter_mm"], [0, 0.1, 1, 2, 5.8])
        self.near(report["speed_m_s"], [0, 0.27, 4.03, 6.49, 9.17], 1e-9)
        terminal = table("microphysics.json")["terminal"]
        radii = terminal["table2_radius_mm"]
        speed = self.model("velocity", "--diameters", ",".join(str(2 * r) for r in radii))["speed_m_s"]
        self.near(speed, terminal["table2_speed"], 0.13)

    def test_theRateAskedForFalls(self):
        for rate in (1, 200):
            report = self.model("sizes", "--rate", rate)
            self.assertEqual(report["rate_mm_h"], rate)
            self.near(report["implied_rate_mm_h"], rate, 1e-11, relative=True)
            self.near(report["lambda_per_mm"], 4.1 * rate ** -0.21, 1e-12, relative=True)
            # Closed forms, less what is beyond 8 mm.
            x = 8 * report["lambda_per_mm"]
            number = report["n0_per_m3_mm"] / report["lambda_per_mm"]
            self.near(report["number_per_m3"], number * (1 - math.exp(-x)), 1e-12, relative=True)
            water = math.pi * 1e-3 * report["n0_per_m3_mm"] / report["lambda_per_mm"] ** 4
            beyond = math.exp(-x) * (1 + x + x ** 2 / 2 + x ** 3 / 6)
            self.near(report["liquid_water_g_m3"], water * (1 - beyond), 1e-11, relative=True)

    def test_marshallAndPalmerReferenceNumbers(self):
        for row in table("microphysics.json")["marshall_palmer"]:
            flags = ["--rate", row["R_mm_h"], "--marshall-palmer"]
            report = self.model("sizes", *flags)
            self.assertEqual(report["n0_per_m3_mm"], 8000)
            for name, key in (("lambda_per_mm", "Lambda_per_mm"), ("number_per_m3", "number_all_per_m3"),
                              ("number_over_0.5mm_per_m3", "number_D>0.5mm"), ("number_over_1mm_per_m3", "number_D>1mm"),
                              ("number_over_2mm_per_m3", "number_D>2mm"), ("mean_diameter_mm", "mean_D_mm"),
                              ("liquid_water_g_m3", "liquid_water_g_m3")):
                self.near(report[name], row[key], 1e-12, relative=True)
            self.near(report["implied_rate_mm_h"], row["rate_implied_Table2_mm_h"], 0.006, relative=True)
            for efficiency in (1, 2) if row["R_mm_h"] == 10 else ():
                found = self.model("extinction", *flags, "--efficiency", efficiency)
                self.assertEqual(found["efficiency"], efficiency)
                self.near(found["extinction_per_m"], row[f"extinction_per_m_Q{efficiency}"], 1e-12, relative=True)
                if efficiency == 1:
                    self.near(found["visibility_m"], row["visibility_m_5pct_contrast_Q1"], 1e-12, relative=True)

    def test_noRain(self):
        report = self.model("sizes", "--rate", "0")
        self.assertEqual([report[n] for n in ("number_per_m3", "liquid_water_g_m3", "implied_rate_mm_h")], [0, 0, 0])
        self.assertEqual(self.model("extinction", "--rate", "0")["extinction_per_m"], 0)

    def test_refused(self):
        self.refused(2, ["--rate", "'-1'", "0 to 2000 mm/h"], "model", "sizes", "--rate", "-1")
        self.refused(2, ["--radii", "'0'", "over 0, at most 10 mm"], "model", "shape", "--radii", "0")
        self.refused(2, ["--efficiency", "'x'"], "model", "extinction", "--efficiency", "x")


def directions(height):
    """Unit vectors of an equirectangular map's pixels, docs/conventions.md."""
    polar = (np.arange(height) + 0.5) / height * math.pi
    azimuth = ((np.arange(2 * height) + 0.5) / (2 * height) - 0.5) * 2 * math.pi
    polar, azimuth = np.meshgrid(polar, azimuth, indexing="ij")
    return np.stack([np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)], axis=-1)


class Radiance(ModelTest):
    views = [[0, 0, -1], [0, 1, 0], [3, 0, 0], [1e-200, 0, 0], [-0.2, -0.5, 0.7]]

    @classmethod
    def makePlates(cls):
        axes = directions(128)
        writeImage(cls.folder / "white.exr", np.full((128, 256, 3), 0.75), "float")
        # Bands 0 and 1 alone, another axis for each channel: radiance 1 + axis . direction / 2.
        writeImage(cls.folder / "linear.exr", 1 + 0.5 * axes, "float")
        (cls.folder / "views.json").write_text(json.dumps(cls.views))
        (cls.folder / "named.json").write_text(json.dumps({"directions": cls.views}))
        (cls.folder / "view.json").write_text(json.dumps({"view": cls.views}))

    def radiance(self, *arguments, views="views.json"):
        return self.model("radiance", "--directions", views, *arguments)

    def unit(self):
        views = np.array(self.views) / np.abs(self.views).max(axis=1, keepdims=True)
        return views / np.linalg.norm(views, axis=1, keepdims=True)

    def test_whiteWorldStaysWhite(self):
        for order in ("auto", "0"):
            found = self.radiance("--env", "white.exr", "--order", order)
            self.near(found["radiance"], np.full((5, 3), 0.75), 1e-6)
            self.assertEqual(found["lights"], 0)
        # The paper's 1.7 times white, but for the light beyond its nine terms.
        white = self.model("transfer", "--paper")["f"][0]
        found = self.radiance("--env", "white.exr", "--paper")
        self.assertEqual(found["order"], 3)
        self.near(found["radiance"], np.full((5, 3), 0.75 * (white + 0.7)), 1e-6)
        self.near(found["drop"], np.full((5, 3), 0.75 * white), 1e-6)
        self.near(found["background"], np.full((5, 3), 0.75), 1e-6)

    def test_aLinearWorldIsScaledByTheMeanCosine(self):
        indices = (1.331, 1.333, 1.338)
        g = [self.model("transfer", "--n", n)["g"] for n in indices]
        found = self.radiance("--env", "linear.exr", "--order", "4")
        self.near(found["direction"], self.unit(), 1e-15)
        self.near(found["radiance"], 1 + 0.5 * np.array(g) * self.unit(), 5e-5)
        self.near(found["background"], 1 + 0.5 * self.unit(), 0.007)  # half a pixel of it, at the poles
        f = self.model("transfer", "--paper")["f"]
        found = self.radiance("--env", "linear.exr", "--paper")
        self.near(found["drop"], f[0] + 0.5 * f[1] * self.unit(), 5e-5)
        self.near(found["radiance"], np.array(found["drop"]) + 0.7 * np.array(found["background"]), 1e-12)

    def test_listsOfDirections(self):
        expected = self.radiance("--env", "linear.exr")
        for name in ("named.json", "view.json"):
            self.assertEqual(self.radiance("--env", "linear.exr", views=name), expected)

    def test_badDirections(self):
        cases = {"[": "is not JSON", "[]": "must hold a list",
                 '{"other": [[0, 0, 1]]}': "must hold a list", "[[0, 0, 1], [0, 0, 0]]": "entry 1: [0,0,0]",
                 '[["a", 0, 1]]': "entry 0", "[0, 0, 1]": "entry 0: 0", "[[1e999, 0, 0]]": "bad.json"}
        for text, words in cases.items():
            with self.subTest(text=text):
                (self.folder / "bad.json").write_text(text)
                self.refused(3, ["--directions", "bad.json", words], "model", "radiance", "--env", "white.exr",
                             "--directions", "bad.json")

    def test_badInput(self):
        self.refused(3, "none.json", "model", "radiance", "--env", "white.exr", "--directions", "none.json")
        self.refused(3, ["'.'", "folder"], "model", "radiance", "--env", "white.exr", "--directions", ".")
        self.refused(3, "none.exr", "model", "radiance", "--env", "none.exr", "--directions", "views.json")
        self.refused(2, ["--env", "required"], "model", "radiance", "--directions", "views.json")
        self.refused(2, ["--order", "'-2'", "auto"], "model", "radiance", "--env", "white.exr", "--directions",
                     "views.json", "--order", "-2")


class Output(ModelTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "white.exr", np.full((32, 64, 3), 0.5), "float")
        (cls.folder / "views.json").write_text("[[0, 0, -1], [0, 1, 0]]")

    def flags(self, name):
        return ["--env", "white.exr", "--directions", "views.json"] if name == "radiance" else []

    def test_list(self):
        self.assertEqual([line.split()[0] for line in self.succeeds("model").out.splitlines()][:len(MODELS)], MODELS)
        self.assertEqual(self.model()["models"], MODELS)

    def test_pages(self):
        for name in ("transfer", "radiance"):
            page = self.succeeds("model", name, "--help").out
            self.assertIn(f"virga model {name}: ", page)
            self.assertIn("Examples:", page)
            self.assertLessEqual(max(map(len, page.splitlines())), 100, page)

    def test_tablesHoldTheNumbers(self):
        for name in ("transfer", "shape", "radiance"):
            text, report = self.succeeds("model", name, *self.flags(name)).out, self.model(name, *self.flags(name))
            for field, value in report.items():
                if name != "radiance" or field != "drop":
                    self.assertIn(field, text)
                if isinstance(value, float):
                    self.assertIn(f"{value:.6g}"[:6], text)
        self.assertIn("          1       4.03\n", self.succeeds("model", "velocity", "--diameters", "0.5,1").out)

    def test_chartsAreXmlWithTitles(self):
        for name in MODELS:
            run = self.succeeds("model", name, *self.flags(name), "--plot", "chart.svg")
            self.assertEqual(run.out, "")
            root = xml.parse(self.folder / "chart.svg").getroot()
            classes = [e.get("class") for e in root.iter("{http://www.w3.org/2000/svg}text")]
            self.assertGreaterEqual(classes.count("title"), 1, name)
            self.assertEqual(classes.count("label"), 2 * classes.count("title"), name)
            self.assertNotIn("nan", (self.folder / "chart.svg").read_text())
            self.assertEqual(self.leftovers(), [])

    def test_chartAndJson(self):
        report = self.succeeds("model", "velocity", "--plot", "speed.svg", "--json").report
        self.assertIn("speed_m_s", report)
        self.assertTrue((self.folder / "speed.svg").exists())

    def test_chartsThatCannotBeWritten(self):
        self.refused(5, ["none/x.svg", "does not exist"], "model", "fresnel", "--plot", "none/x.svg")
        self.refused(5, ["x.png", ".svg"], "model", "fresnel", "--plot", "x.png")
        self.refused(5, "white.exr", "model", "fresnel", "--plot", "white.exr/x.svg")

    def test_words(self):
        self.refused(2, ["'transfr'", "'virga model'", "did you mean 'transfer'?"], "model", "transfr")
        self.refused(2, ["'glass'", "not a model", "transfer, fresnel"], "model", "glass")
        self.refused(2, ["'--oder'", "'virga model transfer'", "did you mean '--order'?"], "model", "transfer", "--oder",
                     "3")
        self.refused(2, ["'more'", "too many"], "model", "fresnel", "more")
        self.refused(2, ["--n", "needs a value"], "model", "fresnel", "--n")


if __name__ == "__main__":
    unittest.main()
