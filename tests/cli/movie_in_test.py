"""Movies in: every codec, depth, subsampling, range, matrix and container of the table, held against ffmpeg's own decode,
code for code; frames by number in any order; pipes, fields, several streams; damage.

VIRGA_FORMATS_OUT names a file to which each row of the table is added as a line of JSON (scripts/make_formats_page.py)."""
import json
import os
import random
import re
import shutil
import subprocess
import unittest

import numpy as np
from support import OFF, VIRGA, CliTest, ffmpeg, readImage

SIZE = "64x48"
FRAMES = 8
X264 = ["-c:v", "libx264", "-g", "4", "-bf", "2"]
X265 = ["-c:v", "libx265", "-x265-params", "log-level=none:keyint=4:bframes=2"]
DNXHR = ["-c:v", "dnxhd", "-profile:v"]


def prores(profile):
    return ["-c:v", "prores_ks", "-profile:v", str(profile)]


# codec in words, encoder, pixel formats, containers
MATRIX = [
    ("H.264", X264, ["yuv420p", "yuv422p", "yuv444p", "yuv420p10", "yuv422p10", "yuv444p10"], ["mp4"]),
    ("H.264", X264, ["yuv420p"], ["mov", "mkv", "ts", "avi", "mxf"]),
    ("H.264", ["-c:v", "libx264", "-g", "4", "-x264-params", "open-gop=1:bframes=2"], ["yuv420p"], ["mkv"]),
    ("H.264 RGB", ["-c:v", "libx264rgb"], ["rgb24"], ["mkv"]),
    ("HEVC", X265, ["yuv420p", "yuv420p10", "yuv422p10", "yuv444p12"], ["mp4"]),
    ("HEVC", X265, ["yuv420p10"], ["mov", "mkv", "ts"]),
    ("ProRes 422 Proxy", prores(0), ["yuv422p10"], ["mov"]),
    ("ProRes 422 LT", prores(1), ["yuv422p10"], ["mov"]),
    ("ProRes 422", prores(2), ["yuv422p10"], ["mov"]),
    ("ProRes 422 HQ", prores(3), ["yuv422p10"], ["mov", "mkv"]),
    ("ProRes 4444", prores(4), ["yuv444p10", "yuva444p10"], ["mov"]),
    ("ProRes 4444 XQ", prores(5), ["yuv444p10", "yuva444p10"], ["mov"]),
    ("VP9", ["-c:v", "libvpx-vp9", "-g", "4"], ["yuv420p", "yuv422p", "yuv440p", "yuv444p", "yuv420p10", "yuv444p12"], ["webm"]),
    ("AV1", ["-c:v", "libaom-av1", "-cpu-used", "8", "-usage", "realtime", "-g", "4"], ["yuv420p", "yuv444p10"], ["mkv"]),
    ("MPEG-2", ["-c:v", "mpeg2video", "-q:v", "3"], ["yuv420p", "yuv422p"], ["mpg", "ts", "mxf"]),
    ("MPEG-4", ["-c:v", "mpeg4", "-q:v", "3", "-bf", "2"], ["yuv420p"], ["avi", "mp4"]),
    ("MJPEG", ["-c:v", "mjpeg", "-q:v", "3"], ["yuvj420p", "yuvj422p", "yuvj444p"], ["avi", "mov"]),
    ("FFV1", ["-c:v", "ffv1", "-slices", "4"],
     ["yuv420p", "yuv422p10", "yuv444p12", "yuv411p", "yuv440p", "yuv444p16", "yuva444p", "gray", "gray10", "gray16", "bgr0",
      "gbrp10", "gbrp12", "gbrp16", "gbrap10"], ["mkv"]),
    ("raw", ["-c:v", "rawvideo"], ["yuv420p", "yuv422p16", "rgb24", "rgba", "rgb48", "gray", "uyvy422"], ["nut"]),
    ("raw", [], ["yuv420p", "yuv444p"], ["y4m"]),
    ("HuffYUV", ["-c:v", "ffvhuff"], ["yuv422p", "rgb24"], ["avi"]),
    ("UT Video", ["-c:v", "utvideo"], ["yuv422p", "gbrp"], ["avi"]),
    ("PNG", ["-c:v", "png"], ["rgb24", "rgba", "gray", "rgb48be"], ["mov"]),
    ("QuickTime Animation", ["-c:v", "qtrle"], ["rgb24", "argb"], ["mov"]),
    ("v210", ["-c:v", "v210"], ["yuv422p10"], ["mov"]),
    ("JPEG 2000", ["-c:v", "jpeg2000"], ["yuv420p", "yuv422p10", "rgb24", "rgb48"], ["mov"]),
]


def note(**row):
    if path := os.environ.get("VIRGA_FORMATS_OUT"):
        with open(path, "a") as file:
            file.write(json.dumps(row) + "\n")


def frameCodes(path, pixelFormat=None, extra=()):
    """One checksum a picture, of its codes as ffmpeg decodes them."""
    convert = ["-pix_fmt", pixelFormat] if pixelFormat else []
    done = subprocess.run(["ffmpeg", "-v", "error", *extra, "-i", str(path), "-map", "0:v:0", "-fps_mode", "passthrough",
                           *convert, "-f", "framemd5", "-"], check=True, capture_output=True, text=True, timeout=120)
    return [line.split(",")[-1].strip() for line in done.stdout.splitlines() if line and not line.startswith("#")]


def formatOf(path):
    done = subprocess.run(["ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "stream=pix_fmt", "-of",
                           "csv=p=0", str(path)], check=True, capture_output=True, text=True, timeout=60)
    return done.stdout.strip().split("\n")[0].strip(",")


class Matrix(CliTest):
    def clip(self, name, encoder, pixelFormat, extra=()):
        path = self.folder / name
        size = "96x64" if "mxf" in name or "dnx" in name else SIZE
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r=25:d={FRAMES / 25}", "-vf",
               f"noise=alls=12:allf=t:all_seed=7,format={pixelFormat}", *encoder, *extra, path)
        return path

    def check(self, clip, codec, **row):
        """Through virga into FFV1, forwards and by number from behind."""
        own = formatOf(clip)
        if own in ("bgr0", "rgb0", "0rgb", "0bgr"):  # what the unused byte holds is nobody's business
            own = "gbrp"
        expected = frameCodes(clip, own)
        self.assertEqual(len(expected), FRAMES)
        self.rain(clip, "-o", "same.mkv", *OFF, "--codec", "ffv1")
        self.assertEqual(frameCodes(self.folder / "same.mkv", own), expected)
        order = [5, 2, 7, 0]
        self.rain(clip, "-o", "some.%d.png", *OFF, "--frames", ",".join(map(str, order)))
        self.rain(clip, "-o", "all.%d.png", *OFF)
        for frame in order:
            np.testing.assert_array_equal(readImage(self.folder / f"some.{frame}.png", "uint16")[0],
                                          readImage(self.folder / f"all.{frame}.png", "uint16")[0])
        note(direction="in", codec=codec, pixel_format=own, max_error_codes=0, seek="exact", **row)

    def test_codecs(self):
        for codec, encoder, pixelFormats, containers in MATRIX:
            for container in containers:
                for pixelFormat in pixelFormats:
                    with self.subTest(codec=codec, pixelFormat=pixelFormat, container=container):
                        self.check(self.clip(f"in.{container}", encoder, pixelFormat), codec, container=container)

    def test_dnxhd(self):
        for profile, pixelFormat in (("dnxhr_lb", "yuv422p"), ("dnxhr_sq", "yuv422p"), ("dnxhr_hq", "yuv422p"),
                                     ("dnxhr_hqx", "yuv422p10"), ("dnxhr_444", "yuv444p10")):
            with self.subTest(profile=profile):
                path = self.folder / "dnx.mov"
                ffmpeg("-f", "lavfi", "-i", f"testsrc2=s=256x120:r=25:d={FRAMES / 25}", "-vf", f"format={pixelFormat}",
                       *DNXHR, profile, path)
                self.check(path, f"DNxHR {profile[6:].upper()}", container="mov")

    def test_alphaOfVp9(self):
        path = self.clip("alpha.webm", ["-c:v", "libvpx-vp9"], "yuva420p")
        expected = frameCodes(path, "yuva420p", ("-c:v", "libvpx-vp9"))
        self.rain(path, "-o", "same.mkv", *OFF, "--codec", "ffv1")
        self.assertEqual(formatOf(self.folder / "same.mkv"), "yuva420p")
        self.assertEqual(frameCodes(self.folder / "same.mkv"), expected)
        note(direction="in", codec="VP9", pixel_format="yuva420p", container="webm", max_error_codes=0, seek="exact")

    def test_rangesAndMatrices(self):
        """R'G'B' by the formula of ITU-R BT.601, 709 and 2020 from the codes that ffmpeg decodes."""
        weights = {"smpte170m": (0.299, 0.114), "bt709": (0.2126, 0.0722), "bt2020nc": (0.2627, 0.0593)}
        for matrix, (kr, kb) in weights.items():
            for rangeName in ("tv", "pc"):
                for bits, pixelFormat in ((8, "yuv444p"), (10, "yuv444p10"), (16, "yuv444p16")):
                    with self.subTest(matrix=matrix, range=rangeName, bits=bits):
                        path = self.clip("in.mkv", ["-c:v", "ffv1"], pixelFormat,
                                         ["-colorspace", matrix, "-color_range", rangeName])
                        raw = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-f", "rawvideo", "-frames:v", "1", "-"],
                                             check=True, capture_output=True).stdout
                        codes = np.frombuffer(raw, np.uint8 if bits == 8 else np.uint16).reshape(3, 48, 64).astype(float)
                        most = 2 ** bits - 1
                        if rangeName == "tv":
                            scale = 2 ** (bits - 8)
                            y, u, v = (codes[0] / scale - 16) / 219, *((c / scale - 128) / 224 for c in codes[1:])
                        else:
                            y, u, v = codes[0] / most, *((c - 2 ** (bits - 1)) / most for c in codes[1:])
                        red, blue = y + 2 * (1 - kr) * v, y + 2 * (1 - kb) * u
                        green = (y - kr * red - kb * blue) / (1 - kr - kb)
                        self.rain(path, "-o", "out.exr", *OFF, "--frames", "0", "--float", "--colorspace", "Linear Rec.709")
                        ours = readImage(self.folder / "out.exr")[0][..., :3]
                        error = np.abs(ours - np.stack([red, green, blue], -1)).max()
                        self.assertLess(error, 1e-6)
                        note(direction="matrix", matrix=matrix, range=rangeName, bits=bits, max_error=float(error))


class Time(CliTest):
    """Which pictures there are, and when."""

    def numbered(self, path, frames, *arguments):
        """Frame n is grey 8 n + 16 all over."""
        ffmpeg("-f", "lavfi", "-i", f"color=s={SIZE}:r=25:d={frames / 25}", "-vf", "geq=lum='8*N+16':cb=128:cr=128", *arguments,
               path)

    def greys(self, plate, *arguments):
        shutil.rmtree(self.folder / "g", ignore_errors=True)
        (self.folder / "g").mkdir()
        run = self.succeeds("rain", plate, "-o", "g/o.%04d.exr", *OFF, "--float", "--colorspace", "raw", *arguments)
        images = sorted((self.folder / "g").glob("*.exr"))
        return [round(float(readImage(image)[0][24, 32, 0]) * 219 / 8) for image in images], run

    def test_editList(self):
        """A cut in the middle of a group of pictures: the pictures before it are there to be decoded, not to be shown."""
        self.numbered(self.folder / "long.mp4", 20, "-c:v", "libx264", "-qp", "0", "-g", "10", "-bf", "2")
        ffmpeg("-ss", "0.16", "-i", self.folder / "long.mp4", "-c", "copy", self.folder / "cut.mp4")
        expected = len(frameCodes(self.folder / "cut.mp4"))
        found, _ = self.greys("cut.mp4")
        self.assertEqual(found, list(range(20 - expected, 20)))

    def test_joinedStreams(self):
        """Time stamps that begin anew: every picture is a frame."""
        self.numbered(self.folder / "a.ts", 6, "-c:v", "mpeg2video", "-q:v", "2", "-bf", "0")
        (self.folder / "joined.ts").write_bytes((self.folder / "a.ts").read_bytes() * 2)
        found, run = self.greys("joined.ts", "--on-error", "hold")
        self.assertEqual(len(found), 12, run)
        self.assertIn("begin anew or repeat", run.err)
        # What the seam itself damages is held, on either side of it.
        self.assertLessEqual(sum(a != b for a, b in zip(found, [*range(6), *range(6)])), 2, found)

    def test_streams(self):
        ffmpeg("-f", "lavfi", "-i", "color=red:s=64x48:r=25:d=0.2", "-f", "lavfi", "-i", "color=blue:s=96x64:r=25:d=0.2", "-map",
               "0", "-map", "1", "-metadata:s:v:1", "title=B", self.folder / "two.mkv")
        info = json.loads(self.succeeds("info", "two.mkv", "--json").out)
        self.assertEqual(len(info["video_streams"]), 2)
        self.assertIn("96x64", info["video_streams"][1])
        self.assertIn("'B'", info["video_streams"][1])
        self.assertEqual(self.rain("two.mkv", "-o", "o.png", *OFF, "--frames", "0", "--stream", "1")["width"], 96)
        self.assertEqual(self.rain("two.mkv", "-o", "o.png", *OFF, "--frames", "0", "--stream", "0")["width"], 64)
        self.refused(2, ["two.mkv", "no video stream 2", "0 to 1"], "rain", "two.mkv", "-o", "p.png", *OFF, "--stream", "2")
        self.refused(2, ["--stream '0.5'", "whole"], "rain", "two.mkv", "-o", "p.png", *OFF, "--stream", "0.5")

    def test_sizeThatChanges(self):
        for name, size in (("a", "64x48"), ("b", "96x64")):
            ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r=25:d=0.16", "-c:v", "libx264", "-bf", "0", self.folder / f"{name}.h264")
        (self.folder / "grows.h264").write_bytes((self.folder / "a.h264").read_bytes() + (self.folder / "b.h264").read_bytes())
        self.refused(3, ["grows.h264: frame 4 is 96x64", "began with 64x48"], "rain", "grows.h264", "-o", "g.mkv", *OFF, "--codec",
                     "ffv1", "--quiet")


class Pipes(CliTest):
    @classmethod
    def makePlates(cls):
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={SIZE}:r=25:d=0.4", "-f", "lavfi", "-i", "sine=d=0.4", "-c:v", "libx264", "-qp",
               "0", "-bf", "2", "-c:a", "flac", cls.folder / "clip.mkv")

    def through(self, *sender):
        send = subprocess.Popen(["ffmpeg", "-v", "error", "-i", self.path("clip.mkv"), *sender, "-"], stdout=subprocess.PIPE)
        done = subprocess.run([VIRGA, "rain", "--quiet", "-", "-o", "same.mkv", "--codec", "ffv1", *OFF], cwd=self.folder,
                              stdin=send.stdout, capture_output=True, timeout=120)
        send.stdout.close()
        self.assertEqual((send.wait(), done.returncode), (0, 0), done.stderr)
        self.assertEqual(frameCodes(self.folder / "same.mkv"), frameCodes(self.folder / "clip.mkv"))

    def test_standardInput(self):
        self.through("-f", "nut", "-c:v", "rawvideo", "-an")
        self.through("-f", "yuv4mpegpipe", "-an")
        self.through("-f", "matroska", "-c", "copy")
        self.assertTrue(subprocess.run(["ffprobe", "-v", "error", "-select_streams", "a", "-show_entries", "stream=codec_name",
                                        "-of", "csv=p=0", self.path("same.mkv")], capture_output=True).stdout.startswith(b"flac"))

    def test_imagesOneAfterTheOther(self):
        """FFmpeg's image2pipe: pictures in a row, without anything that says where one ends."""
        for codec, pixelFormat in (("png", "rgb24"), ("png", "rgb48be"), ("bmp", "bgr24"), ("ppm", "rgb24")):
            with self.subTest(codec=codec, pixelFormat=pixelFormat):
                ffmpeg("-i", self.path("clip.mkv"), "-an", "-f", "image2pipe", "-c:v", codec, "-pix_fmt", pixelFormat,
                       self.folder / "pictures")
                with open(self.folder / "pictures", "rb") as pictures:
                    done = subprocess.run([VIRGA, "rain", "--quiet", "-", "-o", "same.mkv", "--codec", "ffv1", "--fps", "25", *OFF],
                                          cwd=self.folder, stdin=pictures, capture_output=True, text=True, timeout=120)
                self.assertEqual(done.returncode, 0, done.stderr)
                def hashes(*source):
                    lines = subprocess.run(["ffmpeg", "-v", "error", *source, "-pix_fmt", "gbrp16le", "-f", "framemd5", "-"],
                                           capture_output=True, text=True, check=True).stdout.splitlines()
                    return [line.split(",")[-1] for line in lines if not line.startswith("#")]

                wanted = hashes("-f", "image2pipe", "-c:v", codec, "-i", self.path("pictures"))
                self.assertGreater(len(wanted), 2)
                self.assertEqual(hashes("-i", self.path("same.mkv")), wanted)

    def test_fileAsStandardInput(self):
        with open(self.folder / "clip.mkv", "rb") as clip:
            done = subprocess.run([VIRGA, "rain", "--quiet", "-", "-o", "same.mkv", "--codec", "ffv1", *OFF], cwd=self.folder,
                                  stdin=clip, capture_output=True, timeout=120)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_namedPipe(self):
        os.mkfifo(self.folder / "pipe")
        send = subprocess.Popen(["ffmpeg", "-v", "error", "-y", "-i", self.path("clip.mkv"), "-f", "nut", "-c:v", "rawvideo",
                                 self.path("pipe")])
        self.rain("pipe", "-o", "same.mkv", "--codec", "ffv1", *OFF)
        self.assertEqual(send.wait(), 0)
        self.assertEqual(frameCodes(self.folder / "same.mkv"), frameCodes(self.folder / "clip.mkv"))
        (self.folder / "pipe").unlink()

    def test_nothingComes(self):
        done = subprocess.run([VIRGA, "rain", "--quiet", "-", "-o", "none.mkv", *OFF], cwd=self.folder, stdin=subprocess.DEVNULL,
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 3)
        self.assertRegex(done.stderr, "^virga: standard input: .*\n$")


class Fields(CliTest):
    @classmethod
    def makePlates(cls):
        # A bar that moves 4 pixels a field.
        ffmpeg("-f", "lavfi", "-i", "color=black:s=128x96:r=50:d=0.32", "-vf",
               "geq=lum='if(between(X-4*N,20,44),200,40)':cb=128:cr=128,interlace=scan=tff:lowpass=0", "-c:v", "libx264", "-qp",
               "0", "-flags", "+ildct+ilme", "-x264-params", "tff=1", cls.folder / "fields.mp4")
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=128x96:r=25:d=0.2", "-c:v", "libx264", cls.folder / "whole.mp4")

    def comb(self, path):
        """How much rows differ from the mean of the two beside them."""
        image = readImage(path)[0][..., 0]
        return float(np.abs(image[1:-1] - 0.5 * (image[:-2] + image[2:])).mean())

    def test_fieldsAreSaidAndKept(self):
        run = self.succeeds("rain", "fields.mp4", "-o", "same.mkv", *OFF, "--codec", "ffv1")
        self.assertIn("interlaced, top field first", run.err)
        self.assertEqual(frameCodes(self.folder / "same.mkv"), frameCodes(self.folder / "fields.mp4"))
        self.assertIn("top field first", json.loads(self.succeeds("info", "fields.mp4", "--json").out)["scan"])
        self.assertEqual(json.loads(self.succeeds("info", "whole.mp4", "--json").out)["scan"], "progressive")

    def test_deinterlaced(self):
        flags = [*OFF, "--float", "--frames", "3"]
        self.assertFalse(self.rain("fields.mp4", "-o", "comb.exr", *flags)["plate"]["deinterlaced"])
        self.assertTrue(self.rain("fields.mp4", "-o", "smooth.exr", *flags, "--deinterlace")["plate"]["deinterlaced"])
        self.assertLess(self.comb(self.folder / "smooth.exr"), 0.05 * self.comb(self.folder / "comb.exr"))
        # The first field's lines are those of the plate.
        before, after = (readImage(self.folder / name)[0][0::2] for name in ("comb.exr", "smooth.exr"))
        np.testing.assert_array_equal(before, after)

    def test_deinterlacingIsTheSameInAnyOrder(self):
        self.rain("fields.mp4", "-o", "a.%d.exr", *OFF, "--deinterlace")
        self.rain("fields.mp4", "-o", "b.%d.exr", *OFF, "--deinterlace", "--frames", "5,1,7,0")
        for frame in (5, 1, 7, 0):
            np.testing.assert_array_equal(readImage(self.folder / f"a.{frame}.exr")[0], readImage(self.folder / f"b.{frame}.exr")[0])

    def test_whatIsWholeStays(self):
        run = self.succeeds("rain", "whole.mp4", "-o", "same.mkv", *OFF, "--codec", "ffv1", "--deinterlace")
        self.assertIn("progressive", run.err)
        self.assertEqual(frameCodes(self.folder / "same.mkv"), frameCodes(self.folder / "whole.mp4"))


class Damage(CliTest):
    """Cut off and changed anywhere: an answer or a sentence, never a crash or a hang."""

    CLIPS = {"h264.mp4": X264, "hevc.mkv": X265, "vp9.webm": ["-c:v", "libvpx-vp9"], "mpeg2.ts": ["-c:v", "mpeg2video"],
             "prores.mov": prores(3), "ffv1.mkv": ["-c:v", "ffv1"], "mjpeg.avi": ["-c:v", "mjpeg"], "raw.nut": ["-c:v", "rawvideo"]}

    @classmethod
    def makePlates(cls):
        for name, encoder in cls.CLIPS.items():
            ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={SIZE}:r=25:d={FRAMES / 25}", "-pix_fmt",
                   "yuv422p10" if "prores" in name else "yuv420p", *encoder, cls.folder / name)

    def survives(self, name, data, *arguments):
        path = self.folder / ("bad" + os.path.splitext(name)[1])
        path.write_bytes(data)
        run = self.virga("rain", "--quiet", path.name, "-o", "out.mkv", *OFF, "--codec", "ffv1", *arguments)
        self.assertIn(run.code, (0, 3), run)
        if run.code == 3:
            self.assertRegex(run.err, rf"(?m)^virga: .*{path.name}.*$")
        return run

    def test_cutOff(self):
        for name in self.CLIPS:
            data = (self.folder / name).read_bytes()
            for share in range(0, 100, 20):
                with self.subTest(clip=name, share=share):
                    self.survives(name, data[:len(data) * share // 100], "--on-error", "skip")

    def test_changedBytes(self):
        chance = random.Random(20)
        for name in self.CLIPS:
            for seed in range(6):
                data = bytearray((self.folder / name).read_bytes())
                for _ in range(1 << chance.randrange(6)):
                    data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
                with self.subTest(clip=name, seed=seed):
                    self.survives(name, bytes(data), "--on-error", chance.choice(["skip", "hold", "stop"]))

    def test_pictureHashOfHevc(self):
        """A decoder that is told what the picture should be (D.3.19) and only logs it: those frames, and no others, are named."""
        plate = self.folder / "hash.mkv"
        # Noise makes packets of which the middle is picture.
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={SIZE}:r=25:d={FRAMES / 25}", "-vf", "noise=alls=40:allf=t:all_seed=2", "-c:v",
               "libx265", "-x265-params", "hash=1:log-level=none:keyint=4:bframes=2", plate)
        packets = json.loads(subprocess.run(["ffprobe", "-v", "error", "-of", "json", "-show_entries", "packet=pos,size", str(plate)],
                                            check=True, capture_output=True).stdout)["packets"]
        whole, found = frameCodes(plate), 0
        self.assertNotIn("damaged", self.succeeds("rain", plate, "-o", "out.mkv", *OFF, "--codec", "ffv1").err)
        for packet in packets:
            data = bytearray(plate.read_bytes())
            data[int(packet["pos"]) + int(packet["size"]) // 2] ^= 4
            (self.folder / "bad.mkv").write_bytes(data)
            shown = frameCodes(self.folder / "bad.mkv", extra=["-v", "quiet"])
            self.assertEqual(len(shown), FRAMES)
            wrong = {i for i in range(FRAMES) if shown[i] != whole[i]}
            run = self.virga("rain", "bad.mkv", "-o", "out.mkv", *OFF, "--codec", "ffv1", "--on-error", "skip")
            named = {int(n) for n in re.findall(r"frame (\d+) is damaged", run.err)}
            self.assertEqual(named, wrong, run)
            if len(wrong) < FRAMES:
                self.assertEqual(frameCodes(self.folder / "out.mkv"), [whole[i] for i in range(FRAMES) if i not in wrong])
            if wrong:
                self.survives("bad.mkv", bytes(data), "--on-error", "hold")
                self.refused(3, f"frame {min(wrong)} is damaged", "rain", "bad.mkv", "-o", "p.mkv", *OFF, "--codec", "ffv1",
                             "--quiet")
            found += len(wrong)
        self.assertGreater(found, 2 * len(packets))

    def test_wrongExtension(self):
        shutil.copy(self.folder / "h264.mp4", self.folder / "wrong.avi")
        self.rain("wrong.avi", "-o", "same.mkv", *OFF, "--codec", "ffv1")
        self.assertEqual(frameCodes(self.folder / "same.mkv"), frameCodes(self.folder / "h264.mp4"))
        shutil.copy(self.folder / "h264.mp4", self.folder / "wrong.png")
        self.refused(3, "wrong.png", "rain", "wrong.png", "-o", "o.png", *OFF)

    def test_sizes(self):
        for size in ("1x1", "1x37", "63x47", "5000x2"):
            with self.subTest(size=size):
                ffmpeg("-f", "lavfi", "-i", f"testsrc2=s=64x48:r=25:d=0.12", "-vf", f"scale={size}", "-pix_fmt", "yuv420p", "-c:v", "ffv1",
                       self.folder / "odd.mkv")
                self.rain("odd.mkv", "-o", "same.mkv", *OFF, "--codec", "ffv1")
                self.assertEqual(frameCodes(self.folder / "same.mkv"), frameCodes(self.folder / "odd.mkv"))


if __name__ == "__main__":
    unittest.main()
