"""A range of frames to which nothing is done: copied packet by packet where that is exact, else encoded, and the report says
why."""
import json
import subprocess
import unittest

from support import OFF, CliTest, ffmpeg, frameTimes, probe

RATE = 25
FRAMES = 20


def hashes(path, copied):
    """A checksum a picture; of the packets, in their order, or of what they decode to."""
    how = ["-c", "copy"] if copied else ["-fps_mode", "passthrough"]
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:v:0", *how, "-f", "framehash", "-hash", "md5", "-"],
                          check=True, capture_output=True, text=True, timeout=60)
    lines = [line.split(",") for line in done.stdout.splitlines() if line and not line.startswith("#")]
    return [line[5].strip() for line in lines]


class Cut(CliTest):
    PLATES = {
        "prores.mov": ["-c:v", "prores_ks"], "dnx.mov": ["-c:v", "dnxhd", "-profile:v", "dnxhr_lb", "-pix_fmt", "yuv422p"],
        "ffv1.mkv": ["-c:v", "ffv1", "-g", "1"], "mjpeg.avi": ["-c:v", "mjpeg"], "all.mp4": ["-c:v", "libx264", "-g", "1"],
        "closed.mp4": ["-c:v", "libx264", "-g", "5", "-keyint_min", "5", "-sc_threshold", "0", "-bf", "2"],
        "closed.mkv": ["-c:v", "libx265", "-x265-params", "log-level=none:keyint=5:min-keyint=5:scenecut=0:open-gop=0:bframes=2"],
        "vp9.webm": ["-c:v", "libvpx-vp9", "-g", "5"],
        "open.mkv": ["-c:v", "libx264", "-x264-params", "open-gop=1:keyint=5:min-keyint=5:scenecut=0:bframes=2:b-adapt=0"],
        "recover.mkv": ["-c:v", "libx264", "-x264-params", "intra-refresh=1:keyint=5:bframes=0"],
    }

    @classmethod
    def makePlates(cls):
        for name, encoder in cls.PLATES.items():
            size = "256x120" if "dnx" in name else "64x48"
            ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r={RATE}:d={FRAMES / RATE}", *encoder, cls.folder / name)

    def cut(self, plate, first, last):
        result = "out" + plate[plate.index("."):]
        report = self.rain(plate, "-o", result, *OFF, "--frames", f"{first}-{last}")
        self.assertEqual(report["frames_rendered"] if "frames_rendered" in report else last - first + 1, last - first + 1)
        return report, self.folder / result

    def checkCopied(self, plate, first, last):
        report, result = self.cut(plate, first, last)
        self.assertTrue(report["stream_copied"], report["not_copied_because"])
        self.assertIsNone(report["not_copied_because"])
        self.assertEqual(hashes(result, False), hashes(self.folder / plate, False)[first:last + 1])
        packets, theirs = hashes(result, True), hashes(self.folder / plate, True)
        start = theirs.index(packets[0])
        self.assertEqual(packets, theirs[start:start + last - first + 1])
        for at, time in enumerate(frameTimes(result)):
            self.assertAlmostEqual(time, at / RATE, delta=0.0006)

    def test_everyPictureStandsAlone(self):
        for plate in ("prores.mov", "dnx.mov", "ffv1.mkv", "mjpeg.avi", "all.mp4"):
            for first, last in ((3, 8), (0, 4), (19, 19)):
                with self.subTest(plate=plate, first=first, last=last):
                    self.checkCopied(plate, first, last)

    def test_closedGroups(self):
        for plate in ("closed.mp4", "closed.mkv", "vp9.webm"):
            for first, last in ((5, 9), (5, 19), (0, 14), (10, 10)):
                with self.subTest(plate=plate, first=first, last=last):
                    self.checkCopied(plate, first, last)

    def test_whatNeedsOthersIsEncoded(self):
        for plate, first, last, why in (("closed.mp4", 6, 9, "frame 6 builds on frames before it"),
                                        ("closed.mkv", 3, 12, "frame 3 builds on frames before it"),
                                        ("closed.mp4", 5, 6, "coded in turns"),
                                        ("recover.mkv", 5, 9, "frame 5 is not an IDR picture")):
            with self.subTest(plate=plate, first=first, last=last):
                report, result = self.cut(plate, first, last)
                self.assertFalse(report["stream_copied"])
                self.assertIn(why, report["not_copied_because"])
                self.assertEqual(len(hashes(result, False)), last - first + 1)

    def test_openGroups(self):
        """Their leading pictures build on the group before."""
        keys = [i for i, f in enumerate(json.loads(subprocess.run(
            ["ffprobe", "-v", "error", "-of", "json", "-show_entries", "frame=pict_type", self.path("open.mkv")],
            check=True, capture_output=True).stdout)["frames"]) if f["pict_type"] == "I"]
        report, _ = self.cut("open.mkv", keys[1], FRAMES - 1)
        self.assertIn("begins an open group of pictures", report["not_copied_because"])
        self.checkCopied("open.mkv", 0, FRAMES - 1)

    def test_whatIsBesideIsCut(self):
        (self.folder / "chapters.txt").write_text(";FFMETADATA1\n[CHAPTER]\nTIMEBASE=1/1000\nSTART=0\nEND=300\ntitle=One\n"
                                                  "[CHAPTER]\nTIMEBASE=1/1000\nSTART=300\nEND=800\ntitle=Two\n")
        ffmpeg("-i", self.folder / "closed.mp4", "-f", "lavfi", "-i", "aevalsrc=0.4*sin(2*PI*(300*t+3000*t*t)):s=44100:d=0.8", "-i",
               self.folder / "chapters.txt", "-map", "0", "-map", "1", "-map_metadata", "2", "-c:v", "copy", "-c:a", "pcm_s16le",
               "-timecode", "01:00:00:20", self.folder / "beside.mov")
        self.checkCopied("beside.mov", 10, 14)
        done = subprocess.run(["ffprobe", "-v", "error", "-of", "json", "-show_chapters", "-show_streams", self.path("out.mov")],
                              check=True, capture_output=True)
        said = json.loads(done.stdout)
        self.assertEqual([c["tags"]["title"] for c in said["chapters"]], ["Two"])
        self.assertAlmostEqual(float(said["chapters"][0]["end_time"]), 5 / RATE, delta=0.002)
        self.assertIn("01:00:01:05", json.dumps(said))
        sound = [subprocess.run(["ffmpeg", "-v", "error", *cut, "-i", self.path(name), "-map", "0:a", "-f", "s16le", "-"],
                                check=True, capture_output=True).stdout for name, cut in (("out.mov", ["-t", "0.15"]),
                                                                                          ("beside.mov", ["-ss", "0.4", "-t", "0.15"]))]
        self.assertEqual(sound[0], sound[1])
        self.assertGreater(len(sound[0]), 10000)

    def test_manyRanges(self):
        """What is not one run is encoded, without a reason: nobody would expect a copy."""
        report = self.rain("all.mp4", "-o", "out.mp4", *OFF, "--frames", "1-3,6")
        self.assertFalse(report["stream_copied"])
        self.assertIsNone(report["not_copied_because"])
        self.assertEqual(int(probe(self.folder / "out.mp4")["nb_read_frames"]), 4)


if __name__ == "__main__":
    unittest.main()
