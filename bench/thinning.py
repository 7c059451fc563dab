#!/usr/bin/env python3
"""What thinning faint strokes does to the rain's layer, beside the layer in which each stroke is drawn:
    bench/thinning.py [--virga build/release/bin/virga] [--size 1920x1080] [--frames 4] [--thin 0.08 ...] [-- MORE FLAGS]
Renders the sample street with `--layers` for `--thin` 0 and the values given, and prints of the layer's opacity mean,
variance, skewness and kurtosis, each the mean of the frames, and the power spectrum as a share of that of `--thin 0`, octave by
octave from the widest to the finest. Needs oiiotool and numpy, and OpenCV to read."""

import argparse
import json
import os
import subprocess
import sys
import tempfile

import cv2
import numpy as np

root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def opacity(exr, folder):
    tif = os.path.join(folder, "alpha.tif")
    subprocess.run(["oiiotool", exr, "--ch", "rain.A", "-d", "float", "-o", tif], check=True)
    return cv2.imread(tif, cv2.IMREAD_UNCHANGED).astype(np.float64)


def octaves(layer):
    power = np.abs(np.fft.rfft2(layer - layer.mean())) ** 2
    radius = np.hypot(np.fft.fftfreq(layer.shape[0])[:, None], np.fft.rfftfreq(layer.shape[1])[None, :])
    octave = np.floor(np.log2(np.maximum(radius, 1e-9))).astype(int)  # cycles a pixel; -1 is a quarter to a half and beyond
    return np.array([power[(octave == o) & (radius > 0)].mean() for o in range(-8, 0)])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--virga", default=f"{root}/build/release/bin/virga")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--frames", type=int, default=4)
    parser.add_argument("--thin", type=float, nargs="+", default=[0.08])
    own, flags = (sys.argv[1:], []) if "--" not in sys.argv else (
        sys.argv[1:sys.argv.index("--")], sys.argv[sys.argv.index("--") + 1:])
    o = parser.parse_args(own)
    with tempfile.TemporaryDirectory() as folder:
        clip = os.path.join(folder, "plate.mkv")
        subprocess.run(["ffmpeg", "-v", "error", "-i", f"{root}/samples/street.mp4", "-frames:v", str(o.frames), "-an", "-vf",
                        "scale=" + o.size.replace("x", ":"), "-c:v", "ffv1", clip], check=True)
        first = None
        for thin in [0, *o.thin]:
            out = os.path.join(folder, "rain.%04d.exr")
            done = subprocess.run([o.virga, "rain", clip, "-o", out, "--thin", str(thin), "--layers", "--quiet", "--json", *flags],
                                  stdout=subprocess.PIPE, check=True)
            layers = [opacity(out % n, folder) for n in range(o.frames)]
            moments = []
            for layer in layers:
                off = layer - layer.mean()
                variance = (off ** 2).mean()
                moments.append((layer.mean(), variance, (off ** 3).mean() / variance ** 1.5, (off ** 4).mean() / variance ** 2))
            mean, variance, skewness, kurtosis = np.mean(moments, 0)
            spectrum = np.mean([octaves(layer) for layer in layers], 0)
            first = spectrum if first is None else first
            print(f"--thin {thin:g}: {json.loads(done.stdout)['strokes_per_frame']:.0f} strokes, mean {mean:.5f}, "
                  f"variance {variance:.4e}, skewness {skewness:.2f}, kurtosis {kurtosis:.1f}, spectrum "
                  + " ".join(f"{share:.3f}" for share in spectrum / first), flush=True)


if __name__ == "__main__":
    main()
