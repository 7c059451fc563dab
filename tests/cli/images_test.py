"""Images of every format: codes, alpha, way up, grey, sequences whose frames differ, headers that lie.

VIRGA_FORMATS_OUT names a file to which each row of the table is added as a line of JSON (scripts/make_formats_page.py)."""
import json
import os
import struct
import subprocess
import unittest
import zlib

import numpy as np
import OpenImageIO as oiio
from exr_test import LOSSLESS, LOSSY, noise, read, spec, write
from support import CHEAP, OFF, CliTest, ffmpeg, readImage, street

RAIN = ["--rate", "80", *CHEAP, "--splashes", "0"]


def note(**row):
    if path := os.environ.get("VIRGA_FORMATS_OUT"):
        with open(path, "a") as file:
            file.write(json.dumps(row) + "\n")


def native(path):
    """The file's own numbers, alpha not multiplied: (spec, height x width x channels)."""
    ask = oiio.ImageSpec()
    ask.attribute("oiio:UnassociatedAlpha", 1)
    file = oiio.ImageInput.open(str(path), ask)
    assert file, oiio.geterror()
    s = file.spec()
    pixels = np.asarray(file.read_image(0, 0, 0, s.nchannels, str(s.format))).reshape(s.height, s.width, s.nchannels)
    file.close()
    return s, pixels


def store(path, pixels, kind, **attributes):
    """Numbers of the file's own type -> file. Codes of fewer bits than their type are given as they are."""
    s = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    for name, value in attributes.items():
        s.attribute(name.replace("__", ":"), value)
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), s), oiio.geterror()
    assert out.write_image(np.ascontiguousarray(pixels)), out.geterror()
    out.close()


def codes(bits, channels, width=64, height=48, seed=2):
    """Noise over every code there is; of 10 and 12 bits as OpenImageIO hands them on, repeated downwards in 16."""
    full = (1 << bits) - 1
    values = np.random.default_rng(seed).integers(0, full + 1, (height, width, channels)).astype(np.uint32)
    values.reshape(-1)[:4] = [0, full, full // 2, 1]
    if bits in (10, 12):
        values = values << (16 - bits) | values >> (2 * bits - 16)
    return values.astype(np.uint8 if bits == 8 else np.uint16)


class Formats(CliTest):
    # extension, bits, attributes; without loss: code for code through linear light and back
    EXACT = [("png", 8, {}), ("png", 16, {}), ("tif", 8, {}), ("tif", 16, {}), ("tif", 10, {}), ("tif", 12, {}),
             ("dpx", 8, {}), ("dpx", 10, {}), ("dpx", 12, {}), ("dpx", 16, {}), ("bmp", 8, {}), ("tga", 8, {}),
             ("sgi", 8, {}), ("ppm", 8, {}), ("dpx", 10, {"oiio__ColorSpace": "KodakLog"})]

    def through(self, name, out, *arguments):
        self.succeeds("rain", name, "-o", out, *OFF, *arguments)
        return native(self.folder / out)

    def test_integers(self):
        for extension, bits, attributes in self.EXACT:
            for channels in (3, 1) if extension in ("png", "tif") else (3,):
                with self.subTest(extension, bits=bits, channels=channels, **attributes):
                    pixels = codes(bits, channels)
                    store(self.folder / f"in.{extension}", pixels, "uint8" if bits == 8 else "uint16",
                          oiio__BitsPerSample=bits, **attributes)
                    before, a = native(self.folder / f"in.{extension}")
                    after, b = self.through(f"in.{extension}", f"out.{extension}")
                    self.assertEqual(before.get_int_attribute("oiio:BitsPerSample", 0),
                                     after.get_int_attribute("oiio:BitsPerSample", 0))
                    self.assertEqual((str(before.format), before.nchannels), (str(after.format), after.nchannels))
                    shift = 16 - bits if bits in (10, 12) else 0
                    np.testing.assert_array_equal(a >> shift, b >> shift)
                    self.assertEqual(a.shape[2], channels)
                    kind = "log" if attributes else "grey" if channels == 1 else "RGB"
                    note(direction="image", format=extension, samples=f"{bits} bit {kind}", how="code for code")

    def test_dpxOfFfmpeg(self):
        """Filled words of 12 bits, which others widen by zeros."""
        for form, bits in (("gbrp12le", 12), ("gbrp10be", 10)):
            ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48,noise=alls=60:all_seed=1", "-frames:v", 1, "-pix_fmt", form,
                   self.folder / "in.dpx")
            self.succeeds("rain", "in.dpx", "-o", "out.dpx", *OFF)
            _, a = native(self.folder / "in.dpx")
            _, b = native(self.folder / "out.dpx")
            np.testing.assert_array_equal(a >> (16 - bits), b >> (16 - bits))

    def test_floats(self):
        for extension, kind in (("tif", "half"), ("tif", "float"), ("exr", "half"), ("exr", "float")):
            with self.subTest(extension, kind=kind):
                pixels = np.random.default_rng(1).normal(0.2, 2, (48, 64, 4)).astype({"half": np.float16, "float": np.float32}[kind])
                pixels[..., 3] = np.clip(np.abs(pixels[..., 3]), 0, 1)
                attributes = {"tiff__half": 1} if (extension, kind) == ("tif", "half") else {}
                store(self.folder / f"in.{extension}", pixels, kind, **attributes)
                self.assertEqual(str(native(self.folder / f"in.{extension}")[0].format), kind)
                after, b = self.through(f"in.{extension}", f"out.{extension}")
                self.assertEqual(str(after.format), kind)
                np.testing.assert_array_equal(pixels, b)
                if extension == "tif":
                    note(direction="image", format=extension, samples=kind, how="bit for bit")

    def test_exrCompressions(self):
        """Of every compression: read as OpenImageIO reads it, and written so."""
        picture = street(70, 50)
        for kind in ("half", "float"):
            for tile in (0, 32):
                for compression in LOSSLESS + LOSSY:
                    with self.subTest(compression, kind=kind, tile=tile):
                        s = spec(70, 50, ["R", "G", "B", "A"], kind, compression=compression)
                        s.tile_width = s.tile_height = tile
                        s.tile_depth = 1 if tile else 0
                        write(self.folder / "in.exr", (s, picture))
                        before = read(self.folder / "in.exr")[0][1]
                        after = self.through("in.exr", "out.exr", "--codec", compression)[1]
                        bound = 0.05 if compression in LOSSY else 0
                        self.assertLessEqual(np.abs(after.astype(np.float64) - before).max(), bound)
                        how = "bit for bit; written anew within 0.05 of 1" if compression in LOSSY else "bit for bit"
                        note(direction="image", format=f"exr, {compression}", how=how,
                             samples=f"{kind} in {'tiles' if tile else 'lines'}")

    def test_withLoss(self):
        """JPEG and WebP lose something when they are written anew, and nothing when nothing happens."""
        ramp = np.zeros((48, 64, 3), np.uint8)
        ramp[:] = np.add.outer(np.arange(48), np.arange(64))[:, :, None] * 2
        for extension in ("jpg", "webp"):
            store(self.folder / f"in.{extension}", ramp, "uint8", CompressionQuality=80)
            self.succeeds("rain", f"in.{extension}", "-o", f"out.{extension}", *OFF)
            self.assertEqual((self.folder / f"in.{extension}").read_bytes(), (self.folder / f"out.{extension}").read_bytes())
            _, again = self.through(f"in.{extension}", f"out.{extension}", "--quality", "100")
            self.assertLessEqual(np.abs(again.astype(int) - native(self.folder / f"in.{extension}")[1]).max(), 6)
            note(direction="image", format=extension, samples="8 bit", how="the file itself; written anew within 6 codes of 255")
        store(self.folder / "in.hdr", np.geomspace(1e-3, 1e3, 48 * 64 * 3).astype(np.float32).reshape(48, 64, 3), "float")
        _, a = native(self.folder / "in.hdr")
        _, b = self.through("in.hdr", "out.hdr")
        np.testing.assert_array_equal(a, b)
        note(direction="image", format="hdr", samples="shared exponent", how="bit for bit")

    def test_smallAndLong(self):
        """1x1, 1xN and 16384x16."""
        for extension in ("exr", "png", "tif", "dpx", "jpg", "hdr", "webp", "tga", "bmp", "ppm", "sgi"):
            for width, height in ((1, 1), (1, 37), (16384, 16)):
                if extension == "webp" and width == 16384:
                    continue  # 16383 are most
                with self.subTest(extension, width=width, height=height):
                    pixels = np.full((height, width, 3), 128, np.uint8)
                    store(self.folder / "in.png", pixels, "uint8")
                    s, out = self.through("in.png", f"out.{extension}")
                    self.assertEqual((s.width, s.height), (width, height))
                    self.through(f"out.{extension}", "back.png")
                    back = native(self.folder / "back.png")[1]
                    self.assertLessEqual(np.abs(back / np.iinfo(back.dtype).max - 128 / 255).max(), 1 / 255)

    def test_webpTooWide(self):
        store(self.folder / "wide.png", np.zeros((2, 16384, 4), np.uint8), "uint8")
        self.refused(5, ["wide.webp", "16383"], "rain", "--quiet", "wide.png", "-o", "wide.webp", *OFF)


class Alpha(CliTest):
    """Multiplied linear 0.4 under an alpha of 0.5, through each format that has alpha, ours and OpenImageIO's."""
    # Whether the file holds 0.8 (straight) or 0.4.
    STRAIGHT = {"exr": False, "png": True, "tif": False, "tga": True, "webp": True, "sgi": False, "bmp": False, "dpx": False}
    LINEAR = ["--colorspace", "Linear Rec.709"]

    @classmethod
    def makePlates(cls):
        cls.picture = np.full((16, 16, 4), 0.4, np.float32)
        cls.picture[..., 3] = 0.5
        write(cls.folder / "in.exr", (spec(16, 16, ["R", "G", "B", "A"], "float"), cls.picture))

    def assertPicture(self, path, what):
        pixels = read(self.folder / path)[0][1]
        self.assertEqual(pixels.shape[2], 4, what)
        np.testing.assert_allclose(pixels, np.broadcast_to([0.4, 0.4, 0.4, 0.5], pixels.shape), atol=0.004, err_msg=what)

    def test_oursReadByBoth(self):
        for extension, straight in self.STRAIGHT.items():
            with self.subTest(extension):
                name = f"ours.{extension}"
                self.succeeds("rain", "in.exr", "-o", name, *OFF, "--output-colorspace", "Linear Rec.709")
                self.succeeds("rain", name, "-o", "back.exr", *OFF, *self.LINEAR, "--float")
                self.assertPicture("back.exr", extension)
                if extension == "webp":  # OpenImageIO multiplies 8-bit codes; ffmpeg hands out what the file holds
                    raw = subprocess.run(["ffmpeg", "-v", "error", "-i", self.path(name), "-f", "rawvideo", "-pix_fmt", "rgba",
                                          "-"], capture_output=True, check=True).stdout
                    held = np.frombuffer(raw, np.uint8)[:4] / 255
                else:
                    s, pixels = native(self.folder / name)
                    self.assertEqual(s.get_int_attribute("oiio:UnassociatedAlpha", 0), int(straight))
                    full = 1 if pixels.dtype.kind == "f" else np.iinfo(pixels.dtype).max
                    held = pixels[5, 5] / full
                np.testing.assert_allclose(held, [0.8 if straight else 0.4] * 3 + [0.5], atol=0.004)
                note(direction="image", format=extension, samples="alpha", how="straight" if straight else "multiplied")

    def test_oiiotoolsReadByUs(self):
        for extension in self.STRAIGHT:
            if extension == "webp":
                continue  # it writes another picture: the power of 8-bit codes
            for attribute in (0, 1) if extension == "tif" else (0,):
                with self.subTest(extension, unassociated=attribute):
                    flags = ["--unpremult", "--attrib", "oiio:UnassociatedAlpha", "1"] if attribute else []
                    subprocess.run(["oiiotool", self.path("in.exr"), *flags, "--attrib", "oiio:ColorSpace", "Linear", "-d",
                                    "float" if extension == "exr" else "uint8", "-o", self.path(f"theirs.{extension}")],
                                   check=True)
                    self.succeeds("rain", f"theirs.{extension}", "-o", "back.exr", *OFF, *self.LINEAR, "--float")
                    self.assertPicture("back.exr", extension)

    def test_tiffKeepsItsKind(self):
        """Light that covers nothing, and all codes of both kinds."""
        for straight in (0, 1):
            for bits in (8, 16):
                pixels = codes(bits, 4)
                alpha = pixels[..., 3:].astype(float) / ((1 << bits) - 1)
                if straight:
                    pixels[..., 3] = np.maximum(pixels[..., 3], 1)
                else:
                    pixels[..., :3] = pixels[..., :3] * alpha
                    pixels[0, :3] = 0
                store(self.folder / "in.tif", pixels, f"uint{bits}", oiio__UnassociatedAlpha=straight)
                self.succeeds("rain", "in.tif", "-o", "out.tif", *OFF)
                s, after = native(self.folder / "out.tif")
                self.assertEqual(s.get_int_attribute("oiio:UnassociatedAlpha", 0), straight)
                np.testing.assert_array_equal(after, pixels)
        store(self.folder / "in.tif", np.full((8, 8, 4), [90, 60, 30, 0], np.uint8), "uint8")
        self.succeeds("rain", "in.tif", "-o", "out.tif", *OFF)
        np.testing.assert_array_equal(native(self.folder / "out.tif")[1][3, 3], [90, 60, 30, 0])

    def test_darkWebp(self):
        """Dark codes under full and half alpha, which OpenImageIO's own way makes black."""
        pixels = np.zeros((32, 32, 4), np.uint8)
        pixels[..., :3] = 9
        pixels[..., 3] = 255
        pixels[:, 16:, 3] = 128
        store(self.folder / "in.png", pixels, "uint8", oiio__UnassociatedAlpha=1)
        self.succeeds("rain", "in.png", "-o", "out.webp", *OFF)
        self.succeeds("rain", "out.webp", "-o", "back.png", *OFF)
        self.assertLessEqual(np.abs(native(self.folder / "back.png")[1].astype(int) - pixels).max(), 2)


class WayUp(CliTest):
    def test_allEight(self):
        """Stored as each Orientation says, the picture comes out upright."""
        upright = np.zeros((6, 10, 3), np.uint8)
        upright[..., 0] = np.arange(10) * 20
        upright[..., 1] = np.arange(6)[:, None] * 40
        stored = {1: upright, 2: upright[:, ::-1], 3: upright[::-1, ::-1], 4: upright[::-1], 5: upright.transpose(1, 0, 2),
                  6: upright.transpose(1, 0, 2)[::-1], 7: upright.transpose(1, 0, 2)[::-1, ::-1],
                  8: upright.transpose(1, 0, 2)[:, ::-1]}
        for number, pixels in stored.items():
            store(self.folder / "in.tif", pixels, "uint8", Orientation=number)
            subprocess.run(["oiiotool", self.path("in.tif"), "--reorient", "-o", self.path("theirs.tif")], check=True)
            if number not in (5, 7):  # which oiiotool (2.4) exchanges; Exif 2.3, 4.6.4: row 0 of 5 is the left-hand side
                np.testing.assert_array_equal(native(self.folder / "theirs.tif")[1], upright, f"oiiotool {number}")
            for out in ("out.tif", "out.png"):
                self.succeeds("rain", "in.tif", "-o", out, *OFF)
                s, after = native(self.folder / out)
                np.testing.assert_array_equal(after, upright, f"{number} {out}")
                self.assertEqual(s.get_int_attribute("Orientation", 1), 1)

    def test_aPhoneStill(self):
        ramp = np.tile(np.linspace(0, 255, 64).astype(np.uint8)[:, None, None], (1, 32, 3))  # tall, dark at the top
        store(self.folder / "in.jpg", np.rot90(ramp).copy(), "uint8", Orientation=6)
        self.succeeds("rain", "in.jpg", "-o", "out.jpg", *OFF, "--quality", "100")
        s, after = native(self.folder / "out.jpg")
        self.assertEqual((s.width, s.height), (32, 64))
        self.assertLessEqual(np.abs(after.astype(int) - ramp).max(), 6)
        self.assertEqual(s.get_int_attribute("Orientation", 1), 1)
        self.succeeds("rain", "in.jpg", "-o", "same.jpg", *OFF)  # its own file, which says how it lies
        self.assertEqual((self.folder / "same.jpg").read_bytes(), (self.folder / "in.jpg").read_bytes())


class Grey(CliTest):
    def test_untilColourComes(self):
        grey = (np.random.default_rng(1).uniform(20, 200, (48, 64, 1))).astype(np.uint8)
        for extension, channels in (("png", 1), ("png", 2), ("tif", 1), ("jpg", 1)):
            with self.subTest(extension, channels=channels):
                pixels = np.dstack([grey] * channels)
                store(self.folder / f"in.{extension}", pixels, "uint8", oiio__UnassociatedAlpha=1)
                self.succeeds("rain", f"in.{extension}", "-o", f"out.{extension}", *OFF)
                s, after = native(self.folder / f"out.{extension}")
                self.assertEqual(s.nchannels, channels)
                np.testing.assert_array_equal(after, native(self.folder / f"in.{extension}")[1])
                self.succeeds("rain", f"in.{extension}", "-o", f"out.{extension}", *RAIN)
                self.assertEqual(native(self.folder / f"out.{extension}")[0].nchannels, 3 if channels == 1 else 4)


class Differing(CliTest):
    """A frame that is not as the first one."""

    def frames(self, extension, *frames):
        for path in self.folder.glob("s.*"):
            path.unlink()
        for number, (pixels, kind, attributes) in enumerate(frames, 1):
            store(self.folder / f"s.{number:04d}.{extension}", pixels, kind, **attributes)

    def test_refused(self):
        rgb, rgba = codes(8, 3), codes(8, 4)
        cases = [
            ("png", [(rgb, "uint8", {}), (rgba, "uint8", {})], ["has alpha"]),
            ("png", [(rgb, "uint8", {}), (codes(8, 3, 32), "uint8", {})], ["is 32x48", "64x48"]),
            ("tif", [(rgb, "uint8", {}), (rgb.astype(np.float32), "float", {})], ["floating point", "integers"]),
            ("exr", [(rgb.astype(np.float16), "half", {}),
                     (rgb.astype(np.float16), "half", {"colorInteropID": "lin_ap1_scene"})], ["ACEScg", "--colorspace"]),
        ]
        for extension, frames, words in cases:
            with self.subTest(words=words):
                self.frames(extension, *frames)
                run = self.virga("rain", "--quiet", f"s.%04d.{extension}", "-o", f"o.%04d.{extension}", *OFF)
                self.assertEqual(run.code, 3, run)
                for word in [f"s.0002.{extension}", *words]:
                    self.assertIn(word, run.err)

    def test_aMovieIsMadeForTheFirstDepth(self):
        self.frames("png", (codes(8, 3), "uint8", {}), (codes(16, 3), "uint16", {}))
        run = self.virga("rain", "--quiet", "s.%04d.png", "-o", "o.mkv", *OFF)
        self.assertEqual(run.code, 3, run)
        for word in ("frame 2 has 16 bits", "o.mkv", "8 of the first"):
            self.assertIn(word, run.err)
        self.assertFalse((self.folder / "o.mkv").exists())

    def test_colourIsTheUsersWord(self):
        half = np.full((8, 8, 3), 0.5, np.float16)
        self.frames("exr", (half, "half", {}), (half, "half", {"colorInteropID": "lin_ap1_scene"}))
        self.succeeds("rain", "s.%04d.exr", "-o", "o.%04d.exr", *OFF, "--colorspace", "ACEScg")

    def test_followed(self):
        """Depth of integers, alpha that a frame lacks, grey, half and float: each file is as the one it came from."""
        frames = [(codes(8, 4), "uint8", {}), (codes(16, 4), "uint16", {}), (codes(8, 3), "uint8", {}),
                  (codes(16, 1), "uint16", {})]
        for pixels, _, _ in frames[:2]:
            pixels[..., 3] = np.maximum(pixels[..., 3], 1)
        self.frames("png", *[(p, k, {"oiio__UnassociatedAlpha": 1}) for p, k, _ in frames])
        self.succeeds("rain", "s.%04d.png", "-o", "o.%04d.png", *OFF)
        for number, (pixels, kind, _) in enumerate(frames, 1):
            s, after = native(self.folder / f"o.{number:04d}.png")
            self.assertEqual(str(s.format), kind)
            np.testing.assert_array_equal(after, pixels)
        half = noise(16, 8, 3)
        self.frames("exr", (half.astype(np.float16), "half", {}), ((half * 1e6).astype(np.float32), "float", {}))
        self.succeeds("rain", "s.%04d.exr", "-o", "o.%04d.exr", *OFF)
        for number, kind in ((1, "half"), (2, "float")):
            s, after = native(self.folder / f"o.{number:04d}.exr")
            self.assertEqual(str(s.format), kind)
            np.testing.assert_array_equal(after, native(self.folder / f"s.{number:04d}.exr")[1])


class Lies(CliTest):
    """Headers that promise what is not there."""

    def png(self, width, height):
        chunk = lambda name, data: struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) +
                chunk(b"IDAT", zlib.compress(b"\0" * 50)) + chunk(b"IEND", b""))

    def test_png(self):
        (self.folder / "huge.png").write_bytes(self.png(60000, 60000))
        self.refused(3, ["huge.png", "60000x60000"], "rain", "--quiet", "huge.png", "-o", "x.png", *OFF)

    def test_exr(self):
        from exr_test import writeRaw
        for case, window in {"wide": (0, 0, 2 ** 31 - 1, 1), "tall": (0, 0, 1, 2 ** 31 - 1), "far": (-2 ** 31, -2 ** 31, 8, 8),
                             "both": (0, 0, 2 ** 30, 2 ** 30), "large": (0, 0, 300000, 300000)}.items():
            with self.subTest(case):
                writeRaw(self.folder / "lie.exr", 8, 8, dict.fromkeys("RGB", np.zeros((8, 8))))
                data = bytearray((self.folder / "lie.exr").read_bytes())
                at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
                x, y, w, h = window
                struct.pack_into("<4i", data, at, x, y, x + w - 1, y + h - 1)
                (self.folder / "lie.exr").write_bytes(data)
                self.refused(3, ["lie.exr"], "rain", "--quiet", "lie.exr", "-o", "x.exr", *OFF)

    def test_others(self):
        store(self.folder / "a.tif", codes(8, 3), "uint8")
        data = bytearray((self.folder / "a.tif").read_bytes())
        for tag in (256, 257):  # ImageWidth, ImageLength
            at = data.index(struct.pack("<HH", tag, 4) + struct.pack("<I", 1)) if struct.pack("<HHI", tag, 4, 1) in data else \
                data.index(struct.pack("<HHI", tag, 3, 1))
            struct.pack_into("<HHII", data, at, tag, 4, 1, 400000)
        (self.folder / "lie.tif").write_bytes(data)
        self.refused(3, ["lie.tif"], "rain", "--quiet", "lie.tif", "-o", "x.tif", *OFF)
        (self.folder / "lie.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 400000 +X 400000\n" + b"\0" * 50)
        self.refused(3, ["lie.hdr", "400000x400000"], "rain", "--quiet", "lie.hdr", "-o", "x.hdr", *OFF)

    def test_aMovieIsNoImage(self):
        """OpenImageIO opens movies through FFmpeg; whoever asks for an image gets none."""
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:d=0.2", self.folder / "clip.mp4")
        (self.folder / "clip.mp4").rename(self.folder / "clip.png")
        self.refused(3, ["clip.png", "not an image"], "rain", "--quiet", "clip.png", "-o", "x.png", *OFF)


if __name__ == "__main__":
    unittest.main()
