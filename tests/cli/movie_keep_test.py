"""What a movie has beside plain pictures comes through: how it is turned, drop-frame timecode, telemetry, fonts, HDR metadata;
packed 4:1:1; codes under shared chroma where no rain falls; and what is left where the disk is full."""
import json
import os
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from support import CHEAP, OFF, CliTest, ffmpeg, frameTimes, probe, readImage

ENCODE = [*OFF, "--reencode"]
CLIP = ["-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.4"]


def said(path, *entries):
    done = subprocess.run(["ffprobe", "-v", "error", "-of", "json", *entries, str(path)], check=True, capture_output=True, timeout=60)
    return json.loads(done.stdout)


def raw(path, pixelFormat, kind="u1"):
    done = subprocess.run(["ffmpeg", "-v", "error", "-noautorotate", "-i", str(path), "-map", "0:v:0", "-f", "rawvideo", "-pix_fmt",
                           pixelFormat, "-"], check=True, capture_output=True, timeout=60)
    return np.frombuffer(done.stdout, kind)


class Turned(CliTest):
    """The eight display matrices (ISO 14496-12, 6.2.2): (a, b, c, d) takes the coded (x, y) to (a x + c y, b x + d y)."""

    MATRICES = {(1, 0, 0, 1): lambda p: p, (-1, 0, 0, 1): lambda p: p[:, ::-1], (1, 0, 0, -1): lambda p: p[::-1],
                (-1, 0, 0, -1): lambda p: p[::-1, ::-1], (0, 1, 1, 0): lambda p: p.transpose(1, 0, 2),
                (0, 1, -1, 0): lambda p: p.transpose(1, 0, 2)[:, ::-1], (0, -1, 1, 0): lambda p: p.transpose(1, 0, 2)[::-1],
                (0, -1, -1, 0): lambda p: p.transpose(1, 0, 2)[::-1, ::-1]}

    def test_allEight(self):
        ffmpeg(*CLIP, "-frames:v", "2", "-pix_fmt", "rgb24", "-c:v", "png", self.folder / "plain.mov")
        plain = (self.folder / "plain.mov").read_bytes()
        upright = raw(self.folder / "plain.mov", "rgb24").reshape(2, 48, 64, 3)[0]
        matrix = plain.index(b"tkhd") + 4 + 40
        self.assertEqual(struct.unpack(">i", plain[matrix:matrix + 4])[0], 65536)
        for (a, b, c, d), turn in self.MATRICES.items():
            with self.subTest(matrix=(a, b, c, d)):
                numbers = [a << 16, b << 16, 0, c << 16, d << 16, 0, 0, 0, 1 << 30]
                (self.folder / "turned.mov").write_bytes(plain[:matrix] + struct.pack(">9i", *numbers) + plain[matrix + 36:])
                self.rain("turned.mov", "-o", "o.png", *OFF, "--frames", "0")
                np.testing.assert_array_equal(readImage(self.folder / "o.png", "uint8")[0][..., :3], turn(upright))
                # A movie made of it is upright and needs no matrix; a copy keeps both.
                self.rain("turned.mov", "-o", "o.mov", *ENCODE)
                self.assertNotIn("side_data_list", probe(self.folder / "o.mov"))
                np.testing.assert_array_equal(raw(self.folder / "o.mov", "rgb24")[:48 * 64 * 3].reshape(turn(upright).shape), turn(upright))
                self.assertTrue(self.rain("turned.mov", "-o", "copy.mov", *OFF)["stream_copied"])
                self.assertEqual(probe(self.folder / "copy.mov").get("side_data_list"),
                                 probe(self.folder / "turned.mov").get("side_data_list"))


class Kept(CliTest):
    def test_dropFrameTimecode(self):
        """At 29.97 the numbers 00 and 01 of most minutes are left out (SMPTE ST 12-1): 59;28, 59;29, 00;02."""
        for name in ("drop.mov", "drop.mkv", "drop.mp4"):
            ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=30000/1001:d=0.4", "-c:v", "libx264", "-g", "1", "-timecode", "01:00:59;28",
                   self.folder / name)
            for flags, expected in (([], "01:00:59;28"), (["--frames", "2-8"], "01:01:00;02"), (["--frames", "5-8"], "01:01:00;05")):
                for how in ([], ["--reencode"]):
                    with self.subTest(name=name, flags=flags, how=how):
                        self.rain(name, "-o", "o" + name[4:], *OFF, *flags, *how)
                        tags = said(self.folder / ("o" + name[4:]), "-show_entries", "format_tags:stream_tags")
                        self.assertIn(f'"{expected}"', json.dumps(tags).replace("TIMECODE", "timecode"))

    def test_telemetry(self):
        """GoPro's: a track of data that nobody decodes. Made of subtitles under another name."""
        (self.folder / "words.srt").write_text("1\n00:00:00,000 --> 00:00:00,200\nGPS\n\n2\n00:00:00,200 --> 00:00:00,400\nACCL\n")
        ffmpeg(*CLIP, "-i", self.folder / "words.srt", "-map", "0", "-map", "1", "-c:v", "libx264", "-c:s", "mov_text",
               self.folder / "words.mp4")
        data = (self.folder / "words.mp4").read_bytes()
        for old, new in ((b"tx3g", b"gpmd"), (b"sbtl", b"meta")):
            self.assertEqual(data.count(old), 1)
            data = data.replace(old, new)
        (self.folder / "gopro.mp4").write_bytes(data)
        tags = lambda name: [s.get("codec_tag_string") for s in said(self.folder / name, "-show_streams")["streams"]]
        self.assertIn("gpmd", tags("gopro.mp4"))
        packets = lambda name: [p["data_hash"] for p in said(self.folder / name, "-select_streams", "d", "-show_packets", "-show_data_hash",
                                                             "md5")["packets"]]
        self.assertGreater(len(packets("gopro.mp4")), 1)
        for how in ([], ["--reencode"]):
            with self.subTest(how=how):
                self.rain("gopro.mp4", "-o", "o.mp4", *OFF, *how)
                self.assertIn("gpmd", tags("o.mp4"))
                self.assertEqual(packets("o.mp4"), packets("gopro.mp4"))
                for result in ("o.mov", "o.mkv"):
                    run = self.succeeds("rain", "gopro.mp4", "-o", result, *OFF, *how)
                    self.assertRegex(run.err, rf"warning: {result}: the plate's timed data \(.*\) cannot be kept in a .* file and is left out")

    def test_fonts(self):
        font = bytes(range(256)) * 3
        (self.folder / "font.ttf").write_bytes(font)
        ffmpeg(*CLIP, "-attach", self.folder / "font.ttf", "-metadata:s:t:0", "mimetype=font/ttf", "-c:v", "libx264",
               self.folder / "fonts.mkv")
        for how in ([], ["--reencode"]):
            with self.subTest(how=how):
                self.rain("fonts.mkv", "-o", "o.mkv", *OFF, *how)
                subprocess.run(["ffmpeg", "-v", "quiet", "-y", "-dump_attachment:t:0", self.path("out.ttf"), "-i", self.path("o.mkv")])
                self.assertEqual((self.folder / "out.ttf").read_bytes(), font)
                attached = [s for s in said(self.folder / "o.mkv", "-show_streams")["streams"] if s["codec_type"] == "attachment"]
                self.assertEqual((attached[0]["tags"]["filename"], attached[0]["tags"]["mimetype"]), ("font.ttf", "font/ttf"))
        self.assertIn("attached file", self.succeeds("rain", "fonts.mkv", "-o", "o.mp4", *OFF).err)

    def test_hdrOfAv1AndVp9(self):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x64:r=25:d=0.12", "-c:v", "libx265", "-pix_fmt", "yuv420p10", "-color_primaries",
               "bt2020", "-color_trc", "smpte2084", "-colorspace", "bt2020nc", "-x265-params",
               "log-level=none:master-display=G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,50):max-cll=1000,400",
               self.folder / "hdr.mkv")
        for codec, result, again in (("libsvtav1", "av1.mp4", "av1_2.mkv"), ("libsvtav1", "av1.mkv", "av1_2.mp4"),
                                     ("libvpx-vp9", "vp9.webm", "vp9_2.webm"), ("libvpx-vp9", "vp9.mkv", "vp9_2.mkv")):
            flags = ["--preset", "10"] if codec == "libsvtav1" else []
            self.rain("hdr.mkv", "-o", result, *ENCODE, "--codec", codec, *flags)
            self.rain(result, "-o", again, *ENCODE, "--codec", codec, *flags)
            for name in (result, again):
                with self.subTest(name=name):
                    report = self.succeeds("info", "--json", name).report
                    self.assertEqual(report["light_level"], {"max_content_cd_m2": 1000, "max_average_cd_m2": 400})
                    m = report["mastering_display"]
                    np.testing.assert_allclose([m["red"], m["green"], m["blue"], m["white"]],
                                               [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06], [0.3127, 0.329]], atol=2e-5)
                    self.assertAlmostEqual(m["max_cd_m2"], 1000, delta=0.01)
                    self.assertAlmostEqual(m["min_cd_m2"], 0.005, delta=1e-4)
                    self.assertEqual((report["transfer"], report["primaries"]), ("smpte2084", "bt2020"))

    def test_fewerFramesThanAnEncoderLooksAhead(self):
        for frames in (1, 2, 3):
            ffmpeg(*CLIP, "-frames:v", frames, "-pix_fmt", "yuv420p", "-c:v", "ffv1", self.folder / "few.mkv")
            for result in ("o.mov", "o.mp4", "o.mkv"):
                with self.subTest(frames=frames, result=result):
                    self.rain("few.mkv", "-o", result, *OFF, "--codec", "libx265", "--codec-options", "x265-params=lossless=1")
                    np.testing.assert_array_equal(raw(self.folder / result, "yuv420p"), raw(self.folder / "few.mkv", "yuv420p"))
                    times = frameTimes(self.folder / result)
                    np.testing.assert_allclose(times, np.arange(frames) / 25, atol=6e-4)


class Codes(CliTest):
    def test_packed411(self):
        """U Y Y V Y Y, as DV has it; ffmpeg's own reading of its luma is wrong, so the bytes are made here."""
        rows, columns, frames = 48, 64, 2
        random = np.random.default_rng(5)
        y, u, v = (random.integers(0, 256, (frames, rows, columns // step), dtype=np.uint8) for step in (1, 4, 4))
        packed = np.stack([u, y[..., 0::4], y[..., 1::4], v, y[..., 2::4], y[..., 3::4]], -1)
        (self.folder / "y411.yuv").write_bytes(packed.tobytes())
        ffmpeg("-f", "rawvideo", "-pix_fmt", "uyyvyy411", "-s", f"{columns}x{rows}", "-r", "25", "-i", self.folder / "y411.yuv", "-c",
               "copy", self.folder / "y411.nut")
        self.rain("y411.nut", "-o", "o.mkv", *OFF, "--codec", "ffv1")
        self.assertEqual(probe(self.folder / "o.mkv")["pix_fmt"], "yuv411p")
        planes = raw(self.folder / "o.mkv", "yuv411p").reshape(frames, -1)
        for frame in range(frames):
            np.testing.assert_array_equal(planes[frame], np.concatenate([y[frame].ravel(), u[frame].ravel(), v[frame].ravel()]))

    def test_whereNoRainFallsUnderSharedChroma(self):
        """4:2:0: luma where no stroke is, and chroma of which no pixel has one, are the plate's codes."""
        for pixelFormat, kind in (("yuv420p", "u1"), ("yuv420p10", "<u2"), ("yuv422p", "u1")):
            with self.subTest(pixelFormat=pixelFormat):
                frames = 3
                ffmpeg("-f", "lavfi", "-i", f"testsrc2=s=96x64:r=25:d={frames / 25}", "-vf",
                       f"noise=alls=60:allf=t:all_seed=3,format={pixelFormat}", "-c:v", "ffv1", self.folder / "p.mkv")
                self.rain("p.mkv", "-o", "wet.mkv", "--codec", "ffv1", "--rate", "5", *CHEAP)
                self.rain("p.mkv", "-o", "wet.%d.exr", "--layers", "--rate", "5", *CHEAP)
                before, after = (raw(self.folder / name, pixelFormat, kind).reshape(frames, -1) for name in ("p.mkv", "wet.mkv"))
                step = 2 if "420" in pixelFormat else 1
                changedAtAll = False
                for frame in range(frames):
                    image, names = readImage(self.folder / f"wet.{frame}.exr")
                    wet = image[..., names.index("rain.A")] > 0
                    shared = wet.reshape(64 // step, step, 48, 2).any(axis=(1, 3))
                    self.assertGreater((~shared).mean(), 0.1)
                    changed = before[frame] != after[frame]
                    changedAtAll |= changed.any()
                    luma, chroma = changed[:96 * 64].reshape(64, 96), changed[96 * 64:].reshape(2, 64 // step, 48)
                    self.assertFalse((luma & ~wet).any())
                    self.assertFalse((chroma & ~shared).any())
                self.assertTrue(changedAtAll)


class FullDisk(CliTest):
    """A small disk of its own, which only root may make."""

    SIZE = 700 * 1024

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.disk = Path(tempfile.mkdtemp(prefix="virga-disk-"))
        cls.isMounted = os.geteuid() == 0 and subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={cls.SIZE}", "tmpfs", cls.disk], capture_output=True).returncode == 0

    @classmethod
    def tearDownClass(cls):
        if cls.isMounted:
            subprocess.run(["umount", cls.disk], check=True)
        cls.disk.rmdir()
        super().tearDownClass()

    def setUp(self):
        if not self.isMounted:
            self.skipTest("a small disk (tmpfs) can only be made by root, where mounting is allowed")

    @classmethod
    def makePlates(cls):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=160x96:r=25:d=1", "-vf", "noise=alls=40:allf=t", "-pix_fmt", "yuv420p", "-c:v", "ffv1",
               cls.folder / "plate.mkv")

    LOSSLESS = ["--codec", "libx264", "--codec-options", "qp=0,g=5"]

    def test_noRoomToRewrite(self):
        """MP4 that fits once but not twice is delivered as fragments, and plays."""
        out = self.disk / "out.mp4"
        run = self.virga("rain", "plate.mkv", "-o", out, *OFF, *self.LOSSLESS)
        self.assertEqual(run.code, 0, run)
        self.assertRegex(run.err, "stays a fragmented file, which plays.*No space left on device")
        self.assertEqual([p.name for p in self.disk.iterdir()], ["out.mp4"])
        self.assertGreater(2 * out.stat().st_size, self.SIZE)
        np.testing.assert_array_equal(raw(out, "yuv420p"), raw(self.folder / "plate.mkv", "yuv420p"))
        out.unlink()

    def test_noRoomAtAll(self):
        filler = self.disk / "filler"
        filler.write_bytes(bytes(self.SIZE - 120 * 1024))
        for name in ("out.mp4", "out.mkv", "out.nut"):
            with self.subTest(name=name):
                run = self.virga("rain", "--quiet", "plate.mkv", "-o", self.disk / name, *OFF, *self.LOSSLESS)
                self.assertEqual(run.code, 5, run)
                self.assertRegex(run.err, rf"^virga: .*{name}: cannot be written \(No space left on device\)\n$")
                self.assertEqual(list(self.disk.iterdir()), [filler])
        filler.unlink()


if __name__ == "__main__":
    unittest.main()
