"""Exit code 4, and what needs no device at all."""
import unittest

from support import OFF, CliTest, Run, street, writeImage

# Two ways to have no OpenGL: no EGL implementation, and one whose drivers are missing.
NO_EGL = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}
NO_DRIVERS = {"LIBGL_DRIVERS_PATH": "/nonexistent"}


class Devices(CliTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "still.exr", street())
        cls.devices = Run(["info", "--json"], cls.folder).report["devices"]

    def test_rainNeedsNoOpenGL(self):
        for device in ("auto", "cpu"):
            report = self.rain("still.exr", "-o", "x.exr", "--device", device, env=NO_EGL)
            self.assertEqual(report["device"], "processor, without OpenGL")
            self.assertGreater(report["strokes_per_frame"], 0)

    def test_withoutOpenGL(self):
        self.refused(4, ["OpenGL 4.5", "--device gpu", "--device cpu"], "rain", "--quiet", "still.exr", "-o", "x.exr", "--device",
                     "gpu", env=NO_EGL)

    def test_withoutDrivers(self):
        if not all(device["software"] for device in self.devices):
            self.skipTest("a GPU's driver is not found through Mesa's path")
        self.refused(4, "OpenGL 4.5", "rain", "--quiet", "still.exr", "-o", "x.exr", "--device", "0",
                     env=NO_DRIVERS)

    def test_everyEffectOffNeedsNoOpenGL(self):
        for environment in (NO_EGL, NO_DRIVERS):
            self.assertEqual(self.rain("still.exr", "-o", "x.exr", *OFF, env=environment)["device"], "")

    def test_infoWithoutOpenGL(self):
        run = self.succeeds("info", env=NO_EGL)
        self.assertIn("no OpenGL 4.5 device", run.out)
        self.assertEqual(self.succeeds("info", "--json", env=NO_EGL).report["devices"], [])

    def test_gpu(self):
        if any(not device["software"] for device in self.devices):
            self.skipTest("this machine has a GPU")
        self.refused(4, "--device gpu", "rain", "--quiet", "still.exr", "-o", "x.exr", "--device", "gpu")

    def test_numberThatIsNotListed(self):
        self.refused(4, "--device 77", "rain", "--quiet", "still.exr", "-o", "x.exr", "--device", "77")

    def test_numberThatIsListed(self):
        for device in self.devices[:2]:
            report = self.rain("still.exr", "-o", "x.exr", "--device", device["index"])
            self.assertEqual(report["device"], device["renderer"])

    def test_shaderFolder(self):
        self.refused(4, "/nonexistent", "rain", "--quiet", "still.exr", "-o", "x.exr", "--shader-dir", "/nonexistent")


if __name__ == "__main__":
    unittest.main()
