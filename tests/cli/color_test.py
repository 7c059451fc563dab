"""Colour spaces from end to end: what a file says against what ffmpeg makes of it, the report, what is written, what is
refused."""
import struct
import subprocess
import unittest
import zlib

import numpy as np
import OpenImageIO as oiio
from support import CHEAP, OFF, CliTest, Run, ffmpeg, probe, readImage, writeImage

W, H = 64, 48
BOUND = 2e-5  # of the brightest value
HLG_BOUND = 1e-4  # after the power of 1.2 there and back
PQ_BOUND = 5e-4  # zimg raises to the power 78.8 in float
# A small studio's configuration. Its linear space is ACEScg under another name.
STUDIO = """ocio_profile_version: 2
strictparsing: true
roles: {default: show_data, scene_linear: show_lin, aces_interchange: show_aces}
file_rules:
  - !<Rule> {name: Logs, extension: "*", pattern: "*_log*", colorspace: show_log}
  - !<Rule> {name: Default, colorspace: show_lin}
displays:
  none:
    - !<View> {name: Raw, colorspace: show_data}
colorspaces:
  - !<ColorSpace> {name: show_aces}
  - !<ColorSpace> {name: show_lin, to_scene_reference: !<BuiltinTransform> {style: ACEScg_to_ACES2065-1}}
  - !<ColorSpace> {name: show_log, to_scene_reference: !<BuiltinTransform> {style: ACEScct_to_ACES2065-1}}
  - !<ColorSpace> {name: show_data, isdata: true}
"""
AP1 = [0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767]


def header(path):
    return oiio.ImageInput.open(str(path)).spec()


def writeTagged(path, pixels, kind, attributes):
    """attributes: (name, type, value) or (name, value)."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, kind)
    for attribute in attributes:
        spec.attribute(*attribute)
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), spec), oiio.geterror()
    assert out.write_image(np.ascontiguousarray(pixels, np.float32)), out.geterror()
    out.close()


def png(path, *chunks):
    """4 x 4 pixels of (128, 64, 32) with extra chunks before them."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    rows = b"".join(b"\0" + bytes([128, 64, 32] * 4) for _ in range(4))
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 4, 4, 8, 2, 0, 0, 0)) +
                     b"".join(chunk(*c) for c in chunks) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def profile(description):
    """A display profile (ICC.1:2001) that is named so."""
    def numbers(*values):
        return b"".join(struct.pack(">i", round(v * 65536)) for v in values)
    text = description.encode()
    text = b"desc" + bytes(4) + struct.pack(">I", len(text) + 1) + text + bytes(1 + 78)
    curve = b"curv" + bytes(4) + struct.pack(">IHH", 1, 0x0233, 0)
    tags = {b"desc": text + bytes(-len(text) % 4), b"wtpt": b"XYZ " + bytes(4) + numbers(0.9642, 1, 0.8249),
            b"rXYZ": b"XYZ " + bytes(4) + numbers(0.5151, 0.2412, -0.0011),
            b"gXYZ": b"XYZ " + bytes(4) + numbers(0.292, 0.6922, 0.0419),
            b"bXYZ": b"XYZ " + bytes(4) + numbers(0.1571, 0.0666, 0.7841), b"rTRC": curve, b"gTRC": curve, b"bTRC": curve,
            b"cprt": b"text" + bytes(4) + b"none\0\0\0\0"}
    table, data, start = b"", b"", 128 + 4 + 12 * len(tags)
    for name, value in tags.items():
        table += name + struct.pack(">II", start + len(data), len(value))
        data += value
    head = bytearray(128)
    head[0:4] = struct.pack(">I", start + len(data))
    head[8:12], head[12:24], head[36:40] = b"\x02\x10\0\0", b"mntrRGB XYZ ", b"acsp"
    head[24:36] = struct.pack(">6H", 2020, 1, 1, 0, 0, 0)
    head[68:80] = numbers(0.9642, 1, 0.8249)
    return bytes(head) + struct.pack(">I", len(tags)) + table + data


class AgainstFfmpeg(CliTest):
    """A movie's light against zscale (zimg, another team's transforms): 4:4:4 and 12 bits, so that nothing but colour is
    compared. zimg holds the display curve of BT.709 for BT.1886, as its users on screens want it."""

    def clip(self, matrix, transfer, primaries):
        path = self.folder / f"{matrix}-{transfer}-{primaries}.mkv"
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={W}x{H}:d=1:r=2,format=gbrp12le,"
               f"zscale=m={matrix}:r=limited,format=yuv444p12le", "-frames:v", 2, "-c:v", "ffv1",
               "-colorspace", matrix, "-color_trc", transfer, "-color_primaries", primaries, "-color_range", "tv", path)
        return path

    def theirs(self, clip, matrix, transfer, primaries, outPrimaries):
        done = subprocess.run(
            ["ffmpeg", "-v", "error", "-i", str(clip), "-frames:v", "1", "-vf",
             f"zscale=min={matrix}:tin={transfer}:pin={primaries}:rin=limited:m=gbr:t=linear:p={outPrimaries}:npl=100,"
             "format=gbrpf32le", "-f", "rawvideo", "-"], check=True, capture_output=True, timeout=120)
        planes = np.frombuffer(done.stdout, np.float32).reshape(3, H, W)
        return planes[[2, 0, 1]].transpose(1, 2, 0).astype(float)  # G, B, R -> R, G, B

    def ours(self, clip, *arguments):
        report = self.rain(clip, "-o", "light.%04d.exr", "--frames", 0, "--float", *OFF, *arguments)
        return readImage(self.folder / "light.0000.exr")[0][..., :3].astype(float), report["plate"]

    def agrees(self, ours, theirs, bound, what):
        self.assertLess(np.abs(ours - theirs).max() / np.abs(theirs).max(), bound, what)
        self.assertGreater(np.abs(theirs).max(), 0.5, what)  # it is a picture

    def test_displayReferred(self):
        for matrix, transfer, primaries, space, plain in (
                ("bt709", "bt709", "bt709", "Rec.709 BT.1886", "sRGB"),
                ("smpte170m", "smpte170m", "smpte170m", "Rec.601 525 BT.1886", "Rec.601 525"),
                ("bt470bg", "smpte170m", "bt470bg", "Rec.601 625 BT.1886", "Rec.601 625"),
                ("bt2020nc", "bt2020-10", "bt2020", "Rec.2020 BT.1886", "Rec.2020"),
                ("bt709", "bt709", "smpte432", "P3-D65 BT.1886", "Display P3")):
            clip = self.clip(matrix, transfer, primaries)
            ours, plate = self.ours(clip, "--colorspace", space)
            self.assertEqual((plate["colorspace"], plate["colorspace_source"]), (space, "flag"))
            self.agrees(ours, self.theirs(clip, matrix, transfer, primaries, primaries), BOUND, space)
            if primaries != "bt709":
                ours, _ = self.ours(clip, "--colorspace", space, "--output-colorspace", "Linear Rec.709")
                self.agrees(ours, self.theirs(clip, matrix, transfer, primaries, "bt709"), BOUND, space + " to 709")
            # By its tags alone: the curve of sRGB, docs/colour.md.
            ours, plate = self.ours(clip)
            self.assertEqual(plate["colorspace"], plain)
            self.agrees(ours, self.theirs(clip, matrix, "iec61966-2-1", primaries, primaries), BOUND, plain)

    def test_pq(self):
        clip = self.clip("bt2020nc", "smpte2084", "bt2020")
        for arguments, primaries in (((), "bt2020"), (("--output-colorspace", "Linear Rec.709"), "bt709")):
            ours, plate = self.ours(clip, *arguments)
            self.assertEqual(plate["colorspace"], "Rec.2020 PQ")
            self.assertEqual(plate["colorspace_source"], "metadata: smpte2084 transfer, bt2020 primaries")
            self.agrees(ours, self.theirs(clip, "bt2020nc", "smpte2084", "bt2020", primaries), PQ_BOUND, primaries)

    def test_hlg(self):
        """zimg goes on to a display of 1000 cd/m2, by the power of 1.2 on each colour; that is taken back here."""
        clip = self.clip("bt2020nc", "arib-std-b67", "bt2020")
        ours, plate = self.ours(clip)
        self.assertEqual(plate["colorspace"], "Rec.2020 HLG")
        display = self.theirs(clip, "bt2020nc", "arib-std-b67", "bt2020", "bt2020") / 10
        self.agrees(ours, np.maximum(display, 0) ** (1 / 1.2), HLG_BOUND, "HLG")

    def test_tagsNameTheirPrimaries(self):
        """No curve brings other primaries with it; what is not supported is said."""
        for transfer, primaries, space in (("smpte2084", "bt709", "Rec.709 PQ"), ("arib-std-b67", "smpte432", "P3-D65 HLG"),
                                           ("gamma22", "bt2020", "Rec.2020 gamma 2.2"),
                                           ("gamma28", "bt470bg", "Rec.601 625 gamma 2.8"),
                                           ("bt709", "smpte431", "P3-DCI"), ("linear", "bt2020", "Linear Rec.2020")):
            clip = self.clip("bt709", transfer, primaries)
            report = Run(["info", clip, "--json"], self.folder).report
            self.assertEqual(report["colorspace"], space)
            named = {"gamma22": "bt470m", "gamma28": "bt470bg"}.get(transfer, transfer)  # as ffprobe calls them
            self.assertEqual(report["colorspace_source"], f"metadata: {named} transfer, {primaries} primaries")
            self.rain(clip, "-o", "again.mkv", *OFF, "--output-colorspace", space)
            again = probe(self.folder / "again.mkv")
            self.assertEqual((again["color_transfer"], again["color_primaries"]), (named, primaries))
        clip = self.clip("bt709", "log100", "film")
        run = self.succeeds("info", clip)
        self.assertIn("log100 transfer (not supported), film primaries (not supported)", run.out)
        self.assertIn("taken for sRGB", run.err)


class Untagged(CliTest):
    """What a plate leaves open a result with the same codes leaves open, so that both are shown alike."""

    TAGS = ("color_range", "color_space", "color_transfer", "color_primaries")

    def tags(self, name):
        return [probe(self.folder / name).get(tag) for tag in self.TAGS]

    def plate(self, name, encoder, *arguments):
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={W}x{H}:r=25:d=0.12", *encoder, *arguments, self.folder / name)

    def test_staysUntagged(self):
        for name, result, encoder in (("a.mp4", "o.mp4", ["-c:v", "libx264"]), ("a.mp4", "o.mov", ["-c:v", "libx264"]),
                                      ("a.mp4", "o.mkv", ["-c:v", "libx264"]), ("a.mkv", "o.mkv", ["-c:v", "ffv1"]),
                                      ("b.mkv", "o.mkv", ["-c:v", "libx265", "-x265-params", "log-level=none"]),
                                      ("a.mov", "o.mov", ["-c:v", "prores_ks"]), ("a.webm", "o.webm", ["-c:v", "libvpx-vp9"])):
            with self.subTest(plate=name, result=result):
                self.plate(name, [*encoder, "-pix_fmt", "yuv422p10" if "mov" in name else "yuv420p"])
                self.assertEqual(self.tags(name)[1:], [None] * 3)
                self.rain(name, "-o", result, *OFF, "--reencode")
                self.assertEqual(self.tags(result), self.tags(name))
                self.rain(name, "-o", result, *CHEAP, "--rate", "5", "--splashes", "0", "--blur", "0")
                self.assertEqual(self.tags(result), self.tags(name))

    def test_whatIsTaggedStays(self):
        """Some of it: the rest stays open."""
        self.plate("part.mp4", ["-c:v", "libx264", "-color_range", "pc", "-colorspace", "bt709"])
        for result in ("o.mp4", "o.mov", "o.mkv"):
            self.rain("part.mp4", "-o", result, *OFF, "--reencode")
            self.assertEqual(self.tags(result), ["pc", "bt709", None, None])

    def test_otherCodesAreTagged(self):
        self.plate("a.mkv", ["-c:v", "ffv1", "-pix_fmt", "gbrp"])
        self.rain("a.mkv", "-o", "o.mp4", *OFF, "--codec", "libx264", "--pixel-format", "yuv420p")
        self.assertEqual(self.tags("o.mp4")[:2], ["tv", "bt709"])
        self.plate("a.mp4", ["-c:v", "libx264", "-pix_fmt", "yuv420p"])
        self.rain("a.mp4", "-o", "o.mp4", *OFF, "--output-colorspace", "Rec.2020")
        self.assertEqual(self.tags("o.mp4")[1:], ["bt2020nc", "bt2020-10", "bt2020"])


class ChromaSites(CliTest):
    """Chroma that pixels share, for a result whose pixels share none: against zscale's bilinear, for each place of the samples."""

    KR, KB = 0.2126, 0.0722
    FRAMES = 2

    def plate(self, name, encoder, pixelFormat, size=f"{W}x{H}"):
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r=25:d={self.FRAMES / 25}", "-vf",
               f"noise=alls=30:allf=t:all_seed=4,format={pixelFormat}", *encoder, "-colorspace", "bt709", "-color_range", "tv",
               self.folder / name)

    def theirs(self, name, site, width, height):
        done = subprocess.run(["ffmpeg", "-v", "error", "-i", self.path(name), "-frames:v", "1", "-vf",
                               f"zscale=cin={site}:c=left:f=bilinear,format=yuv444p16le", "-f", "rawvideo", "-"], check=True,
                              capture_output=True)
        y, u, v = np.frombuffer(done.stdout, "<u2").reshape(3, height, width).astype(float) / 256
        y, u, v = (y - 16) / 219, (u - 128) / 224, (v - 128) / 224
        red, blue = y + 2 * (1 - self.KR) * v, y + 2 * (1 - self.KB) * u
        return np.stack([red, (y - self.KR * red - self.KB * blue) / (1 - self.KR - self.KB), blue], -1)

    def test_againstZscale(self):
        for number, site in enumerate(("left", "center", "topleft", "top", "bottomleft", "bottom")):
            for pixelFormat, size in (("yuv420p", (W, H)), ("yuv420p10", (W, H)), ("yuv422p", (W, H))):
                if pixelFormat == "yuv422p" and site != "left":
                    continue
                with self.subTest(site=site, pixelFormat=pixelFormat):
                    self.plate("p.mp4", ["-c:v", "libx264", "-qp", "0", "-x264-params", f"chromaloc={number}"], pixelFormat)
                    self.rain("p.mp4", "-o", "o.exr", *OFF, "--frames", "0", "--float", "--colorspace", "raw")
                    ours = readImage(self.folder / "o.exr")[0][..., :3]
                    # zscale rounds what lies between to 16 bits: half a code is 2.3e-6 of luma, 4.2e-6 of red and blue.
                    self.assertLess(np.abs(ours - self.theirs("p.mp4", site, *size)).max(), 1e-5)

    def test_edgesAndWideSharing(self):
        """One colour stays one colour to the last column and row, whatever shares it."""
        for pixelFormat, width, height in (("yuv420p", 37, 21), ("yuv411p", 37, 20), ("yuv410p", 39, 21), ("yuv420p", 1, 1),
                                           ("yuv422p10", 33, 3)):
            with self.subTest(pixelFormat=pixelFormat, width=width, height=height):
                ffmpeg("-f", "lavfi", "-i", "color=0x3060a0:s=64x64:r=25:d=0.04", "-vf",
                       f"scale={width}:{height},format={pixelFormat}", "-c:v", "ffv1", self.folder / "p.mkv")
                self.rain("p.mkv", "-o", "o.exr", *OFF, "--float", "--colorspace", "raw")
                ours = readImage(self.folder / "o.exr")[0][..., :3]
                self.assertEqual(ours.shape, (height, width, 3))
                self.assertLess(np.abs(ours - ours[0, 0]).max(), 1e-6)
                self.assertLess(np.abs(ours[0, 0] - [0x30 / 255, 0x60 / 255, 0xa0 / 255]).max(), 0.02)

    def test_whatIsSharedAlikeIsUntouched(self):
        """The way into the plate's own sharing repeats and averages: code for code."""
        self.plate("p.mp4", ["-c:v", "libx264", "-qp", "0"], "yuv420p")
        self.rain("p.mp4", "-o", "o.mkv", *OFF, "--codec", "ffv1")
        hashes = [subprocess.run(["ffmpeg", "-v", "error", "-i", self.path(name), "-f", "framemd5", "-"], check=True,
                                 capture_output=True, text=True).stdout.split("\n")[-self.FRAMES - 1:] for name in ("p.mp4", "o.mkv")]
        self.assertEqual(*[[line.split(",")[-1] for line in lines] for lines in hashes])

    def test_oneAxisAlone(self):
        """4:2:0 into 4:2:2: columns are shared alike, rows are not."""
        self.plate("p.mp4", ["-c:v", "libx264", "-qp", "0"], "yuv420p")
        self.rain("p.mp4", "-o", "o.mkv", *OFF, "--codec", "ffv1", "--pixel-format", "yuv422p", "--frames", "0")
        planes = [np.frombuffer(subprocess.run(["ffmpeg", "-v", "error", "-i", self.path(name), "-frames:v", "1", *extra, "-f", "rawvideo", "-"],
                                               check=True, capture_output=True).stdout, "u1").astype(int)
                  for name, extra in (("o.mkv", []), ("p.mp4", ["-vf", "zscale=cin=left:c=left:f=bilinear,format=yuv422p"]))]
        self.assertLessEqual(np.abs(planes[0] - planes[1]).max(), 1)


class WhoSays(CliTest):
    @classmethod
    def makePlates(cls):
        (cls.folder / "show.ocio").write_text(STUDIO)
        pixels = np.full((8, 8, 3), 0.25, np.float32)
        pixels[0, 0], pixels[0, 1] = (-0.125, 3, 0.001), (40, 0, -0.01)
        writeImage(cls.folder / "light.exr", pixels, "float")
        writeImage(cls.folder / "a_log.png", np.full((8, 8, 3), 0.25), "uint16")
        ap1 = ("chromaticities", "float[8]", AP1)
        writeTagged(cls.folder / "ap1.exr", pixels, "half", [ap1])
        writeTagged(cls.folder / "id.exr", pixels, "half", [ap1, ("colorInteropID", "lin_p3d65_scene")])
        writeTagged(cls.folder / "strange.exr", pixels, "half",
                    [("chromaticities", "float[8]", [0.6, 0.3, 0.2, 0.7, 0.1, 0.1, 0.3, 0.3])])
        for name, description in (("p3.jpg", "Display P3"), ("p3.png", "Display P3"), ("scanner.tif", "My Scanner")):
            icc = np.frombuffer(profile(description), np.uint8)
            writeTagged(cls.folder / name, np.full((8, 8, 3), 0.25), "uint8",
                        [("ICCProfile", f"uint8[{len(icc)}]", icc)])
        writeTagged(cls.folder / "film.dpx", np.full((8, 8, 3), 0.25), "uint16",
                    [("oiio:ColorSpace", "KodakLog"), ("oiio:BitsPerSample", 10)])
        png(cls.folder / "linear.png", (b"gAMA", struct.pack(">I", 100000)))
        png(cls.folder / "gamma22.png", (b"gAMA", struct.pack(">I", 45455)))
        png(cls.folder / "gamma18.png", (b"gAMA", struct.pack(">I", 55556)))
        png(cls.folder / "pq.png", (b"cICP", bytes([9, 16, 0, 1])))
        png(cls.folder / "said.png", (b"sRGB", b"\0"))
        png(cls.folder / "silent.png")

    def said(self, *arguments, env=None):
        report = self.succeeds("info", "--json", *arguments, env=env).report
        return report["colorspace"], report["colorspace_source"]

    def test_files(self):
        for name, space, source in (
                ("ap1.exr", "ACEScg", "metadata: chromaticities"),
                ("id.exr", "Linear P3-D65", "metadata: colorInteropID lin_p3d65_scene"),
                ("light.exr", "Linear Rec.709", "guess: floating point is linear light"),
                ("p3.jpg", "Display P3", "metadata: ICC profile 'Display P3'"),
                ("p3.png", "Display P3", "metadata: ICC profile 'Display P3'"),
                ("film.dpx", "Cineon", "metadata: KodakLog"),
                ("linear.png", "Linear Rec.709", "metadata: linear"),
                ("gamma22.png", "sRGB", "metadata: Gamma2.2"),
                ("pq.png", "Rec.2020 PQ", "metadata: smpte2084 transfer, bt2020 primaries"),
                ("said.png", "sRGB", "metadata: sRGB"),
                ("silent.png", "sRGB", "guess: integer pixels of a picture")):
            self.assertEqual(self.said(name), (space, source), name)

    def test_whatIsNotKnownIsSaid(self):
        for name, word in (("strange.exr", "chromaticities"), ("scanner.tif", "'My Scanner'"), ("gamma18.png", "Gamma1.8")):
            run = self.succeeds("info", name)
            self.assertEqual(len(run.lines), 1, run)
            self.assertRegex(run.err, rf"^virga: warning: {name}: .*{word}.*; taken for .*--colorspace says otherwise", run)

    def test_theOrder(self):
        """Flag, the file, file rules, guess; --ocio before $OCIO."""
        studio = ("--ocio", "show.ocio")
        self.assertEqual(self.said("a_log.png"), ("sRGB", "guess: integer pixels of a picture"))
        self.assertEqual(self.said("a_log.png", *studio), ("show_log", "file rules of show.ocio (--ocio)"))
        self.assertEqual(self.said("a_log.png", env={"OCIO": self.path("show.ocio")}),
                         ("show_log", f"file rules of {self.path('show.ocio')} ($OCIO)"))
        self.assertEqual(self.said("a_log.png", *studio, env={"OCIO": "/nowhere.ocio"})[0], "show_log")
        self.assertEqual(self.said("said.png", *studio), ("sRGB", "metadata: sRGB"))
        plate = self.rain("a_log.png", "-o", "out.exr", *OFF, *studio, "--colorspace", "logc4")["plate"]
        self.assertEqual([plate[k] for k in ("colorspace", "colorspace_source", "working_colorspace", "ocio")],
                         ["ARRI LogC4", "flag", "Linear ARRI Wide Gamut 4", "show.ocio (--ocio)"])

    def test_settingsFile(self):
        (self.folder / "look.toml").write_text('[file]\nocio = "show.ocio"\n')
        plate = self.rain("a_log.png", "-o", "out.exr", *OFF, "--settings", "look.toml")["plate"]
        self.assertEqual((plate["colorspace"], plate["working_colorspace"]), ("show_log", "show_lin"))

    def test_otherCommands(self):
        writeImage(self.folder / "pano_log.png", np.full((16, 32, 3), 0.5), "uint8")
        report = self.succeeds("env", "pano_log.png", "-o", "env.exr", "--ocio", "show.ocio", "--json").report
        self.assertEqual([report[k] for k in ("colorspace", "working_colorspace", "ocio")],
                         ["show_log", "show_lin", "show.ocio (--ocio)"])
        self.refused(3, ["none.ocio (--ocio)"], "extract", "a_log.png", "-o", "rain", "--ocio", "none.ocio")

    def test_exrNamesItsSpace(self):
        """What is written says what it is in, and is read back as that."""
        for name in ("Linear Rec.709", "ACEScg", "ACEScct", "Linear Rec.2020", "ARRI LogC3 (EI800)",
                     "Linear ARRI Wide Gamut 4", "CIE-XYZ-D65", "Rec.709 camera"):
            self.rain("light.exr", "-o", "out.exr", "--float", *OFF, "--output-colorspace", name)
            space, source = self.said("out.exr")
            self.assertEqual((space, source.split()[1]), (name, "colorInteropID"))
            if name != "CIE-XYZ-D65":
                self.assertEqual(len(header(self.folder / "out.exr").getattribute("chromaticities")), 8)
        # The configuration's own name means nothing elsewhere; that it is ACEScg does.
        self.rain("a_log.png", "-o", "out.exr", *OFF, "--ocio", "show.ocio")
        self.assertEqual(header(self.folder / "out.exr").getattribute("colorInteropID"), "lin_ap1_scene")
        np.testing.assert_allclose(header(self.folder / "out.exr").getattribute("chromaticities"), AP1, atol=1e-6)
        # A plate's word of its own space stays, of another goes.
        self.rain("id.exr", "-o", "out.exr", *OFF)
        np.testing.assert_allclose(header(self.folder / "out.exr").getattribute("chromaticities"), AP1, atol=1e-6)
        self.rain("id.exr", "-o", "out.exr", *OFF, "--output-colorspace", "lin_rec709")
        self.assertEqual(self.said("out.exr"), ("Linear Rec.709", "metadata: colorInteropID lin_rec709_scene"))
        self.assertAlmostEqual(header(self.folder / "out.exr").getattribute("chromaticities")[0], 0.64, 5)

    def test_negativeAndBrightLightSurvives(self):
        """Through the spaces of --output-colorspace, there and back by the file's own word."""
        listed = self.succeeds("info", "--colorspaces", "--json").report["colorspaces"]
        self.assertGreater(len(listed), 70)
        before = readImage(self.folder / "light.exr")[0]
        names = [s["name"] for s in listed if s["family"] in ("ACES", "camera")] + ["sRGB", "Rec.2020 PQ", "P3-D65 HLG"]
        for space in names:
            self.rain("light.exr", "-o", "there.exr", "--float", *OFF, "--output-colorspace", space)
            self.rain("there.exr", "-o", "back.exr", "--float", *OFF, "--output-colorspace", "Linear Rec.709")
            back = readImage(self.folder / "back.exr")[0]
            np.testing.assert_allclose(back[..., :3], before, rtol=1e-4, atol=2e-4, err_msg=space)


class Previews(CliTest):
    """Sheets are sRGB, whatever the plate is worked on in."""

    def test_contactSheet(self):
        red = np.zeros((H, W, 3), np.float32)
        red[...] = (0.5, 0.2, 0.1)  # linear Rec.709, inside of every gamut here
        expected = [188, 124, 89]  # the curve of IEC 61966-2-1
        into = {"Linear P3-D65": [[0.8225, 0.1774, 0], [0.0332, 0.9669, 0], [0.0171, 0.0724, 0.9108]],
                "Linear Rec.2020": [[0.6274, 0.3293, 0.0433], [0.0691, 0.9195, 0.0114], [0.0164, 0.088, 0.8956]],
                "Linear Rec.709": np.eye(3), "raw": np.eye(3)}
        for space, matrix in into.items():
            with self.subTest(space=space):
                writeImage(self.folder / "p.exr", red @ np.array(matrix, np.float32).T, "float")
                self.rain("p.exr", "-o", "o.exr", *OFF, "--colorspace", space, "--preview", "sheet.png")
                shown = readImage(self.folder / "sheet.png", "uint8")[0][H // 2, [W // 2, W + W // 2]]
                np.testing.assert_allclose(shown.astype(int), [expected] * 2, atol=1)

    def test_panorama(self):
        sky = np.zeros((64, 128, 3), np.float32)
        sky[...] = (0.5, 0.2, 0.1)
        shown = []
        for name, matrix in (("Linear Rec.709", np.eye(3)),
                             ("Linear P3-D65", [[0.8225, 0.1774, 0], [0.0332, 0.9669, 0], [0.0171, 0.0724, 0.9108]])):
            writeImage(self.folder / "sky.exr", sky @ np.array(matrix, np.float32).T, "float")
            self.succeeds("env", "--quiet", "sky.exr", "-o", "env.exr", "--preview", "env.png", "--colorspace", name)
            shown.append(readImage(self.folder / "env.png", "uint8")[0].astype(int))
        self.assertLessEqual(np.abs(shown[0] - shown[1])[:40].max(), 1)


class Listing(CliTest):
    @classmethod
    def makePlates(cls):
        (cls.folder / "show.ocio").write_text(STUDIO)
        (cls.folder / "broken.ocio").write_text("just words")
        (cls.folder / "dangling.ocio").write_text(STUDIO.replace("scene_linear: show_lin", "scene_linear: gone"))
        (cls.folder / "unlit.ocio").write_text(STUDIO.replace("scene_linear: show_lin, ", ""))
        (cls.folder / "alone.ocio").write_text(STUDIO.replace(", aces_interchange: show_aces", ""))
        writeImage(cls.folder / "a_log.png", np.full((8, 8, 3), 0.25), "uint16")

    def test_names(self):
        run = self.succeeds("info", "--colorspaces")
        self.assertIn("configuration: built-in", run.out)
        for word in ("ARRI LogC4", "DaVinci Intermediate WideGamut", "Utility - sRGB - Texture", "scene_linear",
                     "cie_xyz_d65_interchange"):
            self.assertIn(word, run.out)
        report = self.succeeds("info", "--colorspaces", "--json", "--ocio", "show.ocio").report
        self.assertEqual(report["ocio"], "show.ocio (--ocio)")
        self.assertEqual(report["roles"]["scene_linear"], "show_lin")
        self.assertEqual(report["roles"]["texture_paint"], "ACEScct")
        self.assertEqual({s["from"] for s in report["colorspaces"]}, {"show.ocio (--ocio)", "built-in"})
        # No name stands for two spaces, and every role for one that is listed.
        names = {s["name"] for s in report["colorspaces"]}
        self.assertEqual(len(names), len(report["colorspaces"]))
        self.assertLessEqual(set(report["roles"].values()), names)

    def refusedWith(self, ocio, code, *words, arguments=()):
        self.refused(code, words, "rain", "a_log.png", "-o", "x.exr", "--ocio", ocio, *arguments)

    def test_faults(self):
        self.refusedWith("none.ocio", 3, "none.ocio (--ocio): does not exist")
        self.refusedWith(".", 3, "is not a file")
        self.refusedWith("broken.ocio", 3, "broken.ocio (--ocio): is no colour configuration that can be used")
        self.refusedWith("dangling.ocio", 3, "dangling.ocio (--ocio)", "gone")
        self.refusedWith("unlit.ocio", 3, "unlit.ocio (--ocio): has no role scene_linear", "'show_log'")
        self.refusedWith("alone.ocio", 2, "no way from colour space 'show_lin' to 'sRGB'", "no role aces_interchange",
                         arguments=("--output-colorspace", "sRGB"))
        self.refusedWith("show.ocio", 2, "'show_lag' is not known; near it are show_lo", "virga info --colorspaces",
                         arguments=("--colorspace", "show_lag"))
        self.refused(3, ["/nowhere.ocio ($OCIO): does not exist"], "rain", "a_log.png", "-o", "x.exr",
                     env={"OCIO": "/nowhere.ocio"})


if __name__ == "__main__":
    unittest.main()
