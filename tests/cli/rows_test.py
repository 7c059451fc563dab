"""Between a movie's codes and a movie's codes light exists a few rows at a time. --preview, which shows whole pictures,
converts the plate apart: the frames must be the same, code for code, whatever the codes are."""
import os
import subprocess
import unittest
from pathlib import Path

import support

RAIN = ["--strokes", "300", "--fov", "60", "--darken", "0.2", "--fog", "0.004", "--blur", "0", "--seed", "5"]


def codes(path):
    """A checksum of each decoded picture."""
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-an", "-f", "framemd5", "-"], check=True,
                          capture_output=True, timeout=120, text=True)
    return [line.split(",")[-1].strip() for line in done.stdout.splitlines() if line and not line.startswith("#")]


class Rows(support.CliTest):
    def sameBothWays(self, plate, *flags, out="mkv"):
        rows = self.rain(plate, "-o", f"rows.{out}", *RAIN, "--device", "cpu", *flags)
        whole = self.rain(plate, "-o", f"whole.{out}", "--preview", "sheet.png", *RAIN, "--device", "cpu",
                          *flags)
        self.assertEqual(rows["strokes_per_frame"], whole["strokes_per_frame"])
        self.assertGreater(rows["strokes_per_frame"], 100)
        self.assertEqual("conversion" in whole["passes"], False)
        made = codes(self.path(f"rows.{out}"))
        self.assertEqual(made, codes(self.path(f"whole.{out}")), plate)
        self.assertNotEqual(made, codes(self.path(plate)), "no rain")
        return rows

    def movie(self, name, pixels, size="97x75", codec="ffv1", *flags):
        support.ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r=25:d=0.12,format={pixels}", "-c:v", codec, "-pix_fmt",
                       pixels, *flags, self.path(name))
        return name

    def testEveryLayoutOfCodes(self):
        for pixels in ["yuv420p", "yuv422p", "yuv444p", "yuv410p", "yuv440p", "yuva420p", "yuv420p10le", "yuv422p10le",
                       "yuv444p12le", "yuva444p10le", "gbrp10le", "gray", "gray10le"]:
            with self.subTest(pixels):
                name = self.movie(f"{pixels}.mkv", pixels)
                report = self.sameBothWays(name, "--codec", "ffv1")
                self.assertIn("conversion", report["passes"])

    def testCodesIntoOtherCodes(self):
        name = self.movie("420.mkv", "yuv420p", "98x76")
        for pixels in ["yuv444p", "yuv422p10le", "gbrp10le"]:  # chroma is interpolated by its siting
            with self.subTest(pixels):
                report = self.sameBothWays(name, "--codec", "ffv1", "--pixel-format", pixels)
                self.assertIn("conversion", report["passes"])

    def testSpacesOnTheWay(self):
        name = self.movie("709.mkv", "yuv420p", "98x76")
        for flags in [["--colorspace", "ACEScct"], ["--output-colorspace", "Rec.2020 PQ"]]:
            with self.subTest(flags):
                self.sameBothWays(name, "--codec", "ffv1", *flags)

    def testWhatHasNoPlanesGoesAsWholePictures(self):
        name = self.movie("packed.mov", "uyvy422", "96x74", "rawvideo")
        report = self.sameBothWays(name, "--codec", "ffv1")
        self.assertNotIn("conversion", report["passes"])
        support.ffmpeg("-i", self.path(self.movie("upright.mp4", "yuv420p", "96x74", "libx264")), "-c", "copy",
                       "-metadata:s:v", "rotate=90", self.path("turned.mp4"))
        self.assertNotIn("conversion", self.sameBothWays("turned.mp4", "--codec", "ffv1")["passes"])

    def testADeviceConvertsAsTheProcessorDoes(self):
        # Over 12 bits the processor converts for the device, whose picture is good to 1e-5.
        for pixels in ["yuv420p", "yuv422p10le", "yuv444p12le", "gray", "yuv420p16le"]:
            with self.subTest(pixels):
                name = self.movie(f"device-{pixels}.mkv", pixels)
                for device, out in [("cpu", "cpu.mkv"), ("0", "gl.mkv")]:
                    report = self.rain(name, "-o", out, *RAIN, "--device", device, "--codec", "ffv1")
                self.assertIn("read-back", report["passes"])
                a, b = (self.samples(out, pixels).astype(int) for out in ["cpu.mkv", "gl.mkv"])
                self.assertLessEqual(abs(a - b).max(), 1 if "16" not in pixels else 8)
                self.assertLess((a != b).mean(), 0.01 if "16" not in pixels else 1)

    def samples(self, name, pixels):
        done = subprocess.run(["ffmpeg", "-v", "error", "-i", self.path(name), "-f", "rawvideo", "-pix_fmt", pixels,
                               "-"], check=True, capture_output=True, timeout=120)
        wide = any(bits in pixels for bits in ["10", "12", "16"])
        return support.np.frombuffer(done.stdout, support.np.uint16 if wide else support.np.uint8)

    def testLightOfEachFrame(self):
        self.sameBothWays(self.movie("light.mkv", "yuv420p"), "--codec", "ffv1", "--env-frames", "0")

    def testRainAloneLeavesOtherCodesAlone(self):
        name = self.movie("still.mkv", "yuv420p10le", "160x120")
        self.rain(name, "-o", "rain.mkv", "--strokes", "12", "--fov", "60", *support.CHEAP, "--codec", "ffv1",
                  "--device", "cpu")

        before, after = (self.samples(movie, "yuv420p10le") for movie in [name, "rain.mkv"])
        self.assertEqual(before.size, after.size)
        changed = support.np.count_nonzero(before != after) / before.size
        self.assertGreater(changed, 0)
        self.assertLess(changed, 0.3)

    @unittest.skipUnless(os.environ.get("VIRGA_FOOTAGE_DIR"), "VIRGA_FOOTAGE_DIR names no footage")
    def testFootage(self):
        clip = Path(os.environ["VIRGA_FOOTAGE_DIR"]) / "pan-street/street1.mp4"
        support.ffmpeg("-i", clip, "-frames:v", "3", "-an", "-vf", "scale=160:90", "-c:v", "libx264",
                       self.path("street.mp4"))
        self.sameBothWays("street.mp4", "--codec", "libx264", out="mp4")


if __name__ == "__main__":
    unittest.main()
