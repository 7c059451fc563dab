"""A movie whose container asks for a part of the picture: said, with its numbers; the picture is taken whole."""
import struct
import unittest

from support import OFF, CliTest, ffmpeg, probe


def box(data, begin, end, name):
    """(start, end) of the box of that name among those in data[begin:end]."""
    while begin < end:
        size = struct.unpack(">I", data[begin:begin + 4])[0]
        if data[begin + 4:begin + 8] == name:
            return begin, begin + size
        begin += size
    raise AssertionError(name)


def withClap(data, clap):
    """With the box at the end of the first track's sample entry; the table lies behind the pictures, which stay in place."""
    data, parents, begin, end = bytearray(data), [], 0, len(data)
    for name in (b"moov", b"trak", b"mdia", b"minf", b"stbl", b"stsd"):
        start, end = box(data, begin, end, name)
        parents.append(start)
        begin = start + 8
    entry = begin + 8
    parents.append(entry)
    at = entry + struct.unpack(">I", data[entry:entry + 4])[0]
    for parent in parents:
        data[parent:parent + 4] = struct.pack(">I", struct.unpack(">I", data[parent:parent + 4])[0] + len(clap))
    return bytes(data[:at] + clap + data[at:])


def element(data, begin, end, wanted):
    """(place of the size, its length, begin, end) of the EBML element among those in data[begin:end]."""
    while begin < end:
        idLength = 9 - data[begin].bit_length()
        name, at = bytes(data[begin:begin + idLength]), begin + idLength
        length = 9 - data[at].bit_length()
        size = int.from_bytes(data[at:at + length], "big") - (1 << 7 * length)
        begin = at + length
        stop = min(begin + size, end)
        if name == wanted:
            return at, length, begin, stop
        begin = stop
    raise AssertionError(wanted)


def withPixelCrop(data, left, top, right, bottom):
    crop = b"".join(name + b"\x81" + bytes([value]) for name, value in
                    ((b"\x54\xcc", left), (b"\x54\xbb", top), (b"\x54\xdd", right), (b"\x54\xaa", bottom)))
    data, sizes, begin, end = bytearray(data), [], 0, len(data)
    for name in (b"\x18\x53\x80\x67", b"\x16\x54\xae\x6b", b"\xae", b"\xe0"):
        at, length, begin, end = element(data, begin, end, name)
        sizes.append((at, length))
    for at, length in sizes:
        data[at:at + length] = (int.from_bytes(data[at:at + length], "big") + len(crop)).to_bytes(length, "big")
    return bytes(data[:end] + crop + data[end:])


class Aperture(CliTest):
    @classmethod
    def makePlates(cls):
        for name in ("p.mov", "p.mp4", "p.mkv"):
            ffmpeg("-f", "lavfi", "-i", "testsrc2=s=96x64:r=25:d=0.12", "-c:v", "libx264", cls.folder / name)

    def check(self, name, words):
        warning = f"warning: {name}: asks to be shown cropped to its clean aperture, {words} of 96 x 64; it is taken whole"
        self.assertIn(warning, self.succeeds("rain", name, "-o", "o.mkv", *OFF, "--reencode").err)
        self.assertEqual(probe(self.folder / "o.mkv")["width"], 96)
        self.assertEqual(self.succeeds("info", name, "--json").report["clean_aperture"], words)
        self.assertIn(f"clean part    {words}", self.succeeds("info", name).out)

    def test_clap(self):
        # Width 88, height 60, its middle 2 to the right of the picture's and 1/2 up.
        clap = struct.pack(">I4s8i", 40, b"clap", 88, 1, 120, 2, 2, 1, -1, 2)
        for name in ("p.mov", "p.mp4"):
            (self.folder / ("c" + name)).write_bytes(withClap((self.folder / name).read_bytes(), clap))
            self.check("c" + name, "88 x 60 at 6,1.5")

    def test_pixelCrop(self):
        (self.folder / "c.mkv").write_bytes(withPixelCrop((self.folder / "p.mkv").read_bytes(), 4, 2, 6, 0))
        self.check("c.mkv", "86 x 62 at 4,2")

    def test_nothingToSay(self):
        whole = struct.pack(">I4s8i", 40, b"clap", 96, 1, 64, 1, 0, 1, 0, 1)
        wrong = [struct.pack(">I4s8i", 40, b"clap", *numbers) for numbers in
                 ((88, 0, 60, 1, 0, 1, 0, 1), (-88, 1, 60, 1, 0, 1, 0, 1), (880, 1, 60, 1, 0, 1, 0, 1), (88, 1, 60, 1, 900, 1, 0, 1))]
        plain = (self.folder / "p.mp4").read_bytes()
        cases = [plain, (self.folder / "p.mkv").read_bytes()] + [withClap(plain, clap) for clap in (whole, *wrong)]
        for number, data in enumerate(cases):
            with self.subTest(number=number):
                name = "n.mkv" if number == 1 else "n.mp4"
                (self.folder / name).write_bytes(data)
                run = self.succeeds("info", name, "--json")
                self.assertEqual(run.err, "")
                self.assertIsNone(run.report["clean_aperture"])


if __name__ == "__main__":
    unittest.main()
