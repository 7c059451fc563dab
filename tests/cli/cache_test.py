"""What is kept for the next run: found again, never wrong, never missed, and nothing is said of it."""
import os
import shutil
import unittest

import numpy as np
from support import CliTest, bits, street, writeImage

NAMES = ("light", "program")


class Cache(CliTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "plate.exr", street())
        env = np.full((32, 64, 3), 0.3)
        env[3, 40] = 900  # a light that is taken out and shaded by itself
        writeImage(cls.folder / "env.exr", env, kind="float")
        writeImage(cls.folder / "clipped.png", np.clip(env, 0, 1), kind="uint8")

    def setUp(self):
        shutil.rmtree(self.folder / "cache", ignore_errors=True)

    def run_(self, out, *more, cache="cache", env="env.exr"):
        run = self.succeeds("rain", "plate.exr", "-o", out, "--env", env, *more,
                            env={"XDG_CACHE_HOME": self.path(cache)})
        # Without what tells of time, and of the output's name.
        return [line for line in run.lines if not line.startswith("virga: frame") and ": 1 frame in" not in line]

    def kept(self, kind="light"):
        folder = self.folder / "cache" / "virga"
        return sorted(p for p in folder.glob(f"{kind}-*")) if folder.exists() else []

    def same(self, one, other):
        return np.array_equal(bits(self.path(one))[2], bits(self.path(other))[2])

    def test_theLightOfAPanorama(self):
        for env in ("env.exr", "clipped.png"):
            said = self.run_("none.exr", "--no-cache", env=env)
            self.assertEqual(self.kept(), [] if env == "env.exr" else self.kept())
            self.assertEqual(self.run_("first.exr", env=env), said)
            files = self.kept()
            self.assertEqual(self.run_("second.exr", env=env), said, "what was found in the panorama is said each time")
            self.assertEqual(self.kept(), files)
            self.assertTrue(self.same("none.exr", "first.exr") and self.same("none.exr", "second.exr"), env)
        self.assertEqual(len(self.kept()), 2)

    def test_anotherPanoramaOrSettingIsAnotherLight(self):
        self.run_("one.exr")
        for more in (["--env-order", "5"], ["--paper"], ["--light-radiance", "2000"]):
            self.run_("kept.exr", *more)
            self.run_("kept.exr", *more)
            self.run_("fresh.exr", "--no-cache", *more)
            self.assertTrue(self.same("kept.exr", "fresh.exr"), more)
        # What is worked into the picture later is not in it.
        before = len(self.kept())
        for more in (["--env-gain", "2"], ["--env-yaw", "40"], ["--rate", "50"]):
            self.run_("kept.exr", *more)
            self.run_("fresh.exr", "--no-cache", *more)
            self.assertTrue(self.same("kept.exr", "fresh.exr"), more)
            self.assertFalse(self.same("kept.exr", "one.exr"), more)
        self.assertEqual(len(self.kept()), before)
        # The same name and size, another content.
        panorama = self.folder / "changing.exr"
        shutil.copy(self.folder / "env.exr", panorama)
        self.run_("was.exr", env="changing.exr")
        writeImage(panorama, np.full((32, 64, 3), 0.9), kind="float")
        self.run_("is.exr", env="changing.exr")
        self.run_("fresh.exr", "--no-cache", env="changing.exr")
        self.assertTrue(self.same("is.exr", "fresh.exr"))
        self.assertFalse(self.same("is.exr", "was.exr"))

    def test_damage(self):
        self.run_("fresh.exr")
        (file,) = self.kept()
        whole = file.read_bytes()
        for damaged in (b"", whole[:100], whole[:-1], whole[:5000] + b"?" + whole[5001:]):
            file.write_bytes(damaged)
            self.run_("again.exr")
            self.assertTrue(self.same("again.exr", "fresh.exr"))
            self.assertEqual(file.read_bytes(), whole, "made anew")

    def test_whereNothingCanBeKept(self):
        said = self.run_("fresh.exr", "--no-cache")
        (self.folder / "file").write_text("no folder")
        self.assertEqual(self.run_("kept.exr", cache="file"), said)
        self.assertTrue(self.same("kept.exr", "fresh.exr"))
        if os.geteuid() != 0:
            (self.folder / "locked").mkdir(mode=0o500)
            self.assertEqual(self.run_("kept.exr", cache="locked"), said)

    def test_shaders(self):
        run = self.virga("rain", "plate.exr", "-o", "gl.exr", "--device", "0", "--no-cache",
                         env={"XDG_CACHE_HOME": self.path("cache")})
        if run.code == 4:
            self.skipTest("no OpenGL device")
        self.run_("first.exr", "--device", "0")
        self.run_("without.exr", "--device", "0", "--no-cache")
        files = self.kept("program")
        if not files:
            self.skipTest("a driver without program binaries")
        self.run_("second.exr", "--device", "0")
        self.assertEqual(self.kept("program"), files)
        self.assertTrue(self.same("first.exr", "second.exr") and self.same("first.exr", "without.exr"))


if __name__ == "__main__":
    unittest.main()
