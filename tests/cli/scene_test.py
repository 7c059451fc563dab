"""Depth and cameras in the forms in which other programs hand them over: the same scene, the same picture."""
import os
import subprocess
import unittest

import numpy as np
import OpenImageIO as oiio
from support import CliTest, ffmpeg, readImage, street, writeImage

WIDTH, HEIGHT, FOV = 96, 54, 60
FOCAL = 0.5 * WIDTH / np.tan(np.radians(FOV / 2))
RAIN = ["--rate", "100", "--fov", str(FOV), "--fog", "0.1", "--frames", "1-2"]


class Scene(CliTest):
    @classmethod
    def makePlates(cls):
        for frame in (1, 2):
            writeImage(cls.folder / f"shot.{frame:04d}.exr", street(WIDTH, HEIGHT, seed=frame), "half")
        y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
        # Whole centimetres, so that 16-bit integers hold it.
        cls.depth = np.round((3 + 0.05 * x + 0.2 * (HEIGHT - y)) * 100) / 100
        u, v = (x + 0.5 - WIDTH / 2) / FOCAL, (y + 0.5 - HEIGHT / 2) / FOCAL
        cls.ray = np.sqrt(1 + u * u + v * v)
        writeImage(cls.folder / "z.exr", cls.depth, "float", ["Z"])

    def picture(self, *arguments):
        self.rain("shot.%04d.exr", "-o", "o.%04d.exr", *RAIN, *arguments)
        return np.stack([readImage(self.folder / f"o.{frame:04d}.exr")[0] for frame in (1, 2)])

    def same(self, expected, *arguments, within=2e-3):
        with self.subTest(arguments=arguments):
            np.testing.assert_allclose(self.picture(*arguments), expected, atol=within)

    def write(self, name, values, kind="float", channels=None):
        writeImage(self.folder / name, values, kind, channels)

    def test_depth(self):
        expected = self.picture("--depth", "z.exr")
        self.assertGreater(np.abs(expected - self.picture("--fog-distance", "10")).max(), 0.05)
        d = self.depth
        self.write("ray.exr", d * self.ray, channels=["depth.Z"])
        self.same(expected, "--depth", "ray.exr", "--depth-kind", "distance")
        self.write("cm.png", d * 100 / 65535, "uint16")
        self.same(expected, "--depth", "cm.png", "--depth-scale", "0.01")
        self.write("offset.png", (d * 100 + 50) / 65535, "uint16")
        self.same(expected, "--depth", "offset.png", "--depth-scale", "0.01", "--depth-offset", "-0.5")
        self.write("inverse.exr", 1 / d)
        self.same(expected, "--depth", "inverse.exr", "--depth-kind", "inverse")
        self.same(expected, "--depth", "inverse.exr", "--depth-invert")
        self.write("disparity.exr", 0.1 * FOCAL / d)
        self.same(expected, "--depth", "disparity.exr", "--depth-kind", "disparity", "--depth-baseline", "0.1")
        self.write("white_near.png", (50 - d) / 49, "uint16")
        self.same(expected, "--depth", "white_near.png", "--depth-range", "50,1")
        self.write("several.exr", np.dstack([d, d * 3]), channels=["wall.Z", "floor.Z"])
        self.same(expected, "--depth", "several.exr", "--depth-channel", "wall.Z")
        self.refused(3, ["several.exr", "floor.Z, wall.Z", "--depth-channel"], "rain", "shot.0001.exr", "-o", "p.exr", "--depth",
                     "several.exr")
        self.refused(3, ["several.exr", "no channel 'Y'", "wall.Z"], "rain", "shot.0001.exr", "-o", "p.exr", "--depth",
                     "several.exr", "--depth-channel", "Y")

    def test_depthMovies(self):
        expected = self.picture("--depth", "z.exr")
        codes = np.round(self.depth * 100).astype(np.uint16)
        two = np.stack([codes, codes])
        packed = np.stack([two >> 8, two & 255, np.zeros_like(two)], -1).astype(np.uint8)
        for name, data, layout, codec in (("grey.mkv", two, "gray16le", "ffv1"), ("packed.mkv", packed, "rgb24", "ffv1"),
                                          ("lossy.mkv", packed, "rgb24", "libx264")):
            subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", layout, "-s", f"{WIDTH}x{HEIGHT}", "-i",
                            "-", "-c:v", codec, *(["-pix_fmt", "yuv420p"] if codec == "libx264" else []), self.path(name)],
                           input=data.tobytes(), check=True)
        # A movie counts from 0, the sequence from 1.
        for name, flags in (("grey.mkv", []), ("packed.mkv", ["--depth-packing", "rg"])):
            self.rain("shot.%04d.exr", "-o", "o.%04d.exr", *RAIN[:-1], "1", "--depth", name, "--depth-scale", "0.01", *flags)
            np.testing.assert_allclose(readImage(self.folder / "o.0001.exr")[0], expected[0], atol=2e-3)
        self.refused(3, ["frame 2", "grey.mkv", "0-1"], "rain", "--quiet", "shot.%04d.exr", "-o", "q.%04d.exr", *RAIN[:-1], "2",
                     "--depth", "grey.mkv")
        self.refused(3, ["lossy.mkv", "yuv420p"], "rain", "--quiet", "shot.%04d.exr", "-o", "q.%04d.exr", "--depth", "lossy.mkv",
                     "--depth-packing", "rg")

    def test_packedDepth(self):
        expected = self.picture("--depth", "z.exr")
        cm = np.round(self.depth * 100).astype(np.uint32)
        high, low = (cm >> 8) / 255, (cm & 255) / 255
        self.write("gr.png", np.dstack([low, high, 0 * low]), "uint8")
        self.same(expected, "--depth", "gr.png", "--depth-packing", "gr", "--depth-scale", "0.01")
        deep = np.round((self.depth - 0.001) / (1000 - 0.001) * 16777215).astype(np.uint32)
        words = [(deep >> shift & 255) / 255 for shift in (0, 8, 16)]
        self.write("carla.png", np.dstack(words), "uint8")
        self.same(expected, "--depth", "carla.png", "--depth-packing", "bgr", "--depth-range", "0.001,1000")
        self.write("rgb.png", np.dstack(words[::-1]), "uint8")
        self.same(expected, "--depth", "rgb.png", "--depth-packing", "rgb", "--depth-range", "0.001,1000")
        self.refused(3, ["z.exr", "2 channels of 8 bits"], "rain", "--quiet", "shot.%04d.exr", "-o", "q.%04d.exr", "--depth", "z.exr",
                     "--depth-packing", "rg")

    def test_colouredDepthSurvivesACodec(self):
        expected = self.picture("--depth", "z.exr")
        hue = np.round((self.depth - 1) / 49 * 1529)
        circle = [np.clip(np.maximum(510 - hue, hue - 1020), 0, 255), np.clip(510 - np.abs(hue - 510), 0, 255),
                  np.clip(510 - np.abs(hue - 1020), 0, 255)]
        frame = np.dstack(circle).astype(np.uint8)
        self.write("hue.png", frame / 255, "uint8")
        flags = ["--depth-packing", "hue", "--depth-range", "1,50"]
        self.same(expected, "--depth", "hue.png", *flags)
        subprocess.run(["ffmpeg", "-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{WIDTH}x{HEIGHT}", "-i", "-",
                        "-c:v", "libx264", "-crf", "10", "-pix_fmt", "yuv444p", self.path("hue.mkv")],
                       input=np.stack([frame, frame]).tobytes(), check=True)
        # Frame 0 of the movie is the shot's frame 1.
        self.same(expected, "--depth", "hue.mkv", "--depth-first-frame", "1", *flags, within=2e-2)
        self.refused(2, ["--depth-first-frame", "whole"], "rain", "--quiet", "shot.%04d.exr", "-o", "q.%04d.exr", "--depth", "hue.mkv",
                     "--depth-first-frame", "0.5")

    def test_skyOfHalfFiles(self):
        millimetres = self.depth * 1000
        millimetres[:10] = 65504
        self.write("sky.exr", millimetres, "half", ["Z"])
        report = self.rain("shot.%04d.exr", "-o", "o.%04d.exr", *RAIN, "--depth", "sky.exr", "--depth-scale", "0.001")
        self.assertEqual(report["repaired"]["depth_infinite"], 10 * WIDTH)

    def test_resumeSeesTheCameraInTheHeaders(self):
        pose = np.eye(4)
        moved = pose.copy()
        moved[0, 3] = 0.2
        rain = ["held.%04d.exr", "-o", "kept.%04d.exr", *RAIN, "--resume"]
        self.plateWithCamera("held.%04d.exr", [{"worldToCamera": pose}] * 2)
        self.rain(*rain)
        self.assertEqual(self.rain(*rain)["kept_frames"], 2)
        before = readImage(self.folder / "kept.0001.exr")[0]
        stamp = os.stat(self.path("held.0001.exr"))
        self.plateWithCamera("held.%04d.exr", [{"worldToCamera": pose}, {"worldToCamera": moved}])
        os.utime(self.path("held.0001.exr"), ns=(stamp.st_atime_ns, stamp.st_mtime_ns))  # the first file is the same
        self.assertEqual(self.rain(*rain)["kept_frames"], 0)
        self.assertGreater(np.abs(readImage(self.folder / "kept.0001.exr")[0] - before).max(), 0)

    def test_flagsThatDoNotFit(self):
        plate = ["rain", "--quiet", "shot.%04d.exr", "-o", "q.%04d.exr", "--depth", "z.exr"]
        self.refused(2, "--depth-baseline", *plate, "--depth-kind", "disparity")
        self.refused(2, "--depth-range", *plate, "--depth-range", "5,5")
        self.refused(2, "exclude", *plate, "--depth-kind", "distance", "--depth-invert")
        self.refused(2, ["--depth-kind", "z, distance, inverse or disparity"], *plate, "--depth-kind", "far")

    def test_cameras(self):
        (self.folder / "a.chan").write_text("1 0 2 0 -5 30 0 40\n2 0.5 2 -1 -5 33 0 40\n")
        expected = self.picture("--camera", "a.chan", "--ground", "2")

        def rotation(rx, ry):
            cx, sx, cy, sy = np.cos(np.radians(rx)), np.sin(np.radians(rx)), np.cos(np.radians(ry)), np.sin(np.radians(ry))
            return np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
        lines = []
        for frame, place, angles in ((1, (0, 2, 0), (-5, 30)), (2, (0.5, 2, -1), (-5, 33))):
            m = np.eye(4)
            m[:3, :3], m[:3, 3] = rotation(*angles), place
            lines.append(f"{frame} {' '.join(repr(float(v)) for v in m.reshape(-1))} 40")
        (self.folder / "m.txt").write_text("\n".join(lines) + "\n")
        self.same(expected, "--camera", "m.txt", "--ground", "2", within=1e-6)
        (self.folder / "cm.chan").write_text("11 0 200 0 -5 30 0 40\n12 50 200 -100 -5 33 0 40\n")
        self.same(expected, "--camera", "cm.chan", "--camera-scale", "0.01", "--camera-offset", "-10", "--ground", "2", within=1e-6)
        self.refused(3, ["camera.abc", "Alembic"], "rain", "--quiet", "shot.%04d.exr", "-o", "q.%04d.exr", "--camera",
                     "camera.abc")

    def plateWithCamera(self, pattern, matrices):
        """The plate with each frame's {attribute: 4x4 for column vectors} in its header."""
        for frame, attributes in zip((1, 2), matrices, strict=True):
            spec = oiio.ImageSpec(WIDTH, HEIGHT, 4, "half")
            for name, m in attributes.items():
                spec.attribute(name, oiio.TypeDesc("matrix"), tuple(float(v) for v in np.transpose(m).reshape(-1)))
            out = oiio.ImageOutput.create(self.path(pattern % frame))
            out.open(self.path(pattern % frame), spec)
            out.write_image(street(WIDTH, HEIGHT, seed=frame))
            out.close()

    def test_cameraInThePlate(self):
        (self.folder / "b.chan").write_text("1 0 2 0 0 30 0 40\n2 0.5 2 -1 0 33 0 40\n")
        rain = ["--rate", "100", "--fog", "0.1", "--frames", "1-2", "--ground", "2"]

        def picture(plate, *arguments, chatter=()):
            run = self.succeeds("rain", plate, "-o", "h.%04d.exr", *rain, *arguments)
            for words in chatter:
                self.assertIn(words, run.err)
            return np.stack([readImage(self.folder / f"h.{frame:04d}.exr")[0] for frame in (1, 2)])
        expected, standing = picture("shot.%04d.exr", "--camera", "b.chan"), picture("shot.%04d.exr")
        self.assertGreater(np.abs(expected - standing).max(), 0.03)
        f = 0.5 / np.tan(np.radians(20))
        ndc = np.array([[f * HEIGHT / WIDTH, 0, 0.5, 0], [0, -f, 0.5, 0], [0, 0, 1, -0.1], [0, 0, 1, 0]])
        ahead, pose, both = [], [], []
        for place, angle in (((0, 2, 0), 30), ((0.5, 2, -1), 33)):
            c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
            world = np.eye(4)
            world[:3, :3], world[:3, 3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]], place
            back = np.linalg.inv(world)
            ahead.append(np.diag([1, 1, -1, 1]) @ back)
            pose.append({"worldToCamera": back})
            both.append({"worldToCamera": ahead[-1], "worldToNDC": ndc @ ahead[-1]})
        self.plateWithCamera("both.%04d.exr", both)
        self.plateWithCamera("ndc.%04d.exr", [{"worldToNDC": ndc @ m} for m in ahead])
        self.plateWithCamera("pose.%04d.exr", pose)
        vertical = ["--fov", repr(float(np.degrees(2 * np.arctan(np.tan(np.radians(20)) * WIDTH / HEIGHT))))]
        for plate, arguments, said in (("both.%04d.exr", [], ["headers of 'both", "--camera none"]),
                                       ("both.%04d.exr", ["--camera", "plate"], ["headers"]), ("ndc.%04d.exr", [], ["headers"]),
                                       ("pose.%04d.exr", vertical, ["headers"])):
            with self.subTest(plate=plate, arguments=arguments):
                np.testing.assert_allclose(picture(plate, *arguments, chatter=said), expected, atol=4e-3)
        # What is asked for comes before what the header says.
        np.testing.assert_array_equal(picture("both.%04d.exr", "--camera", "none"), standing)
        np.testing.assert_array_equal(picture("both.%04d.exr", "--camera", "b.chan"), expected)
        check = self.succeeds("rain", "both.%04d.exr", "-o", "h.%04d.exr", "--check")
        self.assertIn("camera in the plate's headers with 2 poses, frames 1-2", check.out)

        self.refused(3, ["--camera plate", "shot.%04d.exr", "worldToCamera"], "rain", "--quiet", "shot.%04d.exr", "-o",
                     "q.%04d.exr", "--camera", "plate")
        self.plateWithCamera("flat.%04d.exr", [{"worldToCamera": np.diag([1, 1, 0, 1])}] * 2)
        self.refused(3, ["flat.0001.exr", "singular"], "rain", "--quiet", "flat.%04d.exr", "-o", "q.%04d.exr", "--camera", "plate")
        np.testing.assert_array_equal(picture("flat.%04d.exr", chatter=["singular", "left out"]), standing)
        self.plateWithCamera("half.%04d.exr", [both[0], {}])
        picture("half.%04d.exr", chatter=["1 of 2 frames have no camera"])


if __name__ == "__main__":
    unittest.main()
