"""Sound in time: whatever the containers, pictures and sound begin where they began in the plate, and what is heard is the
same, sample for sample; cut with the frames too."""
import json
import subprocess
import unittest

import numpy as np
from support import OFF, CliTest, ffmpeg

RATE = {"aac": 44100, "libopus": 48000, "libvorbis": 44100, "flac": 44100}
PICTURES = ["-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.8"]


def firstTimes(path):
    """When the first picture is shown and the first sample heard [s]."""
    done = subprocess.run(["ffprobe", "-v", "error", "-of", "json", "-show_entries", "frame=media_type,pts_time", str(path)],
                          check=True, capture_output=True, timeout=60)
    times = {}
    for frame in json.loads(done.stdout)["frames"]:
        times.setdefault(frame["media_type"], float(frame["pts_time"]))
    return times["video"], times["audio"]


def heard(path):
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:a", "-f", "s16le", "-ac", "1", "-"], check=True,
                          capture_output=True, timeout=60)
    return np.frombuffer(done.stdout, "<i2").astype(int)


def packets(path):
    """Checksum of the packets, without what the container says beside them."""
    done = subprocess.run(["ffmpeg", "-v", "error", "-i", str(path), "-map", "0:a", "-c", "copy", "-f", "streamhash", "-"],
                          check=True, capture_output=True, timeout=60)
    return done.stdout


class Sound(CliTest):
    @classmethod
    def makePlates(cls):
        for name in ("aac.mp4", "aac.mov", "aac.mkv", "aac.ts", "opus.webm", "opus.mkv", "opus.mp4", "vorbis.webm", "flac.mkv"):
            codec = {"opus": "libopus", "vorbis": "libvorbis"}.get(name.split(".")[0], name.split(".")[0])
            ffmpeg(*PICTURES, "-f", "lavfi", "-i", f"aevalsrc=0.4*sin(2*PI*(300*t+3000*t*t)):s={RATE[codec]}:d=0.8", "-c:v",
                   "libvpx-vp9" if name.endswith("webm") else "libx264", "-g", "5", "-bf", "0", "-c:a", codec, cls.folder / name)

    def checkSame(self, plate, result, *arguments):
        report = self.rain(plate, "-o", result, *OFF, *arguments)
        plate, result = self.folder / plate, self.folder / result
        self.assertEqual(packets(result), packets(plate))
        ours, theirs = firstTimes(result), firstTimes(plate)
        start = min(theirs) if plate.suffix == ".ts" else 0  # streams of a broadcast begin anywhere
        for our, their in zip(ours, theirs):
            self.assertAlmostEqual(our, their - start, delta=0.0006)  # Matroska's milliseconds
        return report, heard(result), heard(plate)

    def test_sameTimesAndSamples(self):
        for plate, result in (("aac.mp4", "o.mkv"), ("aac.mkv", "o.mp4"), ("aac.mov", "o.mkv"), ("aac.mov", "o.mov"),
                              ("aac.mp4", "o.mp4"), ("aac.mkv", "o.mkv"), ("opus.webm", "o.webm"), ("opus.webm", "o.mkv"),
                              ("opus.mkv", "o.webm"), ("opus.mp4", "o.mkv"), ("opus.mp4", "o.mp4"), ("vorbis.webm", "o.webm"),
                              ("flac.mkv", "o.mp4")):
            for flags in ([], ["--reencode"]):
                with self.subTest(plate=plate, result=result, flags=flags):
                    report, ours, theirs = self.checkSame(plate, result, *flags)
                    np.testing.assert_array_equal(ours, theirs)
                    if flags:
                        self.assertFalse(report["stream_copied"])
                    elif plate.split(".")[1] == result.split(".")[1]:
                        self.assertTrue(report["stream_copied"])

    def test_whatReadersOfMp4PlayOn(self):
        """What is padded at the end of Opus FFmpeg plays in MP4, and leaves out in Matroska; nothing else differs."""
        _, ours, theirs = self.checkSame("opus.mkv", "o.mp4")
        np.testing.assert_array_equal(ours[:len(theirs)], theirs)

    def test_generations(self):
        for chain in (["aac.mp4", "1.mkv", "2.mkv", "3.mp4", "4.mkv", "5.mov"], ["opus.webm", "1.webm", "2.mkv", "3.webm"]):
            for plate, result in zip(chain, chain[1:]):
                self.rain(plate, "-o", result, *OFF)
            with self.subTest(chain=chain):
                np.testing.assert_array_equal(heard(self.folder / result), heard(self.folder / chain[0]))
                for our, their in zip(firstTimes(self.folder / result), firstTimes(self.folder / chain[0])):
                    self.assertAlmostEqual(our, their, delta=0.0006)

    def test_transportStreams(self):
        """ADTS headers of AAC are no part of it in MP4 and Matroska."""
        for result in ("o.mp4", "o.mkv"):
            with self.subTest(result=result):
                self.rain("aac.ts", "-o", result, *OFF)
                np.testing.assert_array_equal(heard(self.folder / result), heard(self.folder / "aac.ts"))
                video, audio = firstTimes(self.folder / "aac.ts")
                ours = firstTimes(self.folder / result)
                self.assertAlmostEqual(ours[0] - ours[1], video - audio, delta=0.0006)

    def test_cut(self):
        """From frame 7: MP4 to the sample, Matroska to the middle of a packet; warmed up by what came before."""
        for plate, result, packet in (("aac.mp4", "o.mp4", 0), ("aac.mp4", "o.mkv", 1024), ("opus.mp4", "o.mp4", 0),
                                      ("opus.webm", "o.webm", 960)):
            with self.subTest(plate=plate, result=result):
                self.rain(plate, "-o", result, *OFF, "--frames", "7-15")
                rate = RATE["aac" if "aac" in plate else "libopus"]
                theirs, ours = heard(self.folder / plate), heard(self.folder / result)
                self.assertEqual(firstTimes(self.folder / result)[0], 0)
                start = round((firstTimes(self.folder / plate)[0] + 7 / 25 - firstTimes(self.folder / plate)[1]) * rate)
                places = range(start - packet // 2 - 400, start + packet // 2 + 401)
                errors = [np.abs(theirs[place:place + 8000] - ours[:8000]).mean() for place in places]
                found = places[int(np.argmin(errors))]
                # Two samples of a decoder that starts elsewhere differ by its dither; a sweep shifted by a sample by hundreds.
                self.assertLess(min(errors), 100)
                self.assertLessEqual(abs(found - start), packet // 2 + rate // 1000 + 312 * (packet == 960))
                self.assertAlmostEqual(len(ours), 9 * rate / 25, delta=1.5 * (packet or 1024))


if __name__ == "__main__":
    unittest.main()
