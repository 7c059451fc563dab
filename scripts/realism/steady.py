#!/usr/bin/env python3
"""Holds a window of a hand-held or slowly panning clip still, so that realism.py and match.py can measure its rain.

usage: steady.py CLIP -o FOLDER [--first N] [--frames N]

Each frame is turned and shifted onto the window's middle frame (OpenCV's enhanced correlation coefficient) and written
as FOLDER/%04d.png. Measure a crop that stays inside all frames.
"""
import argparse
import pathlib

import cv2
import numpy as np


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clip")
    parser.add_argument("-o", "--output", required=True)
    parser.add_argument("--first", type=int, default=0, help="frames to leave out at the start")
    parser.add_argument("--frames", type=int, default=24)
    options = parser.parse_args()

    capture, frames = cv2.VideoCapture(options.clip), []
    while len(frames) < options.first + options.frames:
        good, frame = capture.read()
        if not good:
            break
        frames.append(frame)
    frames = frames[options.first:]
    folder = pathlib.Path(options.output)
    folder.mkdir(parents=True, exist_ok=True)
    middle = cv2.cvtColor(frames[len(frames) // 2], cv2.COLOR_BGR2GRAY)
    for i, frame in enumerate(frames):
        grey = cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY)
        warp = np.eye(2, 3, dtype=np.float32)
        warp[:, 2] = cv2.phaseCorrelate(np.float32(middle), np.float32(grey))[0]
        stop = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 60, 1e-5)
        try:
            _, warp = cv2.findTransformECC(middle, grey, warp, cv2.MOTION_EUCLIDEAN, stop, None, 5)
        except cv2.error:
            print(f"frame {i}: only shifted")
        size = frame.shape[1::-1]
        still = cv2.warpAffine(frame, warp, size, flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
                               borderMode=cv2.BORDER_REPLICATE)
        cv2.imwrite(str(folder / f"{i:04d}.png"), still)


if __name__ == "__main__":
    main()
