"""EXR in, EXR out: parts, views, layers, windows, tiles, types and attributes of a plate come back, and the picture that is
rained on is the one that was asked for."""
import struct
import subprocess
import unittest

import numpy as np
import OpenImageIO as oiio
from support import CHEAP, OFF, CliTest, readImage, street

RAIN = ["--rate", "80", *CHEAP, "--splashes", "0"]
LOSSLESS = ["none", "rle", "zips", "zip", "piz"]
LOSSY = ["pxr24", "b44", "b44a", "dwaa", "dwab"]


def spec(width, height, channels, types="half", origin=(0, 0), display=None, **attributes):
    """types: one for all channels, or a list."""
    s = oiio.ImageSpec(width, height, len(channels), types if isinstance(types, str) else "float")
    s.channelnames = tuple(channels)
    if not isinstance(types, str):
        s.channelformats = tuple(oiio.TypeDesc(t) for t in types)
    s.x, s.y = origin
    s.full_x, s.full_y, s.full_width, s.full_height = display or (0, 0, width, height)
    for name, value in attributes.items():
        s.attribute(name.replace("__", ":"), value)
    return s


def write(path, *parts):
    """parts: (spec, height x width x channels array)."""
    out = oiio.ImageOutput.create(str(path))
    specs = [part[0] for part in parts]
    assert out.open(str(path), specs[0]) if len(specs) == 1 else out.open(str(path), tuple(specs)), out.geterror()
    for i, (s, pixels) in enumerate(parts):
        if i > 0:
            assert out.open(str(path), s, "AppendSubimage"), out.geterror()
        assert out.write_image(np.ascontiguousarray(pixels, np.float32)), out.geterror()
    out.close()


def read(path):
    """[(spec, pixels)] of all parts."""
    file = oiio.ImageInput.open(str(path))
    assert file, oiio.geterror()
    parts, i = [], 0
    while file.seek_subimage(i, 0):
        s = file.spec()
        # Through double, which holds every half, float and uint.
        pixels = np.asarray(file.read_image(i, 0, 0, s.nchannels, "double")).reshape(s.height, s.width, s.nchannels)
        parts.append((s, pixels))
        i += 1
    file.close()
    return parts


def windows(s):
    return (s.x, s.y, s.width, s.height), (s.full_x, s.full_y, s.full_width, s.full_height)


def noise(width, height, count, seed=1):
    return np.random.default_rng(seed).uniform(0.05, 1, (height, width, count)).astype(np.float16).astype(np.float32)


class ExrTest(CliTest):
    def through(self, *arguments, name="in.exr", out="out.exr"):
        run = self.succeeds("rain", name, "-o", out, *arguments)
        return read(self.folder / out), run.err

    def assertSameFile(self, before, after, skip=()):
        """Parts, windows, channels, types and pixels; `skip`: (part, channel) that may differ."""
        self.assertEqual(len(before), len(after))
        for i, ((a, pixelsA), (b, pixelsB)) in enumerate(zip(before, after)):
            self.assertEqual(windows(a), windows(b), i)
            self.assertEqual(a.channelnames, b.channelnames, i)
            self.assertEqual([str(a.channelformat(c)) for c in range(a.nchannels)],
                             [str(b.channelformat(c)) for c in range(b.nchannels)], i)
            self.assertEqual((a.tile_width, a.tile_height), (b.tile_width, b.tile_height), i)
            for name in ("oiio:subimagename", "view"):
                self.assertEqual(a.getattribute(name), b.getattribute(name), i)
            for c, channel in enumerate(a.channelnames):
                if (i, channel) not in skip:
                    np.testing.assert_array_equal(pixelsA[..., c], pixelsB[..., c], f"part {i}, {channel}")


class Parts(ExrTest):
    @classmethod
    def makePlates(cls):
        rgba = np.concatenate([street(48, 32)[..., :3], np.ones((32, 48, 1), np.float32)], -1)
        cls.rgba = rgba
        write(cls.folder / "parts.exr",
              (spec(48, 32, ["Z"], "float", oiio__subimagename="depth", compression="zips"), noise(48, 32, 1) * 50),
              (spec(48, 32, ["R", "G", "B", "A"], "half", oiio__subimagename="beauty", compression="piz"), rgba),
              (spec(48, 32, ["R", "G", "B"], "float", oiio__subimagename="diffuse", compression="dwaa"), noise(48, 32, 3)))
        write(cls.folder / "stereo.exr",
              (spec(48, 32, ["R", "G", "B"], "half", oiio__subimagename="rgb.left", view="left"), rgba[..., :3]),
              (spec(48, 32, ["R", "G", "B"], "half", oiio__subimagename="rgb.right", view="right"), rgba[..., :3] * 0.5))

    def test_everyPartComesBack(self):
        for name in ("parts.exr", "stereo.exr"):
            after, said = self.through(*OFF, name=name)
            self.assertSameFile(read(self.folder / name), after)
            self.assertNotIn("left out", said)
            diff = subprocess.run(["oiiotool", "-a", "--diff", self.path(name), self.path("out.exr")], capture_output=True)
            self.assertEqual(diff.returncode, 0, diff.stdout)

    def test_oneIsRainedOn(self):
        before = read(self.folder / "parts.exr")
        after, _ = self.through(*RAIN, name="parts.exr")
        self.assertSameFile(before, after, [(1, c) for c in "RGBA"])
        self.assertGreater(np.abs(before[1][1] - after[1][1]).max(), 0.001)
        after, _ = self.through(*RAIN, "--layer", "diffuse", name="parts.exr")
        self.assertSameFile(before, after, [(2, c) for c in "RGB"])
        self.assertGreater(np.abs(before[2][1] - after[2][1]).max(), 0.001)

    def test_viewsAreChosen(self):
        before = read(self.folder / "stereo.exr")
        for arguments, part in (([], 0), (["--view", "left"], 0), (["--view", "right"], 1)):
            after, _ = self.through(*RAIN, *arguments, name="stereo.exr")
            self.assertSameFile(before, after, [(part, c) for c in "RGB"])
            self.assertGreater(np.abs(before[part][1] - after[part][1]).max(), 0.001)
        self.refused(3, ["stereo.exr", "no view 'middle'", "left, right"], "rain", "--quiet", "stereo.exr", "-o", "x.exr",
                     *OFF, "--view", "middle")
        self.refused(3, ["parts.exr", "no view 'left'", "it has none"], "rain", "--quiet", "parts.exr", "-o", "x.exr", *OFF,
                     "--view", "left")
        info = self.succeeds("info", "stereo.exr").out
        self.assertIn("--view        right", info)

    def test_layersOfPartsAreChosen(self):
        write(self.folder / "choose.exr",
              (spec(8, 8, ["Z"], "float", oiio__subimagename="depth"), noise(8, 8, 1)),
              (spec(8, 8, ["R", "G", "B"], oiio__subimagename="diffuse"), noise(8, 8, 3)),
              (spec(8, 8, ["R", "G", "B"], oiio__subimagename="spec"), noise(8, 8, 3)))
        self.refused(3, ["choose.exr", "diffuse, spec", "--layer"], "rain", "--quiet", "choose.exr", "-o", "x.exr", *OFF)
        self.refused(3, ["choose.exr", "no layer 'glow'", "diffuse, spec"], "rain", "--quiet", "choose.exr", "-o", "x.exr",
                     *OFF, "--layer", "glow")

    def test_whatOtherFormatsCannotHoldIsNamed(self):
        _, said = self.through(*OFF, name="parts.exr", out="out.png")
        self.assertIn("left out of it are part depth (Z), part diffuse (R G B)", said)
        run = self.succeeds("rain", "stereo.exr", "-o", "out.mkv", *OFF)
        self.assertIn("left out of it are part rgb.right", run.err)

    def test_damageInAnotherPartIsNamed(self):
        """The picture is whole, what comes along is not: neither silently dropped nor half written."""
        write(self.folder / "cut.exr",
              (spec(48, 32, ["R", "G", "B"], "half", oiio__subimagename="rgb"), self.rgba[..., :3]),
              (spec(48, 32, ["Z"], "float", oiio__subimagename="z", compression="none"), noise(48, 32, 1)))
        data = (self.folder / "cut.exr").read_bytes()
        (self.folder / "cut.exr").write_bytes(data[:-2000])
        for arguments in (OFF, RAIN):
            self.refused(3, ["cut.exr"], "rain", "--quiet", "cut.exr", "-o", "x.exr", *arguments)

    def test_depthOutOfAnotherPart(self):
        """The plate is the first part, its depth the second."""
        foggy = ["--rate", "80", "--fog", "0.02", "--darken", "0", "--desaturate", "0", "--splashes", "0", "--depth"]
        write(self.folder / "both.exr",
              (spec(48, 32, ["R", "G", "B"], "half", oiio__subimagename="rgb"), self.rgba[..., :3]),
              (spec(48, 32, ["Z"], "float", oiio__subimagename="z"), np.full((32, 48, 1), 20)))
        write(self.folder / "flat.exr", (spec(48, 32, ["Z"], "float"), np.full((32, 48, 1), 20)))
        a = self.through(*foggy, "both.exr", name="both.exr")[0][0][1]
        b = self.through(*foggy, "flat.exr", name="both.exr")[0][0][1]
        np.testing.assert_array_equal(a, b)

    def test_layersGoBesideTheParts(self):
        before = read(self.folder / "parts.exr")
        after, _ = self.through(*RAIN, "--layers", name="parts.exr")
        self.assertEqual(len(after), 3)
        names = after[1][0].channelnames
        for channel in ("R", "A", "rain.R", "rain.A", "rain.Z", "rain.motion.x", "plate.G"):
            self.assertIn(channel, names)
        for part in (0, 2):
            np.testing.assert_array_equal(before[part][1], after[part][1])


class Views(ExrTest):
    """Two views in one part, by the names of channels."""

    @classmethod
    def makePlates(cls):
        names = ["R", "G", "B", "right.R", "right.G", "right.B", "spec.R", "spec.G", "spec.B", "Z", "id"]
        pixels = np.dstack([street(48, 32)[..., :3], street(48, 32)[..., :3] * 0.5, noise(48, 32, 5)])
        cls.names = names
        writeRaw(cls.folder / "in.exr", 48, 32, dict(zip(names, np.moveaxis(pixels, -1, 0))),
                 types={"Z": 2, "id": 0}, attributes={"multiView": ("stringvector", strings("left", "right"))})

    def test_views(self):
        before = read(self.folder / "in.exr")
        after, said = self.through(*OFF)
        self.assertSameFile(before, after)
        self.assertNotIn("left out", said)
        for arguments, changed in (([], "RGB"), (["--view", "left"], "RGB"),
                                   (["--view", "right"], ["right.R", "right.G", "right.B"]),
                                   (["--layer", "spec"], ["spec.R", "spec.G", "spec.B"])):
            after, _ = self.through(*RAIN, *arguments)
            self.assertSameFile(before, after, [(0, c) for c in changed])
            channel = before[0][0].channelnames.index(changed[0])
            self.assertGreater(np.abs(before[0][1] - after[0][1])[..., channel].max(), 0.001, arguments)


def strings(*texts):
    return b"".join(struct.pack("<i", len(t)) + t.encode() for t in texts)


def writeRaw(path, width, height, channels, types=(), attributes=(), data=None, display=None):
    """An EXR put together by hand (OpenEXR file layout), so that nobody's library stands between: {name: height x width},
    types 0 uint, 1 half (the default), 2 float; attributes {name: (type, bytes)}; windows (x, y, width, height)."""
    types, attributes = dict(types), dict(attributes)
    box = lambda w: struct.pack("<4i", w[0], w[1], w[0] + w[2] - 1, w[1] + w[3] - 1)
    x, y, w, h = data or (0, 0, width, height)
    names = sorted(channels)
    chlist = b"".join(n.encode() + b"\0" + struct.pack("<iBxxxii", types.get(n, 1), 0, 1, 1) for n in names) + b"\0"
    header = {"channels": ("chlist", chlist), "compression": ("compression", b"\0"),
              "dataWindow": ("box2i", box((x, y, w, h))), "displayWindow": ("box2i", box(display or (0, 0, width, height))),
              "lineOrder": ("lineOrder", b"\0"), "pixelAspectRatio": ("float", struct.pack("<f", 1)),
              "screenWindowCenter": ("v2f", struct.pack("<2f", 0, 0)), "screenWindowWidth": ("float", struct.pack("<f", 1)),
              **attributes}
    head = struct.pack("<ii", 20000630, 2)
    for name, (kind, value) in header.items():
        head += name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value
    head += b"\0"
    dtype = {0: np.uint32, 1: np.float16, 2: np.float32}
    lines = []
    if channels:
        for row in range(h):
            samples = b"".join(np.asarray(channels[n][row]).astype(dtype[types.get(n, 1)]).tobytes() for n in names)
            lines.append(struct.pack("<ii", y + row, len(samples)) + samples)
    offset, table = len(head) + 8 * len(lines), b""
    for line in lines:
        table += struct.pack("<Q", offset)
        offset += len(line)
    path.write_bytes(head + table + b"".join(lines))


def rawAttributes(path):
    """{name: (type, bytes)} of the first header."""
    data, at, found = path.read_bytes(), 8, {}
    text = lambda at: data[at:data.index(b"\0", at)].decode()
    while data[at]:
        name = text(at)
        at += len(name) + 1
        kind = text(at)
        at += len(kind) + 1
        size = struct.unpack_from("<i", data, at)[0]
        found[name] = (kind, data[at + 4:at + 4 + size])
        at += 4 + size
    return found


class Attributes(ExrTest):
    EVERY_TYPE = {
        "b2i": ("box2i", struct.pack("<4i", -1, 2, 3, 4)), "b2f": ("box2f", struct.pack("<4f", 0, 1, 2, 3)),
        "d": ("double", struct.pack("<d", 0.1)), "f": ("float", struct.pack("<f", 0.1)), "i": ("int", struct.pack("<i", -7)),
        "v2i": ("v2i", struct.pack("<2i", 1, 2)), "v2f": ("v2f", struct.pack("<2f", 1, 2)),
        "v2d": ("v2d", struct.pack("<2d", 1, 2)), "v3i": ("v3i", struct.pack("<3i", 1, 2, 3)),
        "v3f": ("v3f", struct.pack("<3f", 1, 2, 3)), "v3d": ("v3d", struct.pack("<3d", 1, 2, 3)),
        "m33f": ("m33f", struct.pack("<9f", *range(9))), "m33d": ("m33d", struct.pack("<9d", *range(9))),
        "m44f": ("m44f", struct.pack("<16f", *range(16))), "m44d": ("m44d", struct.pack("<16d", *range(16))),
        "rate": ("rational", struct.pack("<iI", 24000, 1001)), "timeCode": ("timecode", struct.pack("<2I", 0x01020304, 5)),
        "keyCode": ("keycode", struct.pack("<7i", 1, 2, 3, 4, 5, 6, 64)), "words": ("stringvector", strings("one", "", "two")),
        "floats": ("floatvector", struct.pack("<3f", 1, 2, 3)), "text": ("string", "löß".encode()),
        "envmap": ("envmap", b"\0"), "chromaticities": ("chromaticities", struct.pack("<8f", 0.64, 0.33, 0.3, 0.6, 0.15, 0.06,
                                                                                      0.3127, 0.329)),
        "studio.thing": ("ofOurOwn", b"\1\2\3\4\5"),
    }

    @classmethod
    def makePlates(cls):
        picture = np.moveaxis(street(24, 16)[..., :3], -1, 0)
        writeRaw(cls.folder / "in.exr", 24, 16, dict(zip("RGB", picture)), attributes=cls.EVERY_TYPE)
        writeRaw(cls.folder / "aces.exr", 24, 16, dict(zip("RGB", picture)), attributes={
            "acesImageContainerFlag": ("int", struct.pack("<i", 1)), "chromaticities": (
                "chromaticities", struct.pack("<8f", 0.7347, 0.2653, 0, 1, 0.0001, -0.077, 0.32168, 0.33767))})
        writeRaw(cls.folder / "preview.exr", 24, 16, dict(zip("RGB", picture)), attributes={
            "preview": ("preview", struct.pack("<II", 1, 1) + b"\1\2\3\xff")})

    def test_everyTypeIsKept(self):
        for arguments in (OFF, RAIN):
            self.through(*arguments)
            found = rawAttributes(self.folder / "out.exr")
            for name, value in self.EVERY_TYPE.items():
                self.assertEqual(found.get(name), value, name)

    def test_acesContainer(self):
        holds = lambda: "acesImageContainerFlag" in rawAttributes(self.folder / "out.exr")
        self.through(*OFF, name="aces.exr")
        self.assertTrue(holds())
        self.through(*RAIN, name="aces.exr")  # half, not compressed, R G B still
        self.assertTrue(holds())
        for arguments in (["--float"], ["--codec", "zip"], ["--layers"], ["--output-colorspace", "ACEScg"]):
            self.through(*RAIN, *arguments, name="aces.exr")
            self.assertFalse(holds(), arguments)

    def test_aPreviewGoesWhenThePictureChanges(self):
        self.through(*OFF, name="preview.exr")
        self.assertIn("preview", rawAttributes(self.folder / "out.exr"))
        self.through(*RAIN, name="preview.exr")
        self.assertNotIn("preview", rawAttributes(self.folder / "out.exr"))


class Windows(ExrTest):
    """Data windows inside, around and beside the display window, which need not begin at 0."""
    CASES = {"smaller": ((3, 2), (32, 24), (0, 0, 64, 48)), "larger": ((-4, -6), (72, 60), (0, 0, 64, 48)),
             "across": ((-5, 10), (40, 20), (0, 0, 64, 48)), "beside": ((100, 50), (8, 6), (0, 0, 64, 48)),
             "moved": ((10, -5), (64, 48), (10, -5, 64, 48)), "moved larger": ((8, -9), (70, 60), (10, -5, 64, 48)),
             "tall": ((-3, -40), (24, 700), (0, 0, 16, 600))}

    def plate(self, case, types="half"):
        origin, size, display = self.CASES[case]
        pixels = np.concatenate([street(*size)[..., :3], np.ones((size[1], size[0], 1), np.float32)], -1)
        write(self.folder / "in.exr", (spec(*size, ["R", "G", "B", "A"], types, origin, display), pixels))
        return read(self.folder / "in.exr")

    def test_nothingChanges(self):
        for case in self.CASES:
            with self.subTest(case):
                before = self.plate(case)
                after, _ = self.through(*OFF)
                self.assertSameFile(before, after)

    def test_withoutShortcut(self):
        """Written anew, as another type is asked for."""
        for case in self.CASES:
            with self.subTest(case):
                before = self.plate(case)
                after, _ = self.through(*OFF, "--float")
                self.assertEqual(windows(before[0][0]), windows(after[0][0]))
                self.assertEqual(str(after[0][0].format), "float")
                np.testing.assert_array_equal(before[0][1], after[0][1])

    def test_rain(self):
        for case in self.CASES:
            with self.subTest(case):
                (s, before), = self.plate(case)
                (t, after), = self.through(*RAIN)[0]
                data, display = windows(s)
                self.assertEqual(windows(t)[1], display)
                x, y = min(data[0], t.x), min(data[1], t.y)
                self.assertEqual((x, y), (t.x, t.y))
                self.assertGreaterEqual(t.x + t.width, data[0] + data[2])
                self.assertGreaterEqual(t.y + t.height, data[1] + data[3])
                placed = after[data[1] - t.y:, data[0] - t.x:][:data[3], :data[2]]
                self.assertGreater(np.abs(placed - before).max(), 0.001)

    def test_rainFallsInTheOverscan(self):
        """Inside the display window it is the picture without overscan, bit for bit; outside it goes on as if the frame were
        larger."""
        margin, size = 16, (64, 48)
        wide = np.concatenate([street(size[0] + 2 * margin, size[1] + 2 * margin)[..., :3] * 0.2], -1)
        flat = np.full((8, 16, 3), 0.5, np.float32)
        write(self.folder / "env.exr", (spec(16, 8, ["R", "G", "B"], "float"), flat))
        inner = np.s_[margin:-margin, margin:-margin]
        lens = 2 * np.degrees(np.arctan(np.tan(np.radians(30)) * (size[0] + 2 * margin) / size[0]))
        render = [*RAIN, "--env", "env.exr", "--paper", "--fov"]
        write(self.folder / "in.exr", (spec(size[0] + 2 * margin, size[1] + 2 * margin, ["R", "G", "B"], "float",
                                            (-margin, -margin), (0, 0, *size)), wide))
        over = self.through(*render, "60")[0][0][1]
        write(self.folder / "in.exr", (spec(*size, ["R", "G", "B"], "float"), wide[inner]))
        alone = self.through(*render, "60")[0][0][1]
        np.testing.assert_array_equal(over[inner], alone)
        write(self.folder / "in.exr", (spec(size[0] + 2 * margin, size[1] + 2 * margin, ["R", "G", "B"], "float"), wide))
        larger = self.through(*render, repr(float(lens)))[0][0][1]
        outside = np.ones(over.shape[:2], bool)
        outside[inner] = False
        self.assertGreater(np.abs(over - wide)[outside].max(), 0.01)
        # The sensor is as wide as the frame, so drops out of focus are a little different in the larger one.
        self.assertLess(np.abs(over - larger)[outside].mean(), 0.1 * np.abs(over - wide)[outside].mean())

    def test_acrossOtherFormats(self):
        self.plate("larger")
        _, said = self.through(*OFF, out="out.png")
        self.assertIn("overscan is left out", said)
        self.assertEqual(readImage(self.folder / "out.png")[0].shape[:2], (48, 64))


class Types(ExrTest):
    def test_deepIsRefused(self):
        subprocess.run(["oiiotool", "--create", "8x8", "5", "--chnames", "R,G,B,A,Z", "--deepen", "-o", str(self.folder / "deep.exr")],
                       check=True, capture_output=True, timeout=60)
        self.refused(3, ["deep.exr", "deep image", "flatten"], "rain", "--quiet", "deep.exr", "-o", "flat.exr", *OFF)

    def test_eachChannelItsOwn(self):
        names, kinds = ["R", "G", "B", "A", "Z", "id", "mask.x"], ["half", "half", "half", "half", "float", "uint", "half"]
        pixels = np.dstack([street(48, 32), noise(48, 32, 3)])
        write(self.folder / "in.exr", (spec(48, 32, names, kinds), pixels))
        before = read(self.folder / "in.exr")
        for arguments, skip in ((OFF, ()), (RAIN, [(0, c) for c in "RGBA"])):
            after, _ = self.through(*arguments)
            self.assertSameFile(before, after, skip)

    def test_wholeNumbersAreNoColours(self):
        write(self.folder / "uint.exr", (spec(8, 8, ["R", "G", "B"], "uint"), noise(8, 8, 3)))
        self.refused(3, ["uint.exr", "R holds whole numbers of 32 bits", "--layer"], "rain", "--quiet", "uint.exr", "-o",
                     "x.exr", *OFF)

    def test_greyStaysGrey(self):
        write(self.folder / "in.exr", (spec(48, 32, ["Y"]), street(48, 32)[..., :1]))
        after, _ = self.through(*OFF, "--float")
        self.assertEqual(after[0][0].channelnames, ("Y",))
        after, _ = self.through(*RAIN)
        self.assertEqual(after[0][0].channelnames, ("R", "G", "B"))

    def test_compressionsAndTiles(self):
        picture = street(70, 50)
        for compression in LOSSLESS + LOSSY:
            for tile in (0, 32):
                with self.subTest(compression=compression, tile=tile):
                    s = spec(70, 50, ["R", "G", "B", "A"], compression=compression)
                    s.tile_width = s.tile_height = tile
                    if tile:
                        s.tile_depth = 1
                    write(self.folder / "in.exr", (s, picture))
                    before = read(self.folder / "in.exr")
                    after, _ = self.through(*OFF)
                    self.assertSameFile(before, after)
                    self.assertEqual(after[0][0].getattribute("compression"), before[0][0].getattribute("compression"))
                    # Written anew: nothing is lost a second time.
                    after, _ = self.through(*OFF, "--float")
                    np.testing.assert_array_equal(before[0][1], after[0][1])
                    self.assertEqual(after[0][0].tile_width, tile)

    def test_manyRows(self):
        """Files are packed a few hundred rows at a time: none is lost, moved or doubled, of the picture, of layers or of what
        stands beside them."""
        picture, beside = street(20, 700), noise(20, 700, 1)
        write(self.folder / "in.exr", (spec(20, 700, ["R", "G", "B", "A", "id.X"]), np.concatenate([picture, beside], -1)))
        before = read(self.folder / "in.exr")
        after, _ = self.through(*OFF, "--float")
        np.testing.assert_array_equal(after[0][1], before[0][1])
        (s, layered), = self.through("--layers", "--float", *RAIN)[0]
        np.testing.assert_array_equal(layered[..., s.channelnames.index("id.X")], beside[..., 0])
        plate = [s.channelnames.index(f"plate.{c}") for c in "RGB"]
        np.testing.assert_allclose(layered[..., plate], before[0][1][..., :3], rtol=1e-5)
        # An EXR that is made anew, and integers.
        self.through(*OFF, out="out.png")
        (t, anew), = self.through(*OFF, "--float", name="out.png", out="anew.exr")[0]
        self.assertEqual((t.width, t.height), (20, 700))
        np.testing.assert_allclose(anew[..., :3], np.minimum(before[0][1][..., :3], 1), atol=0.001)


if __name__ == "__main__":
    unittest.main()
