"""virga info PLATE: what a file says of itself, for people and as JSON."""
import unittest

import numpy as np
from support import CliTest, ffmpeg, writeImage

HDR = ("log-level=none:master-display=G(13250,34500)B(7500,3000)R(34000,16000)WP(15635,16450)L(10000000,50):max-cll=1000,400")


class Info(CliTest):
    @classmethod
    def makePlates(cls):
        (cls.folder / "chapters.txt").write_text(";FFMETADATA1\n[CHAPTER]\nTIMEBASE=1/1000\nSTART=0\nEND=200\ntitle=One\n")
        (cls.folder / "words.srt").write_text("1\n00:00:00,100 --> 00:00:00,300\nIt rains.\n")
        (cls.folder / "font.ttf").write_bytes(bytes(100))
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x64:r=25:d=0.4", "-f", "lavfi", "-i", "sine=d=0.4:r=48000", "-i",
               cls.folder / "words.srt", "-i", cls.folder / "chapters.txt", "-map", "0", "-map", "1", "-map", "2", "-map_metadata",
               "3", "-metadata:s:a:0", "language=deu", "-metadata:s:a:0", "title=Boom", "-attach", cls.folder / "font.ttf",
               "-metadata:s:t:0", "mimetype=font/ttf", "-timecode", "01:00:00:10", "-c:v", "libx265", "-pix_fmt", "yuv420p10",
               "-color_primaries", "bt2020", "-color_trc", "smpte2084", "-colorspace", "bt2020nc", "-color_range", "tv",
               "-chroma_sample_location", "topleft", "-x265-params", HDR + ":chromaloc=2", "-c:a", "flac", cls.folder / "full.mkv")
        ffmpeg("-f", "lavfi", "-i", "testsrc2=s=64x48:r=25:d=0.2", "-c:v", "libx264", cls.folder / "bare.mp4")
        ffmpeg("-i", cls.folder / "bare.mp4", "-c", "copy", "-metadata:s:v:0", "rotate=90", cls.folder / "turned.mov")

    def report(self, *arguments):
        return self.succeeds("info", "--json", *arguments).report

    def test_everythingThatIsThere(self):
        r = self.report("full.mkv")
        self.assertEqual((r["range"], r["matrix"], r["primaries"], r["transfer"], r["chroma_location"]),
                         ("limited", "bt2020nc", "bt2020", "smpte2084", "topleft"))
        self.assertEqual((r["range_is_guess"], r["matrix_is_guess"]), (False, False))
        self.assertEqual((r["timecode"], r["orientation"], r["scan"]), ("01:00:00:10", "upright", "progressive"))
        sound, subtitles, attachment = r["streams"]
        self.assertEqual((sound["kind"], sound["codec"], sound["channels"], sound["rate"], sound["language"], sound["title"]),
                         ("sound", "flac", 1, 48000, "deu", "Boom"))
        self.assertEqual((subtitles["kind"], attachment["kind"], attachment["title"]), ("subtitles", "attachment", "font.ttf"))
        self.assertEqual([(c["start"], c["end"], c["title"]) for c in r["chapters"]], [(0, 0.2, "One")])
        m = r["mastering_display"]
        np.testing.assert_allclose([m["red"], m["green"], m["blue"], m["white"]],
                                   [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06], [0.3127, 0.329]], atol=1e-6)
        self.assertEqual((m["min_cd_m2"], m["max_cd_m2"]), (0.005, 1000))
        self.assertEqual(r["light_level"], {"max_content_cd_m2": 1000, "max_average_cd_m2": 400})
        self.assertIsNone(r["dolby_vision_profile"])

    def test_text(self):
        said = self.succeeds("info", "full.mkv").out
        for words in ("range limited, matrix bt2020nc, primaries bt2020, transfer smpte2084, chroma at topleft",
                      "mastered on   0.005 to 1000 cd/m2, red 0.68 0.32", "light level   1000 cd/m2 at most, 400 on average",
                      "timecode      01:00:00:10", "sound         flac, 1 channel, 48000 Hz, deu, 'Boom'", "subtitles     ass",
                      "attachment    'font.ttf'", "chapter       0.000 to 0.200 s, 'One'"):
            self.assertIn(words, said)

    def test_whatIsNotSaid(self):
        r = self.report("bare.mp4")
        self.assertEqual((r["range"], r["range_is_guess"], r["matrix"], r["matrix_is_guess"]), ("limited", True, "smpte170m", True))
        for key in ("primaries", "transfer", "timecode", "mastering_display", "light_level"):
            self.assertIsNone(r[key], key)
        self.assertEqual((r["streams"], r["chapters"]), ([], []))
        said = self.succeeds("info", "bare.mp4").out
        self.assertIn("range limited (a guess), matrix smpte170m (a guess), primaries not said", said)
        self.assertNotIn("timecode", said)

    def test_turned(self):
        self.assertEqual(self.report("turned.mov")["orientation"], "turned by 90 degrees counterclockwise")
        self.assertIn("shown         turned by 90 degrees counterclockwise", self.succeeds("info", "turned.mov").out)

    def test_streams(self):
        ffmpeg("-i", self.folder / "bare.mp4", "-f", "lavfi", "-i", "color=s=96x64:r=25:d=0.2", "-map", "0", "-map", "1", "-c:v",
               "ffv1", self.folder / "two.mkv")
        self.assertEqual(self.report("two.mkv", "--stream", "0")["width"], 64)
        self.assertEqual(self.report("two.mkv", "--stream", "1")["width"], 96)
        self.refused(2, ["no video stream 2", "0 to 1"], "info", "two.mkv", "--stream", "2")
        self.refused(2, "--stream", "info", "two.mkv", "--stream", "x")

    def test_images(self):
        """Have no tags of movies."""
        writeImage(self.folder / "a.exr", np.zeros((4, 4, 3)))
        r = self.report("a.exr")
        self.assertNotIn("range", r)
        self.assertIsNone(r["scan"])


if __name__ == "__main__":
    unittest.main()
