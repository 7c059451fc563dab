"""The Python example as a notebook user has it, and frames of the library beside those of `virga rain`."""
import os
import subprocess
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
EXAMPLES = HERE.parent.parent / "examples" / "python"
sys.path += [str(HERE.parent / "cli"), str(EXAMPLES)]
import numpy as np  # noqa: E402
import support  # noqa: E402
import virga  # noqa: E402

WIDTH, HEIGHT = 80, 48
RAIN = {"rate": 60, "exposure": 0.008, "wind": (2, 0.5), "blur": 0.8, "ground": "1.6,3"}
DEVICE = os.environ.get("VIRGA_TEST_DEVICE", "cpu")


def flags(settings):
    for name, value in settings.items():
        yield f"--{name}"
        yield ",".join(map(str, value)) if isinstance(value, tuple) else str(value)


def street(frame, depth=3):
    """A still scene with something that moves through it."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    plate = np.stack([0.15 + 0.6 * (1 - y / HEIGHT) + 0.1 * ((x // 6 + y // 5 + c) % 3) for c in range(depth)], axis=2)
    plate[20:30, 3 * frame + 5:3 * frame + 12] = 0.9
    return np.clip(plate, 0, 1).astype(np.float32)


class LikeTheCommand(support.CliTest):
    """Frames that the library draws are those that the command writes."""
    frames = range(1, 7)

    @classmethod
    def makePlates(cls):
        for frame in cls.frames:
            support.writeImage(cls.folder / f"codes.{frame:04d}.png", street(frame), "uint8")
            support.writeImage(cls.folder / f"deep.{frame:04d}.png", street(frame), "uint16")
            support.writeImage(cls.folder / f"light.{frame:04d}.exr", street(frame), "float")

    def compared(self, name, kind, tolerance, device=DEVICE):
        end = "exr" if kind == "float" else "png"
        self.rain(f"{name}.####.{end}", "-o", f"out.####.{end}", *flags(RAIN), "--device", device)
        shot = virga.Shot(WIDTH, HEIGHT, 24, device=device, **RAIN)
        read = {"float": "float", "uint8": "uint8", "uint16": "uint16"}[kind]
        plates = {f: np.ascontiguousarray(support.readImage(self.folder / f"{name}.{f:04d}.{end}", read)[0])
                  for f in self.frames}
        for frame in shot.samples_wanted(self.frames[0], self.frames[-1]):
            shot.add_sample(frame, plates[frame])
        for frame in (5, 2, 6):
            ours = shot.render(frame, plates[frame])
            theirs = support.readImage(self.folder / f"out.{frame:04d}.{end}", read)[0]
            self.assertEqual(ours.dtype, theirs.dtype)
            self.assertFalse(np.array_equal(ours, plates[frame]))
            self.assertLessEqual(np.abs(ours.astype(np.float64) - theirs.astype(np.float64)).max(), tolerance)

    def testEightBits(self):
        self.compared("codes", "uint8", 0)

    def testSixteenBits(self):
        self.compared("deep", "uint16", 0)

    def testFloat(self):
        self.compared("light", "float", 1e-6)

    def testThroughShaders(self):
        listed = self.succeeds("info").out
        if "llvmpipe" not in listed:
            self.skipTest("no software device for OpenGL")
        self.compared("light", "float", 1e-6, device="0")


class InANotebook(unittest.TestCase):
    def setUp(self):
        self.shot = virga.Shot(WIDTH, HEIGHT, 24, device=DEVICE, **RAIN)
        self.plate = street(0)

    def testFramesOfEveryKindOfArray(self):
        truth = self.shot.render(7, self.plate)
        self.assertEqual(truth.shape, self.plate.shape)
        upsideDown = np.ascontiguousarray(self.plate[::-1])[::-1]  # a view with a negative stride
        self.assertTrue(np.array_equal(self.shot.render(7, upsideDown), truth))
        inside = np.zeros((HEIGHT, WIDTH, 4), np.float32)
        inside[:, :, :3] = self.plate
        self.assertTrue(np.array_equal(self.shot.render(7, inside[:, :, :3]), truth))
        half = self.shot.render(7, self.plate.astype(np.float16))
        self.assertEqual(half.dtype, np.float16)
        self.assertLess(np.abs(half - truth).max(), 2e-3)
        with self.assertRaises(ValueError):
            self.shot.render(7, self.plate.astype(np.float64))

    def testLayersRegionsAndDepth(self):
        depth = np.full((HEIGHT, WIDTH), 30, np.float32)
        beauty, layers = self.shot.render(7, np.dstack([self.plate, np.ones((HEIGHT, WIDTH), np.float32)]), depth=depth,
                                          layers=virga.LAYERS)
        mixed = layers["graded_plate"]
        for name in ("fog", "splash", "rain"):
            mixed = layers[name] + (1 - layers[name][:, :, 3:]) * mixed
        self.assertLess(np.abs(mixed - beauty).max(), 1e-5)
        part = self.shot.render(7, np.dstack([self.plate, np.ones((HEIGHT, WIDTH), np.float32)]), depth=depth,
                                region=(10, 5, 30, 20))
        self.assertLess(np.abs(part - beauty[5:25, 10:40]).max(), 5e-3)  # splashes; tests/shot/view_test.cpp

    def testSentencesAndProgress(self):
        with self.assertRaisesRegex(virga.Error, "did you mean 'rate'"):
            self.shot["rat"] = 3
        self.assertEqual(self.shot["rate"], "60")
        self.shot.apply('{"rain": {"rate": 12}}')
        self.assertEqual(self.shot["rate"], "12")
        self.assertIn("mm/h", virga.parameters()["rate"])
        told = []
        self.shot.render(7, self.plate, progress=told.append)
        self.assertEqual((told[0], told[-1]), (0, 1))
        with self.assertRaises(virga.Error) as cancelled:
            self.shot.render(7, self.plate, progress=lambda done: False)
        self.assertEqual(cancelled.exception.code, virga.CANCELLED)

    def testTheExampleShowsAFrame(self):
        folder = support.tempfile.mkdtemp()
        self.addCleanup(support.shutil.rmtree, folder)
        source, target = f"{folder}/street.png", f"{folder}/rainy.png"
        support.writeImage(source, self.plate, "uint8")
        run = subprocess.run([sys.executable, "-B", EXAMPLES / "rain_on_a_frame.py", source, target, "50"],
                             capture_output=True, text=True, timeout=120)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("50 mm/h", run.stdout)
        before, after = (support.readImage(path, "uint8")[0] for path in (source, target))
        self.assertEqual(after.shape, before.shape)
        self.assertGreater((after != before).mean(), 0.1)
        gone = subprocess.run([sys.executable, "-B", EXAMPLES / "rain_on_a_frame.py", "gone.png", target],
                              capture_output=True, text=True, timeout=120)
        self.assertNotEqual(gone.returncode, 0)
        self.assertIn("gone.png", gone.stderr)


if __name__ == "__main__":
    unittest.main()
