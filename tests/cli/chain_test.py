"""virga rain between two ffmpegs, without a plug-in (docs/plugins.md): NUT and Y4M on both its pipes, of every depth and
subsampling that they have, with what they say of fields, aspect, rate, sound and timecode."""
import json
import subprocess
import unittest

from support import OFF, VIRGA, CliTest, ffmpeg

SIZE = "96x64"
FRAMES = 4
WETTER = ["--rate", "80", "--fog", "0.01", "--threads", "1"]
Y4M = ["yuv420p", "yuv411p", "yuv422p", "yuv444p", "gray", "yuv420p10", "yuv422p10", "yuv444p10", "gray10", "yuv420p12", "yuv444p16"]
NUT = [*Y4M, "yuv410p", "yuv440p", "yuva444p", "yuva422p10", "rgb24", "rgba", "gbrp10", "rgb48", "gray16"]
NAMES = {"y4m": "yuv4mpegpipe", "nut": "nut"}


def muxer(container):
    return ["-strict", "-1", *(["-c:v", "rawvideo"] if container == "nut" else []), "-f", NAMES[container]]


def codes(path, pixelFormat=None):
    """One checksum a picture, of its codes as ffmpeg decodes them."""
    convert = ["-pix_fmt", pixelFormat] if pixelFormat else []
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:v:0", *convert, "-f", "framemd5", "-"],
                          check=True, capture_output=True, text=True, timeout=120)
    return [line.split(",")[-1].strip() for line in done.stdout.splitlines() if line and not line.startswith("#")]


def stream(path, kind="v", keys="pix_fmt,sample_aspect_ratio,field_order,r_frame_rate,width,height"):
    done = subprocess.run(["ffprobe", "-v", "error", "-select_streams", f"{kind}:0", "-show_entries",
                           f"stream={keys}:stream_tags=timecode:format_tags=timecode", "-of", "json", str(path)], check=True,
                          capture_output=True, text=True, timeout=60)
    found = json.loads(done.stdout)
    tags = {**found.get("format", {}).get("tags", {}), **found["streams"][0].pop("tags", {})}
    return found["streams"][0], tags


class Chain(CliTest):
    def clip(self, pixelFormat, container, filters="", *more):
        path = self.folder / f"in.{container}"
        ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={SIZE}:r=25:d={FRAMES / 25}", *more, "-vf",
               f"format={pixelFormat}{filters}", *muxer(container), path)
        return path

    def chained(self, clip, container, *settings):
        """ffmpeg | virga rain - -o - | ffmpeg, into a file of FFV1. All three must end well, in silence."""
        out = self.folder / "chained.mkv"
        first = subprocess.Popen(["ffmpeg", "-v", "error", "-i", str(clip), "-map", "0", "-c:a", "copy", *muxer(container), "-"],
                                 stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        second = subprocess.Popen([VIRGA, "rain", "-", "-o", "-", "--container", container, "--quiet", *settings],
                                  stdin=first.stdout, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=self.folder)
        third = subprocess.Popen(["ffmpeg", "-v", "error", "-y", "-f", NAMES[container], "-i", "-", "-map", "0", "-c:v", "ffv1",
                                  "-c:a", "copy", str(out)], stdin=second.stdout, stderr=subprocess.PIPE)
        first.stdout.close()
        second.stdout.close()
        said = [process.communicate(timeout=120)[1] for process in (third, second, first)]
        self.assertEqual([p.returncode for p in (first, second, third)], [0, 0, 0], said)
        self.assertEqual(said, [b"", b"", b""])
        return out

    def test_noEffectIsNoChange(self):
        """Through the pipes and back into the same format, code for code."""
        for container, formats in (("y4m", Y4M), ("nut", NUT)):
            for pixelFormat in formats:
                with self.subTest(container=container, pixelFormat=pixelFormat):
                    clip = self.clip(pixelFormat, container)
                    expected = codes(clip, pixelFormat)
                    self.assertEqual(len(expected), FRAMES)
                    # FFV1 keeps R G B in an order of its own.
                    self.assertEqual(codes(self.chained(clip, container, *OFF, "--reencode"), pixelFormat), expected)

    def test_rainIsThatOfFiles(self):
        """The chain's codes are those of `virga rain FILE -o FILE`."""
        for container, pixelFormat in (("y4m", "yuv420p"), ("y4m", "yuv422p10"), ("nut", "yuv420p10"), ("nut", "rgb24")):
            with self.subTest(container=container, pixelFormat=pixelFormat):
                clip = self.clip(pixelFormat, container)
                self.rain(clip, "-o", "file.mkv", "--codec", "ffv1", *WETTER)
                expected = codes(self.folder / "file.mkv")
                self.assertNotEqual(expected, codes(clip))
                self.assertEqual(codes(self.chained(clip, container, *WETTER)), expected)

    def test_whatTheHeaderSays(self):
        for container, filters, more in (("y4m", ",setsar=4/3", []), ("nut", ",setsar=4/3", []),
                                         ("y4m", ",setfield=tff", ["-field_order", "tt"]),
                                         ("y4m", ",setfield=bff", ["-field_order", "bb"]),
                                         ("y4m", ",fps=30000/1001", []), ("nut", ",fps=30000/1001", [])):
            with self.subTest(container=container, filters=filters):
                clip = self.clip("yuv420p10", container, filters, *more)
                passed = self.folder / f"out.{container}"
                with open(clip, "rb") as source, open(passed, "wb") as target:
                    done = subprocess.run([VIRGA, "rain", "-", "-o", "-", "--container", container, "--quiet", *WETTER],
                                          stdin=source, stdout=target, stderr=subprocess.PIPE, timeout=120)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertEqual(stream(passed), stream(clip))

    def test_soundAndTimecode(self):
        clip = self.clip("yuv420p10", "nut", "", "-f", "lavfi", "-i", f"sine=d={FRAMES / 25}", "-c:a", "pcm_s16le", "-timecode",
                         "01:00:00:00")
        out = self.chained(clip, "nut", *WETTER)
        sound = [subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:a", "-f", "md5", "-"], check=True,
                                capture_output=True, timeout=60).stdout for path in (clip, out)]
        self.assertEqual(sound[0], sound[1])
        self.assertEqual({k.lower(): v for k, v in stream(out)[1].items()}["timecode"], "01:00:00:00")

    def test_readerThatGoesAway(self):
        """`| head`: one sentence and exit code 5, whether anything is rendered or all is copied."""
        clip = self.clip("yuv444p16", "nut", ",loop=100:1")
        for settings in (WETTER, OFF):
            with self.subTest(settings=settings), open(clip, "rb") as source:
                process = subprocess.Popen([VIRGA, "rain", "-", "-o", "-", "--container", "nut", "--quiet", *settings], stdin=source,
                                           stdout=subprocess.PIPE, stderr=subprocess.PIPE)
                process.stdout.read(1000)
                process.stdout.close()
                said = process.stderr.read().decode()
                self.assertEqual(process.wait(timeout=60), 5, said)
                self.assertRegex(said, "^virga: standard output: .*\n$")

    def test_writerThatBreaksOff(self):
        """A sender that dies amid a picture: what came whole is rendered."""
        clip = self.clip("yuv420p", "y4m")
        data = clip.read_bytes()
        done = subprocess.run([VIRGA, "rain", "-", "-o", "-", "--container", "y4m", *OFF, "--reencode", "--on-error", "skip"],
                              input=data[:-100], capture_output=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        (self.folder / "cut.y4m").write_bytes(done.stdout)
        self.assertEqual(codes(self.folder / "cut.y4m"), codes(clip)[:-1])


if __name__ == "__main__":
    unittest.main()
