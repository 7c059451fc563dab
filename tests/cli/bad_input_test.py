"""Files that are cut off, changed anywhere, or called what they are not; sizes at the ends; disks without room; readers that
go away. Always an answer or a sentence with an exit code of the contract: no crash, no hang, and no wrong picture without a
word. Movies have more of this in movie_in_test.py, tests/io has the readers themselves, tests/fuzz our own parsers."""
import json
import os
import random
import re
import shutil
import subprocess
import unittest

import numpy as np
from support import CHEAP, CHATTER, OFF, VIRGA, CliTest, ffmpeg, readImage, writeImage

W, H = 24, 18
SHARES = (0.01, 0.6, 0.95, 1)  # nothing at all is input_test.py's
LIMIT = 20  # s; none of this takes one


class BadInputTest(CliTest):
    def ends(self, *arguments, codes=(0, 3), **options):
        """virga, which must end by itself, in time, with one of `codes`, and with one sentence of its own if it fails."""
        command = [VIRGA, *map(str, arguments)]
        done = subprocess.run(command, cwd=self.folder, capture_output=True, timeout=LIMIT, **options)
        said = f"{' '.join(command)}\nexit {done.returncode}\n{done.stderr.decode(errors='replace')}"
        self.assertIn(done.returncode, codes, said)
        done.err = done.stderr.decode(errors="replace")
        self.assertNotRegex(done.err, CHATTER, said)
        if done.returncode != 0:
            self.assertRegex(done.err.splitlines()[-1], "^virga: ", said)
        done.said = said
        return done

    def damaged(self, path, chance, flips):
        data = bytearray(path.read_bytes())
        for _ in range(flips):
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
        return bytes(data)


def picture(seed=1):
    """Noise: every byte of the file matters."""
    return np.random.default_rng(seed).uniform(0.1, 0.9, (H, W, 3))


class Images(BadInputTest):
    """Each reader of images, as the plate."""

    KINDS = {"half.exr": "half", "float.exr": "float", "a.dpx": "uint16", "a.tif": "uint16", "a.png": "uint16", "b.png": "uint8",
             "a.jpg": "uint8", "a.hdr": "float", "a.webp": "uint8", "a.tga": "uint8", "a.bmp": "uint8"}

    @classmethod
    def makePlates(cls):
        for name, kind in cls.KINDS.items():
            writeImage(cls.folder / name, picture(), kind)

    def through(self, name):
        """The picture that virga makes of it, or None, and what it said."""
        out = self.folder / "out.exr"
        out.unlink(missing_ok=True)
        run = self.ends("rain", name, "-o", "out.exr", *OFF)
        self.assertEqual(out.exists(), run.returncode == 0, run.said)
        if run.returncode != 0:
            self.assertIn(name, run.err)
        return (readImage(out)[0] if run.returncode == 0 else None), run

    def test_cutOff(self):
        for name in self.KINDS:
            data = (self.folder / name).read_bytes()
            whole, _ = self.through(name)
            bad = "cut" + os.path.splitext(name)[1]
            for share in SHARES:
                with self.subTest(file=name, share=share):
                    (self.folder / bad).write_bytes(data[:min(int(len(data) * share), len(data) - 1)])
                    made, run = self.through(bad)
                    if made is not None and "warning" not in run.err:
                        np.testing.assert_array_equal(made, whole, f"a wrong picture without a word\n{run.said}")

    def test_changedBits(self):
        chance = random.Random(5)
        for name in self.KINDS:
            for seed in range(2):
                with self.subTest(file=name, seed=seed):
                    bad = "bad" + os.path.splitext(name)[1]
                    (self.folder / bad).write_bytes(self.damaged(self.folder / name, chance, 1 + 7 * seed))
                    self.through(bad)

    def test_wrongExtensions(self):
        """The same picture under another format's name, or a sentence."""
        for name in ("half.exr", "a.dpx", "a.png", "a.jpg", "a.hdr", "a.webp"):
            whole, _ = self.through(name)
            for ending in ("exr", "png", "jpg", "dpx", "hdr", "mp4"):
                with self.subTest(file=name, ending=ending):
                    shutil.copy(self.folder / name, self.folder / f"as.{ending}")
                    made, run = self.through(f"as.{ending}")
                    if made is not None and ending == "mp4":  # FFmpeg's reader spreads chroma in its own way
                        np.testing.assert_allclose(made.mean(), whole.mean(), rtol=0.05, err_msg=run.said)
                    elif made is not None:
                        np.testing.assert_allclose(made, whole, rtol=2e-3, err_msg=run.said)

    def test_sequences(self):
        """Frames that are missing, of another size, of another number of channels, or no pictures."""
        for frame in (1, 2, 3, 5, 6):
            writeImage(self.folder / f"s.{frame:04d}.exr", picture(frame))
        writeImage(self.folder / "s.0003.exr", picture()[:, :W // 2])
        writeImage(self.folder / "s.0006.exr", picture()[..., :1], channels=["Y"])
        (self.folder / "s.0002.exr").write_bytes(b"")
        sequence = ["rain", "s.%04d.exr", "--frames", "1-6", *OFF]
        self.assertIn("frame 4 is missing", self.ends(*sequence, "-o", "o.%04d.exr", codes=[3]).err)
        for way, made in (("skip", [1, 5, 6]), ("hold", [1, 2, 3, 4, 5, 6])):
            run = self.ends(*sequence, "-o", f"{way}.%04d.exr", "--on-error", way, codes=[0])
            for bad in ("s.0002.exr: is empty", "s.0003.exr: is 12x18"):
                self.assertIn(bad, run.err)
            self.assertEqual([n for n in range(1, 7) if (self.folder / f"{way}.{n:04d}.exr").exists()], made)
        np.testing.assert_array_equal(readImage(self.folder / "hold.0003.exr")[0], readImage(self.folder / "s.0001.exr")[0])
        for stop in ("1-2", "1,3"):
            self.ends("rain", "s.%04d.exr", "--frames", stop, "-o", "stop.%04d.exr", *OFF, codes=[3])

    def test_sizes(self):
        for width, height in ((1, 1), (1, 37), (37, 1), (16384, 16), (16, 16384)):
            wide = np.random.default_rng(3).uniform(0, 1, (height, width, 3))
            for name in ("size.exr", "size.png"):
                with self.subTest(width=width, height=height, file=name):
                    writeImage(self.folder / name, wide, "half" if "exr" in name else "uint8")
                    self.ends("rain", name, "-o", f"same.{name}", *OFF, codes=[0])
                    np.testing.assert_array_equal(readImage(self.folder / f"same.{name}", "half")[0],
                                                  readImage(self.folder / name, "half")[0])
            self.ends("rain", "size.exr", "-o", "wet.exr", *CHEAP, "--rate", "10", codes=[0])
            wet = readImage(self.folder / "wet.exr")[0]
            self.assertEqual(wet.shape[:2], (height, width))
            self.assertTrue(np.isfinite(wet).all())


class Beside(BadInputTest):
    """What stands beside the plate: depth, panorama, mattes, lamps, camera, stills, settings, reports."""

    @classmethod
    def makePlates(cls):
        folder = cls.folder
        writeImage(folder / "plate.exr", picture())
        writeImage(folder / "z.exr", picture()[..., :1] * 20, "float", ["Z"])
        writeImage(folder / "z.png", picture()[..., :1], "uint16")
        writeImage(folder / "pano.hdr", np.random.default_rng(2).uniform(0, 3, (8, 16, 3)), "float")
        writeImage(folder / "atlas.png", np.random.default_rng(2).uniform(0, 1, (64, 32)), "uint8")
        (folder / "atlas.json").write_text(json.dumps({"tile_width": 16, "tile_height": 64, "columns": 2, "count": 2}))
        (folder / "lamps.toml").write_text("[[light]]\nname = \"a\"\nposition = [1, 2, -3]\nintensity = [3, 2, 1]\n")
        (folder / "a.chan").write_text("1 0 2 0 -5 30 0 40\n2 0.5 2 -1 -5 33 0 40\n")
        (folder / "a.json").write_text("{\"0\": [1,0,0,5,0,1,0,6,0,0,1,7,0,0,0,1]}")
        (folder / "model").mkdir()
        (folder / "model/cameras.txt").write_text("1 PINHOLE 64 48 50 50 32 24\n")
        (folder / "model/images.txt").write_text("1 1 0 0 0 0.5 -1 2 1 frame_0000.png\n10 20 -1\n")
        (folder / "look.toml").write_text("[rain]\nrate = 12\nwind = [1, 2]\n[scene]\nfog = \"auto\"\n")
        (folder / "report.json").write_text(json.dumps({"format": "virga-extract-report", "version": 1,
                                                        "match": {"rate": 12, "wind": [1, 2]}}))

    FILES = {"z.exr": ["--depth"], "z.png": ["--depth-scale", "50", "--depth"], "pano.hdr": ["--env"], "atlas.png": ["--mattes"],
             "atlas.json": ["--mattes", "atlas.png"], "lamps.toml": ["--lights"], "a.chan": ["--camera"], "a.json": ["--camera"],
             "model/images.txt": ["--camera", "model"], "plate.exr": ["--grade-from"], "look.toml": ["--settings"],
             "report.json": ["--match"]}

    def test_cutOffAndChanged(self):
        chance = random.Random(9)
        shot = ["rain", "still.exr", "-o", "o.exr", "--strokes", "20", "--device", "cpu"]
        shutil.copy(self.folder / "plate.exr", self.folder / "still.exr")
        for name, flags in self.FILES.items():
            path = self.folder / name
            whole = path.read_bytes()
            flags = [*flags, name] if len(flags) % 2 else flags
            self.ends(*shot, *flags, codes=[0])
            bad = [whole[:int(len(whole) * share)] for share in (0.3, 0.9)]
            bad += [self.damaged(path, chance, flips) for flips in (1, 16)]
            try:
                for number, data in enumerate(bad):
                    with self.subTest(file=name, number=number):
                        path.write_bytes(data)
                        run = self.ends(*shot, *flags, codes=[0, 2, 3])
                        if run.returncode == 0:
                            self.assertTrue(np.isfinite(readImage(self.folder / "o.exr")[0]).all())
            finally:
                path.write_bytes(whole)


class Movies(BadInputTest):
    """Containers that movie_in_test.py does not damage, and chroma that the picture's size does not divide by."""

    @classmethod
    def makePlates(cls):
        source = ["-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.2"]
        ffmpeg(*source, "-c:v", "mpeg2video", cls.folder / "a.mxf")
        ffmpeg(*source, "-pix_fmt", "yuv420p", cls.folder / "a.y4m")
        ffmpeg(*source, "-c:v", "libx264", "-pix_fmt", "yuv420p", cls.folder / "a.mov")

    def test_damage(self):
        chance = random.Random(4)
        for name in ("a.mxf", "a.y4m", "a.mov"):
            whole = (self.folder / name).read_bytes()
            bad = "bad" + name[1:]
            for number, data in enumerate([*(whole[:int(len(whole) * share)] for share in SHARES),
                                           *(self.damaged(self.folder / name, chance, 1 << 2 * seed) for seed in range(3))]):
                with self.subTest(clip=name, number=number):
                    (self.folder / bad).write_bytes(data)
                    run = self.ends("rain", bad, "-o", "o.mkv", *OFF, "--codec", "ffv1", "--on-error", chance.choice(["stop", "skip"]))
                    if run.returncode != 0:
                        self.assertIn(bad, run.err)

    def test_oddWidthsThroughEveryPixelFormat(self):
        formats = ("yuv420p yuv422p yuv444p yuv440p yuv410p yuv411p yuva420p yuva422p yuva444p gray gray10le gray12le gray16le "
                   "yuv420p10le yuv422p10le yuv444p10le yuv420p12le yuv422p12le yuv444p12le yuv420p16le yuv422p16le yuv444p16le "
                   "yuva444p16le gbrp gbrp10le gbrp12le gbrp16le gbrap bgra bgr0 rgb48le rgba64le").split()
        for pixels in formats:
            for size in ("37x5", "1x1") if pixels in ("yuv420p", "yuv411p", "yuva444p", "gray16le", "gbrp") else ("37x5",):
                with self.subTest(pixels=pixels, size=size):
                    ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.08", "-vf", f"scale={size},format={pixels}", "-c:v", "ffv1",
                           self.folder / "odd.mkv")
                    self.ends("rain", "odd.mkv", "-o", "same.mkv", *OFF, "--codec", "ffv1", "--reencode", codes=[0])
                    self.assertEqual(self.codes("same.mkv", pixels), self.codes("odd.mkv", pixels))

    def test_oddWidthsOfPackedFormats(self):
        """What FFV1 does not hold, as raw video: the pixels of the planar twin, or those that ffmpeg finds."""
        def picture(pixels, through):
            ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.04", "-vf", f"scale=37x5,format={through},format={pixels}", "-c:v",
                   "rawvideo", self.folder / "odd.nut")
            self.ends("rain", "odd.nut", "-o", "same.png", *OFF, codes=[0])
            read = subprocess.run(["ffmpeg", "-v", "error", "-i", self.folder / "same.png", "-pix_fmt", "rgb48le", "-f", "rawvideo", "-"],
                                  check=True, capture_output=True, timeout=60).stdout
            return np.frombuffer(read, "<u2").reshape(5, 37, 3).astype(int)

        for pixels, twin in (("nv12", "yuv420p"), ("nv21", "yuv420p"), ("uyvy422", "yuv422p"), ("yuyv422", "yuv422p"), ("yvyu422", "yuv422p")):
            with self.subTest(pixels=pixels):
                np.testing.assert_array_equal(picture(pixels, twin), picture(twin, twin))
        for pixels in "rgb24 bgr24 argb abgr 0rgb pal8 rgb48be bgr48le rgba64be ya8 gray16be gbrap10le".split():
            with self.subTest(pixels=pixels):
                ours = picture(pixels, "rgb48le")
                truth = subprocess.run(["ffmpeg", "-v", "error", "-i", self.folder / "odd.nut", "-pix_fmt", "rgb48le", "-f", "rawvideo", "-"],
                                       check=True, capture_output=True, timeout=60).stdout
                off = np.abs(np.frombuffer(truth, "<u2").reshape(5, 37, 3).astype(int) - ours)
                self.assertLess(off.max(), 2 * 257)

    def codes(self, name, pixels):
        return subprocess.run(["ffmpeg", "-v", "error", "-i", self.folder / name, "-pix_fmt", "gbrp" if pixels == "bgr0" else pixels,
                               "-f", "framemd5", "-"], check=True, capture_output=True, timeout=60).stdout

    def test_oddSizesWith420(self):
        """Rained on, through encoders that divide chroma by two: as large as they were, or refused in a sentence."""
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.12", "-vf", "scale=63x47,format=yuv444p", "-c:v", "ffv1", self.folder / "odd.mkv")
        for name, codec in (("o.mp4", "libx264"), ("o.mkv", "libx265"), ("o.webm", "libvpx-vp9"), ("o.avi", "mjpeg"), ("o.mov", "prores_ks"),
                            ("o.mpg", "mpeg2video"), ("o.y4m", "")):
            for pixels in ([], ["--pixel-format", "yuv420p"]):
                with self.subTest(output=name, pixels=pixels):
                    run = self.ends("rain", "odd.mkv", "-o", name, *CHEAP, *(["--codec", codec] if codec else []), *pixels, codes=[0, 2, 5])
                    if run.returncode == 0:
                        size = subprocess.run(["ffprobe", "-v", "error", "-select_streams", "v:0", "-show_entries", "stream=width,height",
                                               "-of", "csv=p=0", self.folder / name], capture_output=True, text=True, timeout=60).stdout
                        self.assertEqual(size.strip().rstrip(","), "63,47")
                    else:
                        self.assertRegex(run.err, "63x47|yuv420p", run.said)


class Outside(BadInputTest):
    """No room on the disk, and nobody who listens."""

    @classmethod
    def makePlates(cls):
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=160x120:r=25:d=0.4", "-vf", "noise=alls=60:allf=t", "-c:v", "ffv1", cls.folder / "a.mkv")

    def test_fullDisk(self):
        disk = self.folder / "disk"
        disk.mkdir()
        if os.geteuid() != 0 or subprocess.run(["mount", "-t", "tmpfs", "-o", "size=128k", "none", disk], capture_output=True).returncode:
            self.skipTest("only root can mount a small file system")
        try:
            for name, codec in (("o.mp4", "libx264"), ("o.mov", "prores_ks"), ("o.mkv", "ffv1"), ("o.avi", "ffv1"), ("o.nut", "rawvideo"),
                                ("o.webm", "libvpx-vp9"), ("o.ts", "mpeg2video"), ("o.mxf", "mpeg2video"), ("o.y4m", ""), ("o.%04d.exr", ""),
                                ("o.%04d.png", ""), ("o.%04d.tif", ""), ("o.%04d.dpx", ""), ("o.%04d.jpg", ""), ("o.%04d.webp", ""), ("o.%04d.tga", ""), ("o.%04d.bmp", ""), ("o.%04d.sgi", ""), ("o.%04d.hdr", "")):
                with self.subTest(output=name):
                    flags = ["--codec", codec, "--quality", "0" if codec == "libx264" else "2"] if codec else ["--quality", "100"]
                    if codec in ("ffv1", "rawvideo"):
                        flags = flags[:2]
                    run = self.ends("rain", "a.mkv", "-o", f"disk/{name}", *OFF, "--reencode", *flags, codes=[5])
                    self.assertRegex(run.err, r"(?m)^virga: disk/o\.", run.said)
                    # Frames that were whole before stay; nothing else does.
                    left = list(disk.iterdir())
                    self.assertEqual([p.name for p in left if not re.fullmatch(r"o\.\d{4}\.\w+", p.name)], [])
                    for path in left:
                        readImage(path)
                for path in disk.iterdir():
                    path.unlink()
            with open(disk / "fill", "wb", buffering=0) as file:
                while True:
                    try:
                        file.write(b"0" * 4096)
                    except OSError:
                        break
            self.ends("rain", "a.mkv", "-o", "o.mkv", "--save-settings", "disk/look.toml", *OFF, codes=[5])
            self.assertEqual([p.name for p in disk.iterdir()], ["fill"])
            with open(self.folder / "a.mkv", "rb") as clip, subprocess.Popen(["cat"], stdin=clip, stdout=subprocess.PIPE) as pipe:
                run = self.ends("rain", "-", "-o", "o.mkv", *OFF, codes=[5], stdin=pipe.stdout, env={**os.environ, "TMPDIR": str(disk)})
                pipe.stdout.close()
            self.assertIn("disk", run.err)
        finally:
            subprocess.run(["umount", disk], check=True)

    def test_readersThatGoAway(self):
        for arguments in (["info", "--parameters"], ["info", "a.mkv"], ["rain", "a.mkv", "-o", "o.mkv", *OFF, "--json"], ["rain", "--help"],
                          ["model", "sizes"], ["rain", "a.mkv", "-o", "-", "--container", "nut", *OFF]):
            with self.subTest(arguments=arguments):
                reading, writing = os.pipe()
                os.close(reading)
                try:
                    done = subprocess.run([VIRGA, *arguments], cwd=self.folder, stdout=writing, stderr=subprocess.PIPE, timeout=LIMIT)
                finally:
                    os.close(writing)
                self.assertIn(done.returncode, (0, 5), done.stderr)

    def test_sendersThatGoAway(self):
        data = (self.folder / "a.mkv").read_bytes()
        for share in (0, 0.01, 0.5):
            with self.subTest(share=share):
                run = self.ends("rain", "-", "-o", "o.mkv", *OFF, "--on-error", "skip", input=data[:int(len(data) * share)])
                if run.returncode == 3:
                    self.assertIn("standard input", run.err)

    def test_noStandardStreams(self):
        """What is printed must not go into the first file that is opened."""
        before = (self.folder / "a.mkv").read_bytes()
        script = f"exec '{VIRGA}' rain a.mkv -o closed.%d.png --json --frames 0-1 {' '.join(OFF)} <&- >&- 2>&-"
        done = subprocess.run(["bash", "-c", script], cwd=self.folder, timeout=LIMIT)
        self.assertEqual(done.returncode, 5, "standard output cannot be written to")
        self.assertEqual((self.folder / "a.mkv").read_bytes(), before)
        for frame in range(2):
            self.assertEqual(readImage(self.folder / f"closed.{frame}.png")[0].shape, (120, 160, 3))


if __name__ == "__main__":
    unittest.main()
