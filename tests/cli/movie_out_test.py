"""Movies out: what every encoder and container makes of a plate, without loss code for code; time, tags, timecode, chapters,
sound and metadata; packets copied where nothing happens; what is left when the program is killed.

VIRGA_FORMATS_OUT names a file to which each row of the table is added as a line of JSON (scripts/make_formats_page.py)."""
import json
import os
import signal
import subprocess
import time
import unittest

import numpy as np
from support import CHEAP, OFF, VIRGA, CliTest, ffmpeg, frameTimes, packetTable, probe, readImage

FRAMES = 6
ENCODE = [*OFF, "--reencode"]

# codec in words, encoder, extra flags, pixel formats of the plate, containers; lossless: code for code
LOSSLESS = [
    ("FFV1", "ffv1", [], ["yuv420p", "yuv422p10", "yuv444p12", "yuv411p", "yuv440p", "yuv444p16", "yuva420p", "yuva444p10",
                          "gray", "gray10", "gray16", "gbrp", "gbrp10", "gbrp12", "gbrp16", "gbrap", "gbrap10"], "mkv"),
    ("FFV1", "ffv1", [], ["yuv420p", "yuv422p10"], "avi"),
    ("H.264", "libx264", ["--codec-options", "qp=0"], ["yuv420p", "yuv422p", "yuv444p"], "mp4"),
    ("H.264", "libx264", ["--codec-options", "qp=0"], ["yuv420p10", "yuv422p10", "yuv444p10"], "mkv"),
    ("HEVC", "libx265", ["--codec-options", "x265-params=lossless=1"], ["yuv420p", "yuv422p10", "yuv444p12"], "mp4"),
    ("VP9", "libvpx-vp9", ["--codec-options", "lossless=1"], ["yuv420p", "yuv444p", "yuv422p10"], "webm"),
    ("HuffYUV", "ffvhuff", [], ["yuv420p", "yuv422p10", "yuva444p"], "mkv"),
    ("UT Video", "utvideo", [], ["yuv420p", "yuv422p", "yuv444p", "gbrp", "gbrap"], "mkv"),
    ("raw", "rawvideo", [], ["yuv420p", "yuv444p10", "rgb24", "rgba", "uyvy422"], "nut"),
    ("raw", "rawvideo", [], ["yuv422p", "uyvy422", "rgb24", "rgb48be", "gray16"], "mov"),
    ("raw", "rawvideo", [], ["yuv420p", "yuv422p", "gray", "rgb24", "rgba"], "avi"),
    ("raw", "rawvideo", [], ["yuv420p", "yuv422p", "gray", "rgba"], "mkv"),
    ("PNG", "png", [], ["rgb24", "rgba", "rgb48be"], "mov"),
    ("QuickTime Animation", "qtrle", [], ["rgb24", "argb"], "mov"),
]
LOSSY = [
    ("H.264", "libx264", [], ["yuv420p"], ["mp4", "mov", "mkv", "ts", "avi"]),
    ("HEVC", "libx265", [], ["yuv420p10"], ["mp4", "mov", "mkv", "ts"]),
    ("ProRes 422 HQ", "prores_ks", ["--profile", "hq"], ["yuv422p10"], ["mov", "mkv"]),
    ("ProRes 4444", "prores_ks", ["--profile", "4444"], ["yuva444p10"], ["mov"]),
    ("VP9", "libvpx-vp9", [], ["yuv420p", "yuv420p10"], ["webm", "mkv"]),
    ("AV1", "libsvtav1", ["--preset", "10"], ["yuv420p"], ["mp4", "mkv"]),
    ("MPEG-2", "mpeg2video", [], ["yuv420p"], ["mpg", "ts", "mxf"]),
    ("MJPEG", "mjpeg", [], ["yuvj420p"], ["avi", "mov"]),
]


def note(**row):
    if path := os.environ.get("VIRGA_FORMATS_OUT"):
        with open(path, "a") as file:
            file.write(json.dumps(row) + "\n")


def codes(path, pixelFormat):
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:v:0", "-fps_mode", "passthrough", "-pix_fmt",
                           pixelFormat, "-f", "framemd5", "-"], check=True, capture_output=True, text=True, timeout=120)
    return [line.split(",")[-1].strip() for line in done.stdout.splitlines() if line and not line.startswith("#")]


def streamHashes(path):
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0", "-map", "-0:d?", "-c", "copy", "-f",
                           "streamhash", "-"], check=True, capture_output=True, text=True, timeout=60)
    return done.stdout.split()


def ffprobe(path, *entries):
    done = subprocess.run(["ffprobe", "-v", "error", "-of", "json", *entries, str(path)], check=True, capture_output=True,
                          timeout=60)
    return json.loads(done.stdout)


class Encoders(CliTest):
    def plate(self, pixelFormat, size="64x48", arguments=()):
        path = self.folder / "plate.mkv"
        # Noise reaches the codes that pictures should not have: 0 to 15 and 236 to 255.
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r=25:d={FRAMES / 25}", "-vf",
               f"noise=alls=60:allf=t:all_seed=3,format={pixelFormat}", "-c:v", "ffv1", *arguments, path)
        return path

    def test_lossless(self):
        for codec, encoder, flags, pixelFormats, container in LOSSLESS:
            for pixelFormat in pixelFormats:
                for rangeName in (("tv", "pc") if pixelFormat.startswith("yuv") else ("pc",)):
                    with self.subTest(codec=codec, pixelFormat=pixelFormat, range=rangeName, container=container):
                        plate = self.plate(pixelFormat, arguments=["-color_range", rangeName])
                        own = probe(plate)["pix_fmt"]
                        compared = "gbrp" if own == "bgr0" else own
                        # As decoded, and, where somebody looks at the light, from there and back.
                        for way in ([], ["--preview", "sheet.png"]):
                            self.rain(plate, "-o", f"out.{container}", *ENCODE, "--codec", encoder, *flags, *way)
                            result = self.folder / f"out.{container}"
                            # yuvj420p is yuv420p of full range; asking for the other name would convert it.
                            same = "yuvj" + own[3:] if probe(result)["pix_fmt"].startswith("yuvj") else compared
                            self.assertEqual(codes(result, same), codes(plate, compared), way)
                        note(direction="through", codec=codec, pixel_format=pixelFormat, container=container, range=rangeName,
                             max_error_codes=0)

    def test_lossy(self):
        for codec, encoder, flags, pixelFormats, containers in LOSSY:
            for pixelFormat in pixelFormats:
                plate = self.plate(pixelFormat, "160x96")
                for container in containers:
                    with self.subTest(codec=codec, pixelFormat=pixelFormat, container=container):
                        self.rain(plate, "-o", f"out.{container}", *ENCODE, "--codec", encoder, *flags)
                        shown = probe(self.folder / f"out.{container}")
                        self.assertEqual(int(shown["nb_read_frames"]), FRAMES)
                        self.assertEqual((shown["width"], shown["height"]), (160, 96))
                        note(direction="out", codec=codec, pixel_format=shown["pix_fmt"], container=container)

    def test_untouchedPixelsUnderRain(self):
        """Where no stroke falls, as the layers of the same frames have it, the codes are the plate's."""
        for pixelFormat, kind in (("yuv444p", "u1"), ("yuv444p10", "<u2"), ("gbrp", "u1")):
            with self.subTest(pixelFormat=pixelFormat):
                plate = self.plate(pixelFormat)
                self.rain(plate, "-o", "wet.mkv", "--codec", "ffv1", "--rate", "5", *CHEAP)
                raw = [np.frombuffer(subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt",
                                                     pixelFormat, "-"], check=True, capture_output=True).stdout, kind).reshape(FRAMES, 3, 48, 64)
                       for path in (plate, self.folder / "wet.mkv")]
                changed = (raw[0] != raw[1]).any(axis=1)
                self.rain(plate, "-o", "wet.%d.exr", "--layers", "--rate", "5", *CHEAP)
                for frame in range(FRAMES):
                    image, names = readImage(self.folder / f"wet.{frame}.exr")
                    wet = image[..., names.index("rain.A")] > 0
                    self.assertFalse((changed[frame] & ~wet).any())
                    self.assertGreater((~wet).mean(), 0.2)
                self.assertTrue(changed.any())

    def test_whatNobodyKnows(self):
        self.plate("yuv420p")
        for flags, words in ((["--pixel-format", "yuv999"], ["yuv999"]), (["--codec", "prores_ks", "--profile", "best"], ["best"]),
                             (["--codec-options", "colour=3"], ["colour"]),
                             (["--container", "tape"], ["tape", "mp4"])):
            with self.subTest(flags=flags):
                self.refused(2, words, "rain", "--quiet", "plate.mkv", "-o", "out.mkv" if "prores_ks" not in flags else "out.mov",
                             *ENCODE, *flags)
        for encoder, flags in (("libx264", ["--preset", "warp"]), ("libx265", ["--preset", "warp"]),
                               ("libx264", ["--codec-options", "tune=warp"]), ("libsvtav1", ["--preset", "99"])):
            with self.subTest(encoder=encoder, flags=flags):
                self.refused(2, [flags[0], flags[1], encoder], "rain", "--quiet", "plate.mkv", "-o", "out.mkv", *ENCODE, "--codec",
                             encoder, *flags)


class Beside(CliTest):
    """What is in a movie beside its pictures."""

    @classmethod
    def makePlates(cls):
        (cls.folder / "chapters.txt").write_text(";FFMETADATA1\ntitle=Street\ncomment=take 3\n"
                                                 "[CHAPTER]\nTIMEBASE=1/1000\nSTART=0\nEND=400\ntitle=One\n"
                                                 "[CHAPTER]\nTIMEBASE=1/1000\nSTART=400\nEND=800\ntitle=Two\n")
        (cls.folder / "words.srt").write_text("1\n00:00:00,100 --> 00:00:00,500\nIt rains.\n")
        for name, codec, extra in (("plate.mov", "aac", []), ("plate.mkv", "flac", ["-i", cls.folder / "words.srt", "-map", "4"])):
            ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.8", "-f", "lavfi", "-i", "sine=f=440:d=0.8", "-f", "lavfi", "-i",
                   "sine=f=880:d=0.8", "-i", cls.folder / "chapters.txt", *extra[:2], "-map", "0", "-map", "1", "-map", "2",
                   *extra[2:], "-map_metadata", "3", "-timecode", "01:00:00:10", "-c:v", "libx264", "-bf", "2", "-c:a", codec,
                   "-metadata:s:a:1", "language=deu", cls.folder / name)

    def checkBeside(self, result, plate):
        for stream in ("a:0", "a:1"):
            self.assertEqual(packetTable(result, stream), packetTable(plate, stream))
        chapters = ffprobe(result, "-show_chapters")["chapters"]
        self.assertEqual([(c["start_time"], c["tags"]["title"]) for c in chapters], [("0.000000", "One"), ("0.400000", "Two")])
        tags = {k.lower(): v for k, v in ffprobe(result, "-show_entries", "format_tags")["format"]["tags"].items()}
        self.assertEqual((tags["title"], tags["comment"]), ("Street", "take 3"))
        self.assertIn("01:00:00:10", json.dumps(ffprobe(result, "-show_entries", "format_tags:stream_tags")))
        languages = [ffprobe(path, "-select_streams", "a:1", "-show_entries", "stream_tags=language")["streams"]
                     for path in (result, plate)]
        self.assertEqual(languages[0], languages[1])

    def test_encoded(self):
        for name in ("plate.mov", "plate.mkv"):
            with self.subTest(plate=name):
                result = "out" + os.path.splitext(name)[1]
                self.assertFalse(self.rain(name, "-o", result, *ENCODE)["stream_copied"])
                self.checkBeside(self.folder / result, self.folder / name)
                note(direction="beside", container=name[6:], sound="equal", timecode="equal", chapters="equal")

    def test_copied(self):
        for name in ("plate.mov", "plate.mkv"):
            with self.subTest(plate=name):
                result = "out" + os.path.splitext(name)[1]
                self.assertTrue(self.rain(name, "-o", result, *OFF)["stream_copied"])
                self.checkBeside(self.folder / result, self.folder / name)
                self.assertEqual(streamHashes(self.folder / result), streamHashes(self.folder / name))
                self.assertEqual(frameTimes(self.folder / result), frameTimes(self.folder / name))

    def test_copyKeepsThePlate(self):
        (self.folder / "link.mkv").symlink_to("plate.mkv")
        for output in ("plate.mkv", "./plate.mkv", "link.mkv"):
            self.refused(5, [output, "the plate itself"], "rain", "--quiet", "plate.mkv", "-o", output, *OFF)
        self.refused(5, "the folder none does not exist", "rain", "--quiet", "plate.mkv", "-o", "none/out.mkv", *OFF)

    def test_whatAnEditListHidesIsNotCopied(self):
        ffmpeg("-ss", "0.3", "-i", self.folder / "plate.mov", "-map", "0:v", "-c", "copy", self.folder / "edited.mov")
        frames = int(probe(self.folder / "edited.mov")["nb_read_frames"])
        self.assertFalse(self.rain("edited.mov", "-o", "out.mov", *OFF)["stream_copied"])
        self.assertEqual(int(probe(self.folder / "out.mov")["nb_read_frames"]), frames)
        piped = subprocess.run([VIRGA, "rain", "--quiet", "edited.mov", "-o", "-", "--container", "mp4", *OFF], cwd=self.folder,
                               capture_output=True, timeout=120)
        (self.folder / "piped.mp4").write_bytes(piped.stdout)
        self.assertEqual(int(probe(self.folder / "piped.mp4")["nb_read_frames"]), frames)
        decoded = subprocess.run(["ffmpeg", "-v", "error", "-i", self.path("piped.mp4"), "-f", "null", "-"], capture_output=True)
        self.assertEqual(decoded.stderr, b"")

    def test_turnedPlateIsCopiedWithItsTurn(self):
        ffmpeg("-i", self.folder / "plate.mov", "-map", "0:v", "-c", "copy", "-metadata:s:v:0", "rotate=90",
               self.folder / "turned.mov")
        turn = lambda name: [d.get("rotation") for d in probe(self.folder / name).get("side_data_list", [])]
        self.assertEqual(len(turn("turned.mov")), 1)
        self.assertTrue(self.rain("turned.mov", "-o", "out.mov", *OFF)["stream_copied"])
        self.assertEqual(turn("out.mov"), turn("turned.mov"))
        self.rain("turned.mov", "-o", "out.mov", *ENCODE)
        self.assertEqual((turn("out.mov"), probe(self.folder / "out.mov")["width"]), ([], 48))

    def test_soundOfMp4(self):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.4", "-f", "lavfi", "-i", "sine=d=0.4", "-c:a", "flac", "-strict", "-2",
               self.folder / "flac.mp4")
        self.rain("flac.mp4", "-o", "out.mp4", *ENCODE)
        self.assertEqual(packetTable(self.folder / "out.mp4", "a:0"), packetTable(self.folder / "flac.mp4", "a:0"))

    def test_variableRateNeedsTimeStamps(self):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.8", "-vf", "select='not(eq(mod(n,5),2))'", "-fps_mode", "vfr",
               self.folder / "vfr.mkv")
        self.refused(2, ["out.y4m", "varies", "--fps"], "rain", "--quiet", "vfr.mkv", "-o", "out.y4m", *OFF)
        self.rain("vfr.mkv", "-o", "out.y4m", *OFF, "--fps", "25")

    def test_copiedOnlyIfNothingElseIsAsked(self):
        for flags in (["--codec", "ffv1"], ["--quality", "20"], ["--frames", "0-10x2"], ["--fps", "30"], ["--preview", "p.png"],
                      ["--output-colorspace", "Rec.2020"], ["--pixel-format", "yuv422p"], ["--reencode"]):
            with self.subTest(flags=flags):
                self.assertFalse(self.rain("plate.mkv", "-o", "out.mkv", *OFF, *flags)["stream_copied"])
        self.assertFalse(self.rain("plate.mkv", "-o", "out.mkv", *CHEAP, "--rate", "1")["stream_copied"])
        self.assertFalse(self.rain("plate.mkv", "-o", "out.avi", *OFF)["stream_copied"])

    def test_cut(self):
        """From frame 10: sound, chapters and timecode begin there."""
        self.rain("plate.mov", "-o", "out.mov", *ENCODE, "--frames", "10-19")
        self.assertIn("01:00:00:20", json.dumps(ffprobe(self.folder / "out.mov", "-show_entries", "stream_tags=timecode")))
        chapters = ffprobe(self.folder / "out.mov", "-show_chapters")["chapters"]
        self.assertEqual([c["tags"]["title"] for c in chapters], ["Two"])
        self.assertLess(len(packetTable(self.folder / "out.mov", "a:0")), len(packetTable(self.folder / "plate.mov", "a:0")))

    def test_hdr(self):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x64:r=25:d=0.2", "-c:v", "libx265", "-pix_fmt", "yuv420p10", "-color_primaries",
               "bt2020", "-color_trc", "smpte2084", "-colorspace", "bt2020nc", "-x265-params",
               "log-level=none:master-display=G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,50):max-cll=1000,400",
               self.folder / "hdr.mkv")
        self.rain("hdr.mkv", "-o", "out.mkv", *ENCODE)
        said = json.dumps(ffprobe(self.folder / "out.mkv", "-show_frames", "-read_intervals", "%+#1"))
        for word in ("34000/50000", "10000000/10000", '"max_content": 1000', '"max_average": 400'):
            self.assertIn(word, said)

    def test_fields(self):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=50:d=0.4", "-vf", "interlace=scan=tff", "-c:v", "libx264", "-flags",
               "+ildct+ilme", "-x264-params", "tff=1", self.folder / "fields.mp4")
        self.rain("fields.mp4", "-o", "out.mp4", *ENCODE)
        frames = ffprobe(self.folder / "out.mp4", "-show_entries", "frame=interlaced_frame,top_field_first")["frames"]
        self.assertTrue(all(f["interlaced_frame"] == 1 and f["top_field_first"] == 1 for f in frames))
        self.rain("fields.mp4", "-o", "out.mp4", *ENCODE, "--deinterlace")
        frames = ffprobe(self.folder / "out.mp4", "-show_entries", "frame=interlaced_frame")["frames"]
        self.assertTrue(all(f["interlaced_frame"] == 0 for f in frames))

    def test_holesOfASequenceAreHolesInTime(self):
        for frame in (1, 2, 5, 6):
            ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48", "-frames:v", "1", self.folder / f"s.{frame:04d}.png")
        self.rain("s.%04d.png", "-o", "out.mkv", *OFF, "--fps", "25", "--on-error", "skip")
        self.assertEqual([round(25 * t) for t in frameTimes(self.folder / "out.mkv")], [0, 1, 4, 5])


class Outside(CliTest):
    """Pipes, full disks, and the end of the program."""

    @classmethod
    def makePlates(cls):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=320x240:r=25:d=4", "-c:v", "libx264", "-g", "10", cls.folder / "clip.mp4")

    def test_standardOutput(self):
        for container in ("nut", "matroska", "y4m", "mp4", "mov", "mpegts"):
            with self.subTest(container=container):
                flags = ["--codec", "ffv1"] if container in ("nut", "matroska") else []
                made = subprocess.run([VIRGA, "rain", "--quiet", "clip.mp4", "-o", "-", "--container", container, "--frames", "0-7",
                                       *ENCODE, *flags], cwd=self.folder, capture_output=True, timeout=120)
                self.assertEqual(made.returncode, 0, made.stderr)
                (self.folder / "piped").write_bytes(made.stdout)
                self.assertEqual(int(probe(self.folder / "piped")["nb_read_frames"]), 8)
        self.refused(2, ["--container"], "rain", "--quiet", "clip.mp4", "-o", "-", *ENCODE)
        self.refused(2, ["avi", "standard output"], "rain", "--quiet", "clip.mp4", "-o", "-", "--container", "avi", *ENCODE)

    def test_readerThatGoesAway(self):
        process = subprocess.Popen([VIRGA, "rain", "--quiet", "clip.mp4", "-o", "-", "--container", "nut", "--codec", "rawvideo",
                                    *ENCODE], cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        process.stdout.read(1000)
        process.stdout.close()
        said = process.stderr.read().decode()
        self.assertEqual(process.wait(timeout=60), 5, said)
        self.assertRegex(said, "^virga: standard output: .*\n$")

    def test_killed(self):
        """What lies there under the temporary name plays up to the last whole group of pictures."""
        for name in ("out.mp4", "out.mov", "out.mkv"):
            with self.subTest(name=name):
                partial = None
                process = self.start("rain", "--quiet", "clip.mp4", "-o", name, "--codec", "libx264", "--codec-options", "g=5",
                                     "--rate", "80", "--threads", "1")
                deadline = time.monotonic() + 60
                while process.poll() is None and time.monotonic() < deadline:
                    partial = next(self.folder.glob(f".{name[:3]}.partial-*{name[3:]}"), None)
                    if partial and partial.stat().st_size > 150_000:
                        break
                    time.sleep(0.01)
                process.send_signal(signal.SIGKILL)
                process.communicate()
                if process.returncode == 0:
                    self.skipTest("it was done before it could be killed")
                self.assertFalse((self.folder / name).exists())
                self.assertGreater(int(probe(partial)["nb_read_frames"]), 0)
                run = self.succeeds("rain", "clip.mp4", "-o", name, *ENCODE, "--frames", "0-3")
                self.assertIn(partial.name, run.err)
                self.assertFalse(partial.exists())


if __name__ == "__main__":
    unittest.main()
