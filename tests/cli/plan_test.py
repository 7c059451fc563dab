"""Skip what the scene doesn't need: each pass is left out with a reason, and one setting brings it."""
import re
import unittest

import numpy as np
from support import HEIGHT, WIDTH, CliTest, street, writeImage

# Rain on a bare plate and nothing else; each test turns one thing on.
BARE = """[scene]
fog = 0
splashes = 0
[grade]
darken = 0
desaturate = 0
"""


class Plan(CliTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "plate.exr", street())
        writeImage(cls.folder / "depth.exr", np.full((HEIGHT, WIDTH), 20.0), channels=["Z"])
        writeImage(cls.folder / "env.exr", np.ones((16, 32, 3)))
        (cls.folder / "lamps.toml").write_text("[[light]]\nposition = [1, 2, -5]\nintensity = [50, 40, 30]\n")
        (cls.folder / "bare.toml").write_text(BARE)
        (cls.folder / "pan.chan").write_text("0 0 0 0 0 0 0\n1 0 0 0 0 9 0\n")
        (cls.folder / "still.chan").write_text("0 0 0 0 0 0 0\n1 0 0 0 0 0 0\n")

    def plan(self, *arguments):
        """name -> (runs, reason) as --explain prints it and --json reports it; both must agree."""
        run = self.succeeds("rain", "--quiet", "--json", "--explain", "plate.exr", "-o", "out.exr", "--settings",
                            "bare.toml", *arguments)
        plan, cost = {}, {}
        for line in run.lines:
            match = re.fullmatch(r"(\S+) +(on|skipped) +(?:([\d.]+) ms)? *(.*)", line)
            self.assertTrue(match, run)
            name, state, ms, why = match.groups()
            plan[name] = (state == "on", why)
            cost[name] = ms
        skipped = run.report["skipped"]
        self.assertEqual({name: why for name, (runs, why) in plan.items() if not runs}, skipped, run)
        for name, (runs, _) in plan.items():
            self.assertFalse(not runs and (cost[name] or name in run.report["passes"]), run)
        return plan

    def checkPass(self, name, reason, *turnsOn, without=()):
        runs, why = self.plan(*without)[name]
        self.assertFalse(runs)
        self.assertEqual(why, reason)
        runs, why = self.plan(*turnsOn)[name]
        self.assertTrue(runs)
        return why

    def test_strokes(self):
        self.checkPass("strokes", "--rate is 0", "--rate", "5", without=["--rate", "0"])
        self.assertEqual(self.plan("--opacity", "0")["strokes"], (False, "--opacity is 0"))

    def test_fog(self):
        self.assertIn("0.01", self.checkPass("fog", "--fog is 0", "--fog", "0.01"))
        self.assertTrue(self.plan("--fog", "auto")["fog"][0])
        self.assertEqual(self.plan("--fog", "auto", "--rate", "0")["fog"], (False, "--fog is auto and --rate is 0"))

    def test_blur(self):
        self.assertIn("2 px", self.checkPass("blur", "--blur is 0", "--blur", "2"))

    def test_splashes(self):
        self.checkPass("splashes", "--splashes is 0", "--splashes", "1", "--ground", "1.5")
        self.assertEqual(self.plan("--splashes", "1")["splashes"], (False, "no depth and no ground to fall on"))

    def test_depth(self):
        self.assertEqual(self.checkPass("depth", "no --depth and no --ground", "--depth", "depth.exr"), "--depth")
        self.assertEqual(self.checkPass("depth", "no --depth and no --ground", "--ground", "1.5"), "--ground")
        self.assertEqual(self.plan("--depth", "depth.exr", "--rate", "0", "--darken", "0.5")["depth"],
                         (False, "nothing looks at it"))

    def test_cameraMotion(self):
        self.assertEqual(self.checkPass("camera-motion", "the camera stands still", "--camera", "pan.chan"), "--camera")
        self.assertFalse(self.plan("--camera", "still.chan")["camera-motion"][0])

    def test_backgroundBoost(self):
        self.checkPass("background-boost", "--background-boost is 0", "--background-boost", "0.5")
        self.assertEqual(self.plan("--paper")["background-boost"], (True, "--paper"))

    def test_lights(self):
        self.assertEqual(self.checkPass("lights", "no --lights", "--lights", "lamps.toml"), "'lamps.toml'")
        self.assertEqual(self.plan("--lights", "lamps.toml", "--rate", "0")["lights"], (False, "nothing is lit by them"))

    def test_layers(self):
        self.checkPass("layers", "no --layers", "--layers")
        self.assertEqual(self.plan("--layers", "--rate", "0")["layers"], (False, "the beauty is the plate"))

    def test_grade(self):
        self.checkPass("darken", "--darken and --desaturate are 0", "--darken", "0.2")
        self.checkPass("color-transfer", "no --grade-from", "--grade-from", "env.exr")
        self.assertEqual(self.plan("--grade-from", "env.exr", "--grade-amount", "0")["color-transfer"],
                         (False, "--grade-amount is 0"))

    def test_environment(self):
        self.assertEqual(self.checkPass("environment", "nothing is lit by it", "--env", "env.exr",
                                        without=["--rate", "0", "--darken", "0.5"]), "'env.exr'")
        self.assertEqual(self.plan()["environment"], (True, "made from the plate"))


if __name__ == "__main__":
    unittest.main()
