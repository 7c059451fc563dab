#!/usr/bin/env python3
"""docs/formats.md from what the tests of movies and images found:
    scripts/make_formats_page.py [--virga build/test/bin/virga]
Runs tests/cli/movie_in_test.py and movie_out_test.py, whose rows are equal to ffmpeg's decode or the tests fail, and
images_test.py, whose rows are what a plate is after a rain that does nothing."""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict

root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
HEAD = """# Formats

Made by `scripts/make_formats_page.py` from `tests/cli/movie_in_test.py` and `movie_out_test.py`, which make each clip with ffmpeg, and `images_test.py`. Do not edit.

## Movies in

The codes are those of ffmpeg's own decode, bit for bit, in every row; frames asked for by number, out of order, are the frames that come in order.

"""
OUT = """
## Movies through, without loss

The plate's codes come back bit for bit, in both ranges for YCbCr, with the codes outside of the legal range among them. Where nothing is done to any
frame and no other form is asked for, the packets themselves are copied, into containers of the plate's kind: all of them, or with `--frames` a run that
needs none outside of it (from the start of a closed group of pictures, or any where every picture stands alone). Sound, chapters and timecode are cut
with it. `not_copied_because` in the report says why one was encoded all the same.

"""
LOSSY = """
## Movies out, with loss

Plays, with all its frames, in the size and pixel format shown.

"""
IMAGES = """
## Images

What comes back from a plate to which nothing is done. An EXR brings all of its file along into another EXR: other parts, views and
layers, channels in their own types, windows, tiles, attributes of every type; `--layer` and `--view` say which picture is rained on.
Other formats take the picture alone, and what is left out is named. It rains in the overscan too, as far as the frame is wide and high;
the picture inside the display window is the same, bit for bit, with overscan and without. Layers end at the display window.

- **Types**: in its own format each file is as the one that it came from, frame by frame: 8, 10, 12 or 16 bits, half or float, each channel
  of an EXR for itself. Whole numbers of 32 bits are data: kept, and refused as the picture.
- **Grey** stays grey where all of the result is (PNG, TIFF, JPEG, EXR); a frame with colour in it has three channels.
- **Alpha** stands as the table says; TIFF keeps its own kind, and integers of other plates are straight there.
- **Way up**: `Orientation` of TIFF and JPEG is applied, and written as 1.
- **Frames that differ** from the first in size, colour space, alpha that it has not, or floats among integers are refused by name.

"""
TAIL = """
## What is not promised

- **Damage**: what a codec can tell is told (`--on-error`). FFmpeg shows most random damage in HEVC, VP9, AV1, ProRes and MJPEG without a word, and so does
  Virga; FFV1 with checksums and MPEG-2 are told from the first wrong bit on nearly always.
- **Copied packets** are not decoded: damage in them goes along, and a plate that is turned to be shown keeps its turn.
- **Sound** is copied, and is in time to the sample, through any number of generations (`tests/cli/movie_sound_test.py`). Matroska cannot hide part of a packet:
  priming that is no whole number of packets (Apple's AAC: two and 64 samples), and the start of sound after a cut, are to the nearest packet there.
- **Clean apertures** (MP4's `clap`, Matroska's PixelCrop) are told, not applied, and not written again, copied packets included: FFmpeg's muxers have no
  place for them.
- **Pipes in** are spooled into a file first ($TMPDIR), as frames are asked for by number. **Pipes out** take containers that need no way back.
- **Killed**: MP4 and MOV are written as fragments under `.NAME.partial-HOST-PID-N.mp4` and rewritten when whole; Matroska, MPEG-TS, AVI and NUT play as far
  as they go; MXF does not. The next run to that output names what a killed one left, and removes it when its own is whole.
- **Two processes** that write one output do not disturb each other: the one that ends last has the name, frame by frame in a sequence.
- **Memory**: two to eight frames are read ahead (400 MB at most, two frames at least), two wait to be encoded, and one per core, eight at most, to be
  written as images.
"""


def table(rows, direction):
    found = defaultdict(set)
    for row in rows:
        if row["direction"] == direction:
            found[row["codec"], row["container"]].add(row["pixel_format"])
    lines = ["| codec | container | pixel formats |", "|---|---|---|"]
    for (codec, container), formats in sorted(found.items()):
        lines.append(f"| {codec} | {container} | {', '.join(sorted(formats))} |")
    return "\n".join(lines) + "\n"


def imageTable(rows):
    found = defaultdict(set)
    for row in rows:
        if row["direction"] == "image":
            found[row["format"], row["how"]].add(row["samples"])
    lines = ["| format | samples | what comes back |", "|---|---|---|"]
    for (name, how), samples in sorted(found.items()):
        lines.append(f"| {name} | {'; '.join(sorted(samples))} | {how} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--virga", default=f"{root}/build/test/bin/virga")
    virga = os.path.abspath(parser.parse_args().virga)
    rows = []
    with tempfile.TemporaryDirectory() as work:
        found = f"{work}/rows.jsonl"
        for test in ("movie_in_test.py", "movie_out_test.py", "images_test.py"):
            done = subprocess.run([sys.executable, "-B", f"{root}/tests/cli/{test}"], capture_output=True, text=True,
                                  env={**os.environ, "VIRGA": virga, "VIRGA_FORMATS_OUT": found})
            if done.returncode != 0:
                raise SystemExit(done.stderr)
        with open(found) as file:
            rows = [json.loads(line) for line in file]
    matrices = [row for row in rows if row["direction"] == "matrix"]
    with open(f"{root}/docs/formats.md", "w") as page:
        page.write(HEAD + table(rows, "in"))
        page.write(f"\nBT.601, 709 and 2020, limited and full range, 8, 10 and 16 bits: R'G'B' is the standards' formula to "
                   f"{max(row['max_error'] for row in matrices):.0e} ({len(matrices)} cases).\n")
        page.write(OUT + table(rows, "through") + LOSSY + table(rows, "out") + IMAGES + imageTable(rows) + TAIL)


if __name__ == "__main__":
    main()
