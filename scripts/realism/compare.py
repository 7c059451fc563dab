#!/usr/bin/env python3
"""Renders rain onto a clip's temporal median and prints its figures beside the filmed ones.

usage: compare.py CLIP --settings look.toml [--crop x,y,w,h] [--frames N] [--keep FOLDER] [NAME=VALUE ...]

The test of docs/realism.md: the rendered frames are packed losslessly (FFV1, bgr0) and measured by realism.py as the
clip is. Exit code 1 if a figure is out by more than a factor of 1.5. NAME=VALUE overrides a setting of the file.
"""
import argparse
import pathlib
import subprocess
import sys
import tempfile

import match


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clip")
    parser.add_argument("overrides", nargs="*", metavar="NAME=VALUE")
    parser.add_argument("--settings", required=True)
    parser.add_argument("--crop")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--plate-frames", type=int, default=150)
    parser.add_argument("--keep", help="folder for the plate, the frames and the movie (left there)")
    parser.add_argument("--virga", default=match.default_virga())
    parser.add_argument("--realism", default=match.default_realism())
    options = parser.parse_args()

    realism = match.load_realism(options.realism)
    crop = tuple(map(int, options.crop.split(","))) if options.crop else None
    with tempfile.TemporaryDirectory(prefix="virga_compare_") as temporary:
        folder = pathlib.Path(options.keep or temporary)
        folder.mkdir(parents=True, exist_ok=True)
        match.median_plate(options.clip, options.plate_frames, folder / "median.png")
        words = [options.virga, "rain", str(folder / "median.png"), "-o", str(folder / "rain.%04d.png"), "--frames",
                 f"0-{options.frames - 1}", "--settings", options.settings, "--quiet"]
        for item in options.overrides:
            name, value = item.split("=")
            words += [f"--{name}", value]
        subprocess.run(words, check=True)
        movie = str(folder / "rain.mkv")
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-i", str(folder / "rain.%04d.png"), "-c:v", "ffv1",
                        "-pix_fmt", "bgr0", movie], check=True)
        filmed = realism.stats(options.clip, options.frames, crop)
        ours = realism.stats(movie, options.frames, crop)
    sys.exit(0 if match.report(filmed, ours) else 1)


if __name__ == "__main__":
    main()
