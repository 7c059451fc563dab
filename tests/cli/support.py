"""What the tests of the command line share: tiny plates, and one way to run virga and to look at what it left.

Each file is a CTest test of its own (CMakeLists.txt). By hand: VIRGA=build/bin/virga python3 tests/cli/usage_test.py -v
"""
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import unittest
from pathlib import Path

try:
    import numpy as np
    import OpenImageIO as oiio
except ImportError as missing:
    raise SystemExit(f"{missing}: apt-get install python3-numpy python3-openimageio")

VIRGA = os.environ.get("VIRGA", "")
if not os.access(VIRGA, os.X_OK):
    raise SystemExit(f"VIRGA='{VIRGA}' must name the program to test")
CACHE = tempfile.TemporaryDirectory(prefix="virga-cli-cache-")  # not the user's
WIDTH, HEIGHT = 96, 54
OFF = ["--rate", "0", "--fog", "0", "--darken", "0", "--desaturate", "0", "--blur", "0", "--splashes", "0"]
CHEAP = ["--fog", "0", "--darken", "0", "--desaturate", "0"]  # rain alone

# What libraries say by themselves and users should not have to read.
CHATTER = re.compile(r"\[\w+ @ 0x|libpng|libEGL|MESA|terminate called|Assertion|Traceback|what\(\):|std::|OpenImageIO|Iex")


class Run:
    """One call of virga, finished."""

    def __init__(self, arguments, folder, environment=None):
        env = {k: v for k, v in os.environ.items() if k not in ("OCIO", "COLUMNS")}
        env["XDG_CACHE_HOME"] = CACHE.name
        env.update(environment or {})
        self.arguments = [str(a) for a in arguments]
        done = subprocess.run([VIRGA, *self.arguments], cwd=folder, env=env, capture_output=True, timeout=240)
        self.code = done.returncode
        self.out = done.stdout.decode(errors="replace")
        self.err = done.stderr.decode(errors="replace")

    @property
    def lines(self):
        return [line for line in self.err.splitlines() if line]

    @property
    def report(self):
        return json.loads(self.out)

    def __str__(self):
        return f"virga {' '.join(self.arguments)}\nexit {self.code}\nstdout: {self.out}\nstderr: {self.err}"


class CliTest(unittest.TestCase):
    """A folder for the class, with what makePlates() puts there; virga runs inside it."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="virga-cli-"))
        cls.makePlates()

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    @classmethod
    def makePlates(cls):
        pass

    def virga(self, *arguments, env=None):
        return Run(arguments, self.folder, env)

    def succeeds(self, *arguments, env=None):
        run = self.virga(*arguments, env=env)
        self.assertEqual(run.code, 0, run)
        self.assertNotRegex(run.err, CHATTER, run)
        return run

    def rain(self, *arguments, env=None):
        """virga rain, which must succeed; returns its report."""
        return self.succeeds("rain", "--json", "--quiet", *arguments, env=env).report

    def content(self):
        """Everything in the folder, by name and checksum."""
        return {str(p.relative_to(self.folder)): hashlib.md5(p.read_bytes()).hexdigest() if p.is_file() else "folder"
                for p in self.folder.rglob("*")}

    def refused(self, code, words, *arguments, env=None):
        """virga must end with `code` and one sentence on standard error that holds each of `words`, and must leave the
        folder as it was: nothing under the final name, no temporary file, no input touched."""
        before = self.content()
        run = self.virga(*arguments, env=env)
        self.assertEqual(run.code, code, run)
        self.assertEqual(run.out, "", run)
        self.assertEqual(len(run.lines), 1, run)
        sentence = run.lines[0]
        self.assertTrue(sentence.startswith("virga: "), run)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, sentence, run)
        self.assertNotRegex(run.err, CHATTER, run)
        self.assertLess(len(sentence), 500, run)
        self.assertEqual(self.content(), before, f"{run}\nthe folder has changed")
        return sentence

    def leftovers(self):
        return [str(p) for mark in ("partial", "finishing") for p in self.folder.rglob(f".*.{mark}*")]

    def start(self, *arguments):
        """virga in the background, for signals."""
        return subprocess.Popen([VIRGA, *map(str, arguments)], cwd=self.folder, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))

    def path(self, name):
        return str(self.folder / name)


def writeImage(path, pixels, kind="half", channels=None):
    """height x width [x channels] array -> image file. kind: half, float, uint8, uint16 (values 0..1)."""
    pixels = np.asarray(pixels, np.float32)
    if pixels.ndim == 2:
        pixels = pixels[:, :, None]
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if channels:
        spec.channelnames = tuple(channels)
    out = oiio.ImageOutput.create(str(path))
    assert out and out.open(str(path), spec), oiio.geterror()
    assert out.write_image(np.ascontiguousarray(pixels)), out.geterror()
    out.close()


def readImage(path, kind="float"):
    """Image file -> (height x width x channels array, names). kind "half" keeps the bits of half files."""
    file = oiio.ImageInput.open(str(path))
    assert file, oiio.geterror()
    spec = file.spec()
    pixels = file.read_image(0, 0, 0, spec.nchannels, kind)
    file.close()
    return np.asarray(pixels).reshape(spec.height, spec.width, spec.nchannels), list(spec.channelnames)


def bits(path):
    """The stored words of a half or float file, as integers: equal only if bit-identical."""
    file = oiio.ImageInput.open(str(path))
    spec = file.spec()
    kind = str(spec.format)
    pixels = np.ascontiguousarray(np.asarray(file.read_image(0, 0, 0, spec.nchannels, kind)))
    file.close()
    return kind, list(spec.channelnames), pixels.reshape(-1).view(np.uint16 if kind == "half" else np.uint32)


def street(width=WIDTH, height=HEIGHT, seed=0):
    """A picture with a bright top, a dark bottom and some grain; RGBA, opaque."""
    y = np.linspace(1, 0, height)[:, None, None]
    grain = np.random.default_rng(seed).uniform(0.9, 1.1, (height, width, 3))
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = (0.02 + 0.9 * y ** 2) * grain
    return pixels


def ffmpeg(*arguments):
    subprocess.run(["ffmpeg", "-v", "error", "-y", *map(str, arguments)], check=True, timeout=120)


def makeMovie(path, seconds=1, size=f"{WIDTH}x{HEIGHT}", rate="25", sound=True):
    inputs = ["-f", "lavfi", "-i", f"testsrc2=s={size}:r={rate}:d={seconds}"]
    if sound:
        inputs += ["-f", "lavfi", "-i", f"sine=f=440:d={seconds}"]
    ffmpeg(*inputs, "-c:v", "libx264", "-preset", "ultrafast", "-pix_fmt", "yuv420p", "-c:a", "aac", path)


def probe(path, stream="v:0"):
    """ffprobe's fields of a stream, frames counted by decoding."""
    done = subprocess.run(["ffprobe", "-v", "error", "-count_frames", "-select_streams", stream, "-show_streams", "-of",
                           "json", str(path)], check=True, capture_output=True, timeout=120)
    return json.loads(done.stdout)["streams"][0]


def packetTable(path, stream):
    """Checksums of a stream's packets, in order, without their times."""
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", f"0:{stream}", "-c", "copy", "-f",
                           "framemd5", "-"], check=True, capture_output=True, timeout=120, text=True)
    return [line.split(",")[-1].strip() for line in done.stdout.splitlines() if line and not line.startswith("#")]


def frameTimes(path):
    """Presentation times of the pictures [s]."""
    done = subprocess.run(["ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "packet=pts_time", "-of",
                           "csv=p=0", str(path)], check=True, capture_output=True, timeout=120, text=True)
    return sorted(float(line.strip(",")) for line in done.stdout.split() if line.strip(",") != "N/A")
