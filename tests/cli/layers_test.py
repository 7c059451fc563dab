"""The layers add up: rain over (splash over (fog over plate)) is the beauty, to 1e-3 at half and 1e-5 at float."""
import unittest

import numpy as np
from support import HEIGHT, WIDTH, CliTest, readImage, street, writeImage

RGBA = ["R", "G", "B", "A"]
LOOK = ["--rate", "80", "--ground", "1.6", "--fog", "0.02", "--blur", "1.5", "--darken", "0.3", "--splashes", "20",
        "--layers"]


class Layers(CliTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "opaque.exr", street(), "float")
        # Light over 1, and a plate that is not opaque everywhere.
        cut = street(seed=2)
        cut[:, : WIDTH // 3] *= np.linspace(0, 1, WIDTH // 3)[None, :, None]
        cut[10:12, 60:70, :3] = 12
        writeImage(cls.folder / "cut.exr", cut, "float")

    def layers(self, plate, *arguments):
        self.rain(plate, "-o", "out.exr", *LOOK, *arguments)
        pixels, names = readImage(self.folder / "out.exr")
        self.assertEqual(len(set(names)), len(names))
        self.names = names

        def layer(name, channels=RGBA):
            return np.stack([pixels[..., names.index(f"{name}.{c}" if name else c)] for c in channels], -1).astype(np.float64)
        return layer

    @staticmethod
    def over(front, back):
        return front + (1 - front[..., 3:]) * back

    def recombined(self, layer):
        return self.over(layer("rain"), self.over(layer("splash"), self.over(layer("fog"), layer("plate"))))

    def test_names(self):
        layer = self.layers("opaque.exr")
        wanted = set(RGBA) | {f"{name}.{c}" for name in ("rain", "splash", "fog", "plate") for c in RGBA}
        wanted |= {"rain.Z", "rain.motion.x", "rain.motion.y"}
        self.assertEqual(set(self.names), wanted)
        self.assertEqual(layer("").shape, (HEIGHT, WIDTH, 4))

    def test_addUpAtHalf(self):
        for plate in ("opaque.exr", "cut.exr"):
            layer = self.layers(plate, "--half")
            error = np.abs(self.recombined(layer) - layer(""))
            # Light over 1 shines through what alpha's 11 bits leave of the layers before it: a thousandth of that light.
            self.assertLess((error / np.maximum(1, layer("plate"))).max(), 1e-3, plate)

    def test_addUpAtFloat(self):
        for plate in ("opaque.exr", "cut.exr"):
            layer = self.layers(plate, "--float")
            error = np.abs(self.recombined(layer) - layer(""))
            self.assertLess((error / np.maximum(1, layer(""))).max(), 1e-5, plate)

    def test_eachHoldsSomething(self):
        layer = self.layers("opaque.exr", "--float")
        for name in ("rain", "splash", "fog", "plate"):
            self.assertGreater(layer(name)[..., 3].max(), 0, name)
            self.assertGreaterEqual(layer(name)[..., 3].min(), 0, name)
            self.assertLessEqual(layer(name)[..., 3].max(), 1, name)
        np.testing.assert_array_equal(layer("plate")[..., 3], 1)

    def test_depthAndMotionOfTheStrokes(self):
        layer = self.layers("opaque.exr", "--float", "--wind", "0,0", "--gust", "0", "--turbulence", "0")
        rain, z, motion = layer("rain")[..., 3], layer("rain", ["Z"])[..., 0], layer("rain.motion", ["x", "y"])
        self.assertTrue((np.isfinite(z) | (z == np.inf)).all())
        there = np.isfinite(z)
        self.assertTrue(there.any())
        self.assertTrue((z[there] >= 0.5).all() and (z[there] <= 200).all())
        # A stroke fainter than 1/1024 leaves no depth (shaders/strokes_splat.glsl); a few of them can lie on each other.
        self.assertLess(rain[~there].max(), 0.01)
        self.assertGreater(rain[there].min(), 0)
        self.assertTrue(np.isfinite(motion).all())
        self.assertEqual(np.abs(motion[~there]).max(), 0)
        self.assertGreater(motion[there][:, 1].min(), 0)  # rain falls, and y goes down

    def test_withoutAnEffectItsLayerIsEmpty(self):
        self.rain("opaque.exr", "-o", "out.exr", "--rate", "0", "--fog", "0.02", "--float", "--layers")
        pixels, names = readImage(self.folder / "out.exr")
        for name in ("rain", "splash"):
            for c in RGBA:
                self.assertEqual(np.abs(pixels[..., names.index(f"{name}.{c}")]).max(), 0)
        self.assertNotIn("rain.Z", names)


if __name__ == "__main__":
    unittest.main()
