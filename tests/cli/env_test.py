"""virga env: panoramas of every shape, damaged ones, footage, and what the report and the files say of them."""
import math
import os
import struct
import sys
import unittest
import zlib
from pathlib import Path

import numpy as np
from support import VIRGA, CliTest, readImage, writeImage

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scripts"))
from measure_highlights import measure  # noqa: E402


def barePng(path, codes):
    """16-bit RGB PNG without a word of its colour space."""
    height, width, _ = codes.shape

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in codes)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def directions(width, height):
    """Unit vectors of the pixels' centres, docs/conventions.md."""
    azimuth = ((np.arange(width) + 0.5) / width - 0.5) * 2 * np.pi
    polar = (np.arange(height) + 0.5) / height * np.pi
    sin = np.sin(polar)[:, None]
    return np.stack([sin * np.sin(azimuth), np.cos(polar)[:, None] + 0 * azimuth, -sin * np.cos(azimuth)], -1)


def scene(d):
    """A smooth world, another colour in each direction."""
    return 0.5 + 0.3 * d + 0.1 * d[..., [1, 2, 0]] * d[..., [2, 0, 1]]


SPHERE = scene(directions(128, 64))


class EnvTest(CliTest):
    def env(self, *arguments):
        """virga env, which must succeed: its report, its panorama, and what it said."""
        preview = [] if "--preview" in arguments or "preview" in self.id() else ["--preview", "none"]
        run = self.succeeds("env", "--json", *arguments, "-o", "out.exr", *preview)
        report = run.report
        pixels, names = readImage(self.folder / "out.exr")
        self.assertEqual(names, ["R", "G", "B"])
        self.assertTrue(np.isfinite(pixels).all() and (pixels >= 0).all())
        self.assertEqual((report["output_width"], report["output_height"]), (pixels.shape[1], pixels.shape[0]))
        self.assertEqual(self.leftovers(), [])
        return report, pixels, run.err

    def refusedEnv(self, code, words, *arguments):
        return self.refused(code, words, "env", *arguments, "-o", "refused.exr")


class Panoramas(EnvTest):
    @classmethod
    def makePlates(cls):
        writeImage(cls.folder / "sphere.exr", SPHERE, "float")

    def make(self, name, pixels, kind="float"):
        writeImage(self.folder / name, pixels, kind)
        return name

    def test_aFullSphereStaysAsItIs(self):
        report, pixels, said = self.env("sphere.exr")
        np.testing.assert_array_equal(pixels, SPHERE.astype(np.float32))
        self.assertEqual((report["mode"], report["taken_for"]), ("panorama", "a full sphere"))
        self.assertEqual(len(report["coefficients"]), 16)
        np.testing.assert_allclose(report["mean_radiance"], [0.5] * 3, atol=1e-3)
        # Y_1-1 lies along -z's right: x, Y_11 along -z, Y_10 up; each of norm sqrt(4 pi / 3). The products have mean 0.
        x, up = np.array(report["coefficients"][1]), np.array(report["coefficients"][2])
        np.testing.assert_allclose(up, [0, 0.3 * math.sqrt(4 * math.pi / 3), 0], atol=2e-3)
        np.testing.assert_allclose(np.abs(x), [0.3 * math.sqrt(4 * math.pi / 3), 0, 0], atol=2e-3)
        self.assertGreater(report["auto_order"], 0)
        self.assertLess(report["remainder"], 0.01)
        self.assertEqual(len(said.splitlines()), 1)

    def test_previewBesideTheOutput(self):
        report, _, _ = self.env("sphere.exr")
        preview, _ = readImage(self.folder / report["preview"])
        self.assertEqual(report["preview"], "out_preview.png")
        # Four pictures, none of them flat: the last one is what drops return, the smoothest.
        contrast = [preview[top:top + 400, left:left + 800].std() for top in (28, 464) for left in (8, 816)]
        self.assertGreater(min(contrast), 0.01)
        self.assertLess(contrast[3], contrast[0])
        report, _, _ = self.env("sphere.exr", "--preview", "other.png")
        self.assertTrue((self.folder / "other.png").exists())
        os.remove(self.folder / "out_preview.png")
        self.assertNotIn("preview", self.env("sphere.exr", "--preview", "none")[0])
        self.assertFalse((self.folder / "out_preview.png").exists())

    def test_orientation(self):
        # What was ahead is then a quarter to the right, or up, or stays ahead and leans.
        d = directions(128, 64)
        for flag, degrees, old in (("--yaw", 90, np.stack([d[..., 2], d[..., 1], -d[..., 0]], -1)),
                                   ("--pitch", 90, np.stack([d[..., 0], d[..., 2], -d[..., 1]], -1)),
                                   ("--roll", 90, np.stack([-d[..., 1], d[..., 0], d[..., 2]], -1))):
            with self.subTest(flag=flag):
                _, pixels, _ = self.env("sphere.exr", flag, str(degrees))
                if flag == "--yaw":
                    np.testing.assert_allclose(pixels[32, 96], SPHERE[32, 64], atol=0.02)  # +x now, -z before
                np.testing.assert_allclose(pixels, scene(old), atol=0.01)

    def test_cubeMaps(self):
        faces = []
        u = (np.arange(64) + 0.5) / 32 - 1
        s, t = np.meshgrid(u, u)
        one = np.ones_like(s)
        # +X -X +Y -Y +Z -Z in OpenGL's left-handed axes; ours have z the other way.
        for x, y, z in ((one, -t, -s), (-one, -t, s), (s, one, t), (s, -one, -t), (s, -t, one), (-s, -t, -one)):
            d = np.stack([x, y, -z], -1)
            faces.append(scene(d / np.linalg.norm(d, axis=-1, keepdims=True)))
        horizontal, vertical = np.zeros((192, 256, 3)), np.zeros((256, 192, 3))
        for face, (x, y) in zip(faces, ((2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (3, 1))):
            horizontal[64 * y:64 * y + 64, 64 * x:64 * x + 64] = face
        for face, (x, y) in zip(faces[:5] + [faces[5][::-1, ::-1]], ((2, 1), (0, 1), (1, 0), (1, 2), (1, 1), (1, 3))):
            vertical[64 * y:64 * y + 64, 64 * x:64 * x + 64] = face
        for name, pixels in (("horizontal cross", horizontal), ("vertical cross", vertical),
                             ("horizontal strip", np.concatenate(faces, 1)), ("vertical strip", np.concatenate(faces, 0))):
            with self.subTest(layout=name):
                report, sphere, said = self.env(self.make("cube.exr", pixels))
                self.assertEqual(report["taken_for"], f"a cube map as a {name}")
                self.assertIn("unfolded", said)
                np.testing.assert_allclose(sphere, scene(directions(256, 128)), atol=0.02)
        # A band of the strip's shape has no seams.
        band = scene(directions(384, 192))[64:128]
        self.assertIn("a band of 360 x 60", self.env(self.make("band.exr", band))[0]["taken_for"])

    def test_probes(self):
        y, x = np.mgrid[0:200, 0:200]
        u, v = (x + 0.5) / 100 - 1, 1 - (y + 0.5) / 100
        r = np.hypot(u, v)
        angle = np.pi * r
        angular = np.stack([np.sin(angle) * u / r, np.sin(angle) * v / r, -np.cos(angle)], -1)
        n = np.sqrt(np.maximum(0, 1 - r ** 2))
        ball = np.stack([2 * n * u, 2 * n * v, 2 * n * n - 1], -1)
        for layout, d in (("angular", angular), ("mirrorball", ball)):
            name = self.make(layout + ".exr", np.where(r[..., None] < 1, scene(d), 0))
            self.refusedEnv(3, [name, "200 x 200", "--layout angular", "--layout mirrorball"], name)
            _, sphere, _ = self.env(name, "--layout", layout)
            truth = scene(directions(sphere.shape[1], sphere.shape[0]))
            self.assertLess(np.abs(sphere - truth)[:, sphere.shape[1] // 8:-sphere.shape[1] // 8].max(), 0.08, layout)

    def test_shapesThatAreNone(self):
        for width, height, words in ((90, 60, ["90 x 60", "--mode static"]), (128, 96, ["--layout cross"]), (30, 90, [])):
            noise = np.random.default_rng(width).uniform(0.1, 0.9, (height, width, 3))
            self.refusedEnv(3, ["shape.exr", "is no panorama", *words], self.make("shape.exr", noise))
        self.refusedEnv(3, ["sphere.exr", "cannot be", "4:3"], "sphere.exr", "--layout", "cross")
        self.refusedEnv(2, ["--layout", "'globe'", "mirrorball"], "sphere.exr", "--layout", "globe")

    def test_band(self):
        report, pixels, said = self.env(self.make("band.exr", scene(directions(192, 96))[16:80]))
        self.assertEqual(pixels.shape[:2], (96, 192))
        self.assertEqual(report["taken_for"], "a band of 360 x 120 degrees around the horizon")
        self.assertIn("filled above and below", said)

    def test_onePixel(self):
        report, pixels, _ = self.env(self.make("dot.exr", np.full((1, 1, 3), 0.25)))
        self.assertEqual((pixels.shape, report["taken_for"]), ((1, 1, 3), "a uniform sphere"))
        np.testing.assert_allclose(report["coefficients"][0], [0.25 * math.sqrt(4 * math.pi)] * 3, rtol=1e-6)
        np.testing.assert_allclose(report["coefficients"][1:], 0, atol=1e-6)

    def test_black(self):
        report, _, said = self.env(self.make("black.exr", np.zeros((32, 64, 3))))
        self.assertTrue(report["black"])
        self.assertIn("black.exr: the panorama is black", said)

    def test_noNumbers(self):
        self.refusedEnv(3, ["void.exr", "2048 pixels"], self.make("void.exr", np.full((32, 64, 3), np.nan)))

    def test_repairs(self):
        pixels = SPHERE.copy()
        pixels[3, 4, 1], pixels[5, 6], pixels[7, 8, 0] = np.nan, np.inf, -1
        report, repaired, said = self.env(self.make("odd.exr", pixels))
        found = report["repaired"]
        self.assertEqual((found["nan"], found["infinite"], found["negative"], found["clipped"]), (1, 1, 1, 0))
        self.assertIn("1 NaN and 1 infinite", said)
        np.testing.assert_allclose(repaired[3, 4], SPHERE[3, 4], atol=0.02)

    def test_onePixelOfABillion(self):
        pixels = np.full((64, 128, 3), 0.2)
        pixels[16, 32] = 1e9
        report, out, said = self.env(self.make("huge.exr", pixels))
        self.assertEqual(out[16, 32, 0], np.float32(1e9))
        self.assertIn("one pixel of 1e+09 gives", said)
        (light,) = report["lights"]
        solidAngle = 2 * math.pi / 128 * (math.cos(math.pi / 4) - math.cos(math.pi * 17 / 64))
        np.testing.assert_allclose(light["energy"], [1e9 * solidAngle] * 3, rtol=1e-2)
        self.assertAlmostEqual(light["azimuth_deg"], (32.5 / 128 - 0.5) * 360, delta=0.2)
        self.assertAlmostEqual(light["elevation_deg"], 90 - 16.5 / 64 * 180, delta=0.2)
        _, _, said = self.env("huge.exr", "--half")
        self.assertIn("half float ends at 65504", said)

    def test_sixteenBitsWithoutColourSpace(self):
        barePng(self.folder / "deep.png", np.round(SPHERE * 60000).astype(np.uint16))
        report, pixels, said = self.env("deep.png")
        self.assertIn("deep.png: 16 bits and no word of its colour space; taken for sRGB", said)
        _, linear, said = self.env("deep.png", "--colorspace", "Linear Rec.709")
        self.assertNotIn("no word", said)
        np.testing.assert_allclose(linear, SPHERE * 60000 / 65535, atol=1e-4)
        self.assertLess(pixels.mean(), 0.8 * linear.mean())

    def test_alpha(self):
        pixels = np.concatenate([SPHERE, np.ones((64, 128, 1))], 2)
        pixels[:5] = 0
        pixels[20] *= 0.5
        report, out, said = self.env(self.make("alpha.exr", pixels))
        self.assertEqual((report["repaired"]["transparent"], report["repaired"]["nan"]), (5 * 128, 0))
        self.assertIn("640 transparent pixels", said)
        np.testing.assert_allclose(out[20], SPHERE[20], atol=1e-6)
        np.testing.assert_allclose(out[2], SPHERE[5], atol=1e-6)
        pixels[...] = np.concatenate([SPHERE, np.zeros((64, 128, 1))], 2)
        _, out, said = self.env(self.make("alpha0.exr", pixels))
        self.assertIn("alpha is 0 everywhere", said)
        np.testing.assert_allclose(out, SPHERE, atol=1e-6)

    def test_flagsOutOfRange(self):
        for flag, value in (("--pitch", "91"), ("--yaw", "400"), ("--roll", "181"), ("--order", "129"), ("--width", "8"),
                            ("--light-radiance", "0"), ("--sky", "-1"), ("--fov", "171"), ("--every", "0")):
            self.refusedEnv(2, [flag, f"'{value}'"], "sphere.exr", flag, value)
        self.refusedEnv(2, ["--mode", "'spin'", "static, pan or loom"], "sphere.exr", "--mode", "spin")
        for flag, value in (("--every", "5"), ("--track", "a.chan"), ("--fov", "50"), ("--sky", "2"), ("--frames", "3")):
            self.refusedEnv(2, [flag, "one picture"], "sphere.exr", flag, value)

    def test_outputs(self):
        for output, words in (("out.jpg", ".exr"), ("none/out.exr", "none"), ("sphere.exr", "the input itself")):
            self.refused(5, [output, words], "env", "sphere.exr", "-o", output)
        self.refusedEnv(5, ["'p.jpg'", ".png"], "sphere.exr", "--preview", "p.jpg")
        self.refusedEnv(5, ["'t.txt'", ".chan"], "sphere.exr", "--mode", "static", "--track", "t.txt")

    def test_inputs(self):
        (self.folder / "text.exr").write_text("no picture\n")
        for name in ("none.exr", "text.exr", "none.mp4", "none.%04d.exr"):
            self.refusedEnv(3, name, name)


class Highlights(EnvTest):
    """A sun that 8 bits cut off."""

    @classmethod
    def makePlates(cls):
        d = directions(256, 128)
        cls.sun = d @ np.array([0.6, 0.64, -0.48]) > math.cos(math.radians(3))
        cls.truth = np.where(d[..., 1:2] > 0, [0.3, 0.4, 0.6], [0.15, 0.14, 0.12])
        cls.truth[cls.sun] = 400
        cls.energy = (d[..., 1] > -2) * np.sqrt(1 - d[..., 1] ** 2)  # relative solid angle
        srgb = np.where(cls.truth <= 0.0031308, 12.92 * cls.truth, 1.055 * np.minimum(cls.truth, 1) ** (1 / 2.4) - 0.055)
        writeImage(cls.folder / "photo.png", np.minimum(srgb, 1), "uint8")
        writeImage(cls.folder / "true.exr", cls.truth, "float")

    def test_theRadianceGiven(self):
        report, pixels, said = self.env("photo.png", "--light-radiance", "400")
        self.assertEqual(report["repaired"]["clipped"], int(self.sun.sum()))
        self.assertEqual((report["light_radiance"], report["light_radiance_is_estimate"]), (400, False))
        np.testing.assert_allclose((pixels[self.sun] @ [0.2126, 0.7152, 0.0722]), 400, rtol=0.01)
        self.assertIn("cut off at white", said)
        self.assertEqual(len(report["lights"]) > 0, True)
        np.testing.assert_allclose(pixels[~self.sun], self.truth[~self.sun], atol=0.005)

    def test_theEstimateComesFromTheGround(self):
        report, pixels, _ = self.env("photo.png")
        self.assertTrue(report["light_radiance_is_estimate"])
        # Ground of 0.14 asks for an irradiance of pi 0.14 / 0.15; the sky brings pi 0.4, the sun the rest.
        size = self.energy[self.sun].sum() * 2 * math.pi ** 2 / (256 * 128)
        expected = 1 + math.pi * (0.14 / 0.15 - 0.39) / (0.64 * size)
        self.assertAlmostEqual(report["light_radiance"] / expected, 1, delta=0.05)
        self.assertGreater(pixels[self.sun].min(), 0.5 * expected)

    def test_trueRangeIsTakenAtItsWord(self):
        report, pixels, said = self.env("true.exr")
        np.testing.assert_array_equal(pixels, self.truth.astype(np.float32))
        self.assertEqual(report["repaired"]["clipped"], 0)
        self.assertNotIn("cut off", said)

    def test_whiteAllOver(self):
        writeImage(self.folder / "white.png", np.ones((64, 128, 3)), "uint8")
        _, pixels, said = self.env("white.png")
        self.assertEqual((pixels.min(), pixels.max()), (1, 1))
        self.assertIn("too much to tell", said)


class Footage(EnvTest):
    """Sequences of a world of blocks."""

    WIDTH, HEIGHT, FOV = 240, 135, 55

    @classmethod
    def film(cls, yaw, pitch=0.0):
        focal = cls.WIDTH / 2 / math.tan(math.radians(cls.FOV / 2))
        x, y = np.meshgrid(np.arange(2 * cls.WIDTH) / 2 + 0.25 - cls.WIDTH / 2,
                           cls.HEIGHT / 2 - np.arange(2 * cls.HEIGHT) / 2 - 0.25)
        d = np.stack([x, y, np.full_like(x, -focal)], -1)
        a, b = math.radians(yaw), math.radians(pitch)
        d = d @ np.array([[1, 0, 0], [0, math.cos(b), -math.sin(b)], [0, math.sin(b), math.cos(b)]]).T
        d = d @ np.array([[math.cos(a), 0, -math.sin(a)], [0, 1, 0], [math.sin(a), 0, math.cos(a)]]).T
        d /= np.linalg.norm(d, axis=-1, keepdims=True)
        return cls.world(d).reshape(cls.HEIGHT, 2, cls.WIDTH, 2, 3).mean((1, 3))

    @staticmethod
    def world(d):
        value = np.zeros(d.shape[:2])
        for size in (7, 15, 40):
            cell = np.floor(d * size).astype(np.int64) + 64
            code = (cell[..., 0] * 131 + cell[..., 1]) * 131 + cell[..., 2]
            value += np.random.default_rng(size).uniform(0, 1, 131 ** 3)[code] / 3
        return np.stack([0.1 + 0.5 * value, 0.1 + 0.4 * value, 0.12 + 0.3 * value], -1)

    @classmethod
    def makePlates(cls):
        for i in range(10):
            writeImage(cls.folder / f"pan.{i:04d}.exr", cls.film(6 * i, 3 * math.sin(i)))
        still = cls.film(0)
        for i in range(7):
            frame = still.copy()
            frame[60:, 30 * i:30 * i + 28] = 0.9 * (i % 2)
            writeImage(cls.folder / f"still.{i:04d}.exr", frame)
            writeImage(cls.folder / f"black.{i:04d}.exr", 0 * frame)
            other = np.random.default_rng(i).uniform(0, 1, (34, 60, 3)).repeat(4, 0).repeat(4, 1)[:cls.HEIGHT]
            writeImage(cls.folder / f"cuts.{i:04d}.exr", other)
        writeImage(cls.folder / "photo.jpg", still, "uint8")

    def test_pan(self):
        report, pixels, said = self.env("pan.%04d.exr", "--track", "pan.chan", "--width", "512")
        self.assertEqual(report["mode"], "pan")
        self.assertIn("the camera turns", said)
        self.assertTrue(report["fov_is_estimate"])
        self.assertAlmostEqual(report["focal_px"] / (120 / math.tan(math.radians(self.FOV / 2))), 1, delta=0.03)
        self.assertEqual([r["frame"] for r in report["rotations"]], list(range(10)))
        for i, r in enumerate(report["rotations"]):
            self.assertAlmostEqual(r["azimuth_deg"], 6 * i, delta=0.6)
        lines = [line.split() for line in (self.folder / "pan.chan").read_text().splitlines()]
        self.assertEqual([int(line[0]) for line in lines], list(range(10)))
        self.assertAlmostEqual(float(lines[9][5]), -54, delta=0.6)
        # The world itself where two frames and more see it, 2 x 2 rays a pixel.
        truth = self.world(directions(1024, 512)).reshape(256, 2, 512, 2, 3).mean((1, 3))
        seen = np.s_[128 - 12:128 + 12, 256:256 + 77]
        self.assertLess(np.sqrt(((pixels - truth)[seen] ** 2).mean()), 0.5 * truth[seen].std())
        self.assertLess(abs(pixels[seen].mean() / truth[seen].mean() - 1), 0.05)
        # What rain takes for its camera and its light.
        self.rain("pan.%04d.exr", "-o", "rain.%04d.exr", "--frames", "0-1", "--env", "out.exr", "--camera", "pan.chan")

    def test_panThatDoesNotJoin(self):
        self.refusedEnv(3, ["cuts.%04d.exr", "could be joined", "--fov", "--mode static"], "cuts.%04d.exr", "--mode", "pan")

    def test_staticAndWhoWalksThrough(self):
        report, pixels, _ = self.env("still.%04d.exr", "--fov", "55", "--width", "1024", "--yaw", "90")
        self.assertEqual((report["mode"], report["frames"], report["fov_source"]), ("static", 7, "--fov"))
        self.assertAlmostEqual(report["rotations"][0]["azimuth_deg"], 90, places=6)
        truth = self.film(0)
        # The middle of the frame lies along +x now.
        row, column = 512 // 2 + 30, 1024 * 3 // 4
        np.testing.assert_allclose(pixels[row - 2:row + 2, column - 2:column + 2].mean((0, 1)),
                                   truth[67 + 21:67 + 25, 118:122].mean((0, 1)), atol=0.08)
        # Nothing of the walkers, who are black and 0.9: the world goes from 0.1 to 0.6.
        ahead = pixels[256 - 40:256 + 40, column - 60:column + 60]
        self.assertTrue(ahead.min() > 0.08 and ahead.max() < 0.7)

    def test_loom(self):
        run = self.succeeds("env", "--json", "pan.%04d.exr", "-o", "loom.####.exr", "--every", "4", "--width", "256")
        self.assertEqual([f["frame"] for f in run.report["files"]], [0, 4, 8])
        for number in (0, 4, 8):
            self.assertEqual(readImage(self.folder / f"loom.{number:04d}.exr")[0].shape, (128, 256, 3))
        self.assertEqual(run.report["preview"], "loom_preview.png")
        self.refusedEnv(5, ["refused.exr", "pano.####.exr"], "pan.%04d.exr", "--every", "4")

    def test_oneFrame(self):
        report, pixels, _ = self.env("pan.%04d.exr", "--frames", "3", "--width", "256")
        self.assertEqual((report["mode"], report["frame_range"]), ("static", "3"))
        report, _, _ = self.env("photo.jpg", "--mode", "static", "--width", "256")
        self.assertEqual(report["mode"], "static")

    def test_black(self):
        report, pixels, said = self.env("black.%04d.exr", "--width", "256")
        self.assertEqual((report["mode"], report["black"], pixels.max()), ("static", True, 0))
        self.assertIn("too little to tell", said)
        self.assertIn("the footage is black", said)

    def test_framesThatAreNotThere(self):
        self.refusedEnv(3, ["frames 10-12", "pan.%04d.exr", "0-9"], "pan.%04d.exr", "--frames", "5-12")

    def test_damagedFrameIsLeftOut(self):
        path = self.folder / "still.0003.exr"
        whole = path.read_bytes()
        try:
            path.write_bytes(whole[:2000])
            report, _, said = self.env("still.%04d.exr", "--width", "256")
            self.assertEqual(report["frame_range"], "0-2,4-6")
            self.assertIn("frames 3 are damaged", said)
        finally:
            path.write_bytes(whole)


class Sample(EnvTest):
    """The sample plate pans by 7.5 degrees, and its track says how."""

    def test_panOfTheSample(self):
        samples = Path(__file__).resolve().parents[2] / "samples"
        report, _, _ = self.env(samples / "street.mp4", "--width", "512", "--frames", "0-88x8,95")
        self.assertEqual((report["mode"], report["closes"]), ("pan", False))
        self.assertAlmostEqual(report["fov_deg"], 60, delta=0.5)
        truth = {int(line[0]): line for line in map(str.split, (samples / "street.chan").read_text().splitlines())}
        found = {r["frame"]: r for r in report["rotations"]}
        for frame in (0, 95):
            self.assertIn(frame, found)
        turned = found[95]["azimuth_deg"] - found[0]["azimuth_deg"]
        self.assertAlmostEqual(turned, float(truth[0][5]) - float(truth[95][5]), delta=0.1)


class RealHighlights(unittest.TestCase):
    """Panoramas of high dynamic range, cut off at white: docs/env.md has the table of all."""

    def test_moreLightAndNearerToTheTruth(self):
        folder = Path(os.environ.get("VIRGA_FOOTAGE_DIR", "")) / "hdri"
        if not folder.is_absolute() or not folder.exists():
            self.skipTest("VIRGA_FOOTAGE_DIR has no hdri")
        for name, mean, rms in (("city_square_overcast_512", (0.9, 1.05), 0.15), ("hall_lamps_512", (0.8, 1.35), 0.5)):
            with self.subTest(name):
                m = measure(VIRGA, folder / (name + ".exr"), 100)
                self.assertLess(m["clipped"][0], 0.8)
                for which in ("estimated", "given"):
                    self.assertTrue(mean[0] < m[which][0] < mean[1], m)
                    self.assertLess(m[which][1], rms)
                    self.assertLess(m[which][1], 0.5 * m["clipped"][1])


class RealFootage(EnvTest):
    """The focal length of a hand-held camera whose focal length is known."""

    def test_focalLength(self):
        frames = os.path.join(os.environ.get("VIRGA_FOOTAGE_DIR", ""), "clean-rgbd-7scenes/color/frame-%06d.jpg")
        if not os.path.exists(frames % 0):
            self.skipTest("VIRGA_FOOTAGE_DIR has no clean-rgbd-7scenes")
        report, _, _ = self.env(frames)
        self.assertEqual(report["mode"], "pan")
        # It moves by decimetres before things a metre or two away, which turning alone does not explain.
        self.assertAlmostEqual(report["focal_px"] / 585, 1, delta=0.12)


if __name__ == "__main__":
    unittest.main()
