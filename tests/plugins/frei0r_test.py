"""The frei0r filter in hosts that others wrote: ffmpeg's filter `frei0r` and melt. Their frames are those of `virga rain` at 8
bits, code for code, each lit by itself (--env-frames 0)."""
import ctypes
import os
import subprocess
import threading
import unittest
from pathlib import Path

from support import CliTest, ffmpeg

FOLDER = os.environ.get("VIRGA_FREI0R", "")
if not os.path.exists(f"{FOLDER}/virga.so"):
    raise SystemExit(f"VIRGA_FREI0R='{FOLDER}' must name the folder of virga.so")
if os.environ.get("VIRGA_SANITIZE"):
    print("skipped: hosts that are not built with sanitizers do not load a plug-in that is")
    raise SystemExit(0)
FOOTAGE = os.environ.get("VIRGA_FOOTAGE_DIR", "")
FRAMES = 6
INDEX = {name: i for i, name in enumerate(("rate", "wind", "fog", "darkening", "seed", "settings", "opacity", "fps", "time"))}
STARTS = {"rate": 0.125, "wind": 0.5, "fog": 0, "darkening": 0.1, "seed": 0.001, "settings": "", "opacity": 0.25, "fps": 0.025,
          "time": 0}


def codes(path):
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:v:0", "-pix_fmt", "rgba", "-f", "framemd5", "-"],
                          check=True, capture_output=True, text=True, timeout=120)
    return [line.split(",")[-1].strip() for line in done.stdout.splitlines() if line and not line.startswith("#")]


class InHosts(CliTest):
    @classmethod
    def makePlates(cls):
        cls.plate(cls, "clip.mkv", "-f", "lavfi", "-i", f"testsrc2=s=128x72:r=25:d={FRAMES / 25}")

    def plate(self, name, *source):
        """R G B in 8 bits, so that ffmpeg and melt hand on the very codes that virga reads."""
        ffmpeg(*source, "-an", "-frames:v", FRAMES, "-c:v", "ffv1", "-pix_fmt", "bgra", self.folder / name)

    def byRain(self, plate, *settings):
        """Of the pictures as PNG: movies are converted eight pixels at a time, which rounds two codes in 100,000 otherwise."""
        for old in self.folder.glob("[po].*.png"):
            old.unlink()
        ffmpeg("-i", self.folder / plate, "-pix_fmt", "rgb24", "-start_number", "0", self.folder / "p.%d.png")
        self.rain("p.%d.png", "-o", "o.%d.png", "--env-frames", "0", *(() if "--fps" in settings else ("--fps", "25")), *settings)
        ffmpeg("-start_number", "0", "-i", self.folder / "o.%d.png", "-c:v", "ffv1", "-pix_fmt", "bgra", self.folder / "rain.mkv")
        return codes(self.folder / "rain.mkv")

    def byFfmpeg(self, plate, *more, **values):
        last = max((INDEX[name] for name in values), default=-1)
        texts = [str({**STARTS, **values}[name]) for name in list(INDEX)[:last + 1]]
        done = subprocess.run(["ffmpeg", "-y", "-v", "error", *more, "-i", str(plate), "-vf", f"frei0r=virga:{'|'.join(texts)}",
                               "-c:v", "ffv1", "-pix_fmt", "bgra", "ffmpeg.mkv"], cwd=self.folder, capture_output=True,
                              text=True, timeout=240, env={**os.environ, "FREI0R_PATH": FOLDER})
        self.assertEqual(done.returncode, 0, done.stderr)
        return codes(self.folder / "ffmpeg.mkv"), done.stderr

    def byMelt(self, plate, *more, **values):
        # melt 7.12 now and then ends its consumer before the first frame, and before the filter is called, and then waits for
        # ever: it is asked again.
        out = self.folder / "melt.mkv"
        for _ in range(8):
            out.unlink(missing_ok=True)
            try:
                done = subprocess.run(["melt", "-silent", str(plate), *more, "-filter", "frei0r.virga",
                                       *(f"{n}={v}" for n, v in values.items()), "-consumer", f"avformat:{out}", "vcodec=ffv1",
                                       "pix_fmt=bgra", "real_time=-1", "an=1"], cwd=self.folder, stdin=subprocess.DEVNULL,
                                      capture_output=True, text=True, timeout=20, env={**os.environ, "FREI0R_PATH": FOLDER})
            except subprocess.TimeoutExpired:
                continue
            self.assertTrue(out.exists(), done.stderr)
            return codes(out)
        self.fail("melt does not end")

    def test_frames(self):
        plain = codes(self.folder / "clip.mkv")
        for values, settings in (({}, []),
                                 ({"rate": 0.4, "wind": 0.6, "darkening": 0.3, "seed": 0.007},
                                  ["--rate", "80", "--wind", "4,0", "--darken", "0.3", "--seed", "7"]),
                                 ({"fog": 0.2, "opacity": 0.5}, ["--fog", "0.01", "--opacity", "10"])):
            with self.subTest(values=values):
                expected = self.byRain("clip.mkv", *settings)
                self.assertEqual(len(expected), FRAMES)
                self.assertFalse(set(expected) & set(plain))
                self.assertEqual(self.byFfmpeg("clip.mkv", **values), (expected, ""))
                self.assertEqual(self.byMelt("clip.mkv", **values), expected)

    def test_noRainIsNoChange(self):
        (self.folder / "off.toml").write_text("desaturate = 0.0\nfog = 0.0\nblur = 0.0\nsplashes = 0.0\n")
        plain = codes(self.folder / "clip.mkv")
        self.assertEqual(self.byFfmpeg("clip.mkv", rate=0, darkening=0, settings="off.toml"), (plain, ""))
        self.assertEqual(self.byMelt("clip.mkv", rate=0, darkening=0, settings=self.path("off.toml")), plain)

    def test_settingsFile(self):
        """The file's values, but for what is set here to something else than it starts at."""
        self.rain("clip.mkv", "-o", "x.mkv", "--rate", "120", "--ground", "1.5,5", "--fps", "25", "--save-settings", "look.toml")
        expected = self.byRain("clip.mkv", "--settings", "look.toml", "--seed", "3")
        self.assertEqual(self.byFfmpeg("clip.mkv", settings="look.toml", seed=0.003), (expected, ""))
        self.assertEqual(self.byMelt("clip.mkv", settings=self.path("look.toml"), seed=0.003), expected)

    def test_timeIsFrames(self):
        """Frames are those of their time, whatever was rendered before, and at other rates."""
        whole = self.byRain("clip.mkv", "--fps", "25")
        self.assertEqual(self.byMelt("clip.mkv", "in=3"), self.cut(3))
        film = self.byRain("clip.mkv", "--fps", "23.976")
        self.assertNotEqual(film, whole)
        ffmpeg("-i", self.folder / "clip.mkv", "-vf", "setpts=N/(24000/1001)/TB", "-r", "24000/1001", "-c:v", "ffv1", "-pix_fmt",
               "bgra", self.folder / "film.mkv")
        self.assertEqual(self.byFfmpeg("film.mkv", fps=0.023976)[0], film)

    def cut(self, first):
        """melt counts a clip's frames from its cut: frame 0 of the rain over frame `first` of the plate."""
        ffmpeg("-i", self.folder / "clip.mkv", "-vf", f"select=gte(n\\,{first}),setpts=N/25/TB", "-c:v", "ffv1", "-pix_fmt", "bgra",
               self.folder / "cut.mkv")
        return self.byRain("cut.mkv")

    def test_whatCannotBeIsSaidOnce(self):
        (self.folder / "bad.toml").write_text("rate = -1.0\n")
        plain = codes(self.folder / "clip.mkv")
        for settings, words in (("none.toml", "none.toml"), ("bad.toml", "0 to 2000 mm/h")):
            with self.subTest(settings=settings):
                frames, said = self.byFfmpeg("clip.mkv", settings=settings)
                self.assertEqual(frames, plain)
                self.assertEqual(said.count("virga:"), 1, said)
                self.assertIn(words, said)

    def test_twoAtOnce(self):
        """Two instances in one chain are two rains over each other."""
        self.byRain("clip.mkv", "--seed", "2")
        (self.folder / "rain.mkv").rename(self.folder / "once.mkv")
        expected = self.byRain("once.mkv", "--seed", "3")
        done = subprocess.run(["ffmpeg", "-y", "-v", "error", "-i", "clip.mkv", "-vf",
                               "frei0r=virga:0.125|0.5|0|0.1|0.002,frei0r=virga:0.125|0.5|0|0.1|0.003", "-c:v", "ffv1", "-pix_fmt",
                               "bgra", "two.mkv"], cwd=self.folder, capture_output=True, text=True, timeout=240,
                              env={**os.environ, "FREI0R_PATH": FOLDER})
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(codes(self.folder / "two.mkv"), expected)

    @unittest.skipUnless(FOOTAGE, "VIRGA_FOOTAGE_DIR is not set")
    def test_footage(self):
        """A real clip, scaled to 320x180."""
        movies = sorted(p for p in Path(FOOTAGE).glob("*/*") if p.suffix in (".mp4", ".mov", ".mkv", ".avi", ".webm"))
        self.assertTrue(movies, f"no movie in {FOOTAGE}")
        self.plate("real.mkv", "-i", str(movies[0]), "-vf", "scale=320:180,fps=25,setpts=N/25/TB")
        expected = self.byRain("real.mkv", "--rate", "100")
        self.assertEqual(self.byFfmpeg("real.mkv", rate=0.5), (expected, ""))
        self.assertEqual(self.byMelt("real.mkv", rate=0.5), expected)
        if folder := os.environ.get("VIRGA_PICTURES_OUT"):  # to be looked at
            for name in ("real", "ffmpeg", "melt"):
                ffmpeg("-i", self.folder / f"{name}.mkv", "-frames:v", "1", f"{folder}/frei0r-{name}.png")


class ByHand(unittest.TestCase):
    """The interface itself, as a host calls it."""

    @classmethod
    def setUpClass(cls):
        cls.filter = ctypes.CDLL(f"{FOLDER}/virga.so")
        cls.filter.f0r_construct.restype = ctypes.c_void_p
        cls.filter.f0r_construct.argtypes = [ctypes.c_uint, ctypes.c_uint]
        cls.filter.f0r_destruct.argtypes = [ctypes.c_void_p]
        for call in (cls.filter.f0r_set_param_value, cls.filter.f0r_get_param_value):
            call.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_int]
        cls.filter.f0r_update.argtypes = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]

    def instance(self, width, height, **values):
        made = self.filter.f0r_construct(width, height)
        for name, value in values.items():
            self.filter.f0r_set_param_value(made, ctypes.byref(ctypes.c_double(value)), INDEX[name])
        self.addCleanup(self.filter.f0r_destruct, made)
        return made

    def frame(self, instance, width, height, time, plate=None):
        plate = plate or bytes((x * 3 + y * 5 + c * 40) % 200 if c < 3 else 255 for y in range(height) for x in range(width)
                               for c in range(4))
        out = ctypes.create_string_buffer(len(plate))
        self.filter.f0r_update(instance, time, plate, out)
        return out.raw

    def test_values(self):
        made = self.instance(8, 8)
        value, text = ctypes.c_double(), ctypes.c_char_p()
        for name, index in INDEX.items():
            if name == "settings":
                self.filter.f0r_get_param_value(made, ctypes.byref(text), index)
                self.assertEqual(text.value, b"")
                self.filter.f0r_set_param_value(made, ctypes.byref(ctypes.c_char_p(b"/a/b.toml")), index)
                self.filter.f0r_get_param_value(made, ctypes.byref(text), index)
                self.assertEqual(text.value, b"/a/b.toml")
                continue
            self.filter.f0r_get_param_value(made, ctypes.byref(value), index)
            self.assertEqual(value.value, STARTS[name])
            self.filter.f0r_set_param_value(made, ctypes.byref(ctypes.c_double(0.75)), index)
            self.filter.f0r_get_param_value(made, ctypes.byref(value), index)
            self.assertEqual(value.value, 0.75)

    def test_whatHostsMustNotSend(self):
        for value in (-1, 2, float("nan"), float("inf")):
            made = self.instance(16, 16, rate=value, wind=value, seed=value, fps=value)
            self.assertEqual(len(self.frame(made, 16, 16, 0)), 1024)
        made = self.instance(16, 16)
        self.filter.f0r_set_param_value(made, ctypes.byref(ctypes.c_double(1)), 99)
        self.filter.f0r_get_param_value(made, ctypes.byref(ctypes.c_double()), 99)
        self.filter.f0r_update(None, 0, None, None)
        self.filter.f0r_destruct(None)

    def test_inPlace(self):
        width, height = 48, 32
        made = self.instance(width, height, rate=0.5)
        expected = self.frame(made, width, height, 0.2)
        frame = ctypes.create_string_buffer(bytes((x * 3 + y * 5 + c * 40) % 200 if c < 3 else 255 for y in range(height)
                                                  for x in range(width) for c in range(4)), width * height * 4)
        self.filter.f0r_update(made, 0.2, frame, frame)
        self.assertEqual(frame.raw, expected)

    def test_sizesOfAnyKind(self):
        for width, height in ((1, 1), (8, 8), (33, 7)):
            with self.subTest(size=(width, height)):
                self.assertEqual(len(self.frame(self.instance(width, height), width, height, 1.0)), width * height * 4)

    def test_timeUnits(self):
        """Seconds, unless libavfilter calls or `time` says otherwise; the same frame every time."""
        made = self.instance(64, 48, rate=0.5)
        third = self.frame(made, 64, 48, 3 / 25)
        self.assertNotEqual(self.frame(made, 64, 48, 4 / 25), third)
        self.assertEqual(self.frame(made, 64, 48, 3 / 25), third)
        self.assertEqual(self.frame(self.instance(64, 48, rate=0.5, time=1.0), 64, 48, 120), third)
        self.assertEqual(self.frame(self.instance(64, 48, rate=0.5, time=0.5), 64, 48, 0.12), third)
        self.assertEqual(self.frame(self.instance(64, 48, rate=0.5, fps=0.05), 64, 48, 0.06 + 1e-9),
                         self.frame(self.instance(64, 48, rate=0.5, fps=0.05), 64, 48, 0.06))

    def test_threads(self):
        """Instances of several threads at once give what they give alone."""
        seeds = [0.001, 0.002, 0.003, 0.004]
        alone = [[self.frame(self.instance(64, 48, rate=0.5, seed=seed), 64, 48, t / 25) for t in range(4)] for seed in seeds]
        together = [None] * len(seeds)

        def work(i):
            made = self.instance(64, 48, rate=0.5, seed=seeds[i])
            together[i] = [self.frame(made, 64, 48, t / 25) for t in range(4)]

        threads = [threading.Thread(target=work, args=(i,)) for i in range(len(seeds))]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(together, alone)


if __name__ == "__main__":
    unittest.main()
