"""Memory: what is planned is what is used, and a longer clip needs no more."""
import re
import unittest

from support import OFF, CliTest, ffmpeg, street, writeImage


def makeMovie(path, frames, size):
    ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r=24:d={frames / 24 + 1}", "-frames:v", frames, "-c:v", "ffv1", path)


class Memory(CliTest):
    @classmethod
    def makePlates(cls):
        # Frames of 0.9 MB as light: one that is kept each time would be seen.
        for frames in (16, 96):
            makeMovie(cls.folder / f"{frames}.mkv", frames, "320x180")
        for frame in range(6):
            writeImage(cls.folder / f"large.{frame:04d}.exr", street(1536, 864))

    def peak(self, *arguments):
        return self.rain(*arguments)["peak_memory_mb"]

    def test_longClipsNeedNoMore(self):
        rain = ["--strokes", "500"]
        for name, more in (("movie", ["-o", "out.mkv"]), ("images", ["-o", "out.%04d.exr"]),
                           ("layers", ["-o", "out.%04d.exr", "--layers"])):
            few, many = (self.peak(f"{frames}.mkv", *more, *rain) for frames in (16, 96))
            self.assertLess(many, 1.06 * few + 2, name)
        few, many = (self.peak(f"{frames}.mkv", "-o", "out.mkv", "--reencode", *OFF) for frames in (16, 96))
        self.assertLess(many, 1.06 * few + 2, "nothing done to it")

    def test_whatIsPlannedIsUsed(self):
        for more in ([], ["--layers"], ["--ground", "1.6", "--blur", "2"]):
            report = self.rain("large.%04d.exr", "-o", "out.%04d.exr", "--strokes", "20000", *more)
            share = report["peak_memory_mb"] / report["planned_memory_mb"]
            self.assertGreater(share, 2 / 3, more)
            self.assertLess(share, 4 / 3, more)
            self.assertGreater(report["renderer_memory_mb"], 0.5)
            self.assertLess(report["renderer_memory_mb"], report["peak_memory_mb"])

    def test_itIsSaidBefore(self):
        run = self.succeeds("rain", "96.mkv", "-o", "out.mkv", "--explain", "--strokes", "500")
        memory = [i for i, line in enumerate(run.lines) if re.match(r"memory +on +about \d+ MB: program 130 MB, ", line)]
        first = [i for i, line in enumerate(run.lines) if re.match(r"virga: frame \d+ ", line)]
        self.assertEqual(len(memory), 1, run)
        self.assertTrue(not first or memory[0] < first[0], run)


if __name__ == "__main__":
    unittest.main()
