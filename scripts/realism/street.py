#!/usr/bin/env python3
"""Renders the sample street at three rates, all else at its default: the picture of docs/realism.md, and its strokes.

usage: street.py [-o docs/images/realism_street.jpg] [--frames N] [--virga PATH]

Rain falls onto one frame of the street, so that nothing but rain moves; realism.py counts strokes a megapixel and frame.
"""
import argparse
import pathlib
import subprocess
import tempfile

import cv2
import numpy as np

import match

RATES = (5, 25, 80)
FRAME = 48
SHOWN = 12  # of the frames that are rendered
samples = match.repository / "samples"


def frame_of(movie, number):
    capture = cv2.VideoCapture(str(movie))
    capture.set(cv2.CAP_PROP_POS_FRAMES, number)
    return capture.read()[1]


def labelled(picture, words):
    picture = cv2.resize(picture, (640, 360), interpolation=cv2.INTER_AREA)
    return cv2.putText(picture, words, (12, 348), cv2.FONT_HERSHEY_SIMPLEX, 0.6, (230, 230, 230), 1, cv2.LINE_AA)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", default=str(match.repository / "docs/images/realism_street.jpg"))
    parser.add_argument("--frames", type=int, default=30)
    parser.add_argument("--virga", default=match.default_virga())
    parser.add_argument("--realism", default=match.default_realism())
    options = parser.parse_args()

    realism = match.load_realism(options.realism)
    with tempfile.TemporaryDirectory(prefix="virga_street_") as temporary:
        folder = pathlib.Path(temporary)
        plate = frame_of(samples / "street.mp4", FRAME)
        cv2.imwrite(str(folder / "plate.png"), plate)
        tiles = [labelled(plate, "plate")]
        for rate in RATES:
            movie = str(folder / "rain.mkv")
            subprocess.run([options.virga, "rain", str(folder / "plate.png"), "-o", movie, "--codec", "ffv1", "--fps", "24",
                            "--frames", f"0-{options.frames - 1}", "--rate", str(rate), "--splashes", "0", "--quiet",
                            "--depth", str(samples / f"street_depth.{FRAME:04d}.exr"),
                            "--env", str(samples / "street_env.exr")], check=True)
            strokes = realism.stats(movie, options.frames, None)["strokes per megapixel and frame"]
            print(f"{rate} mm/h: {strokes:.0f} strokes per megapixel and frame")
            tiles.append(labelled(frame_of(movie, min(SHOWN, options.frames - 1)), f"{rate} mm/h"))
    sheet = np.vstack([np.hstack(tiles[:2]), np.hstack(tiles[2:])])
    cv2.imwrite(options.output, sheet, [cv2.IMWRITE_JPEG_QUALITY, 85])


if __name__ == "__main__":
    main()
