#!/usr/bin/env python3
"""Finds rain settings that look like a filmed clip, in the numbers of realism.py.

usage: match.py CLIP -o settings.toml [--crop x,y,w,h] [--start settings.toml] [--evaluations N] [--virga PATH]

The clip's temporal median becomes a plate, rain is rendered onto it, and settings are moved one at a time (a pattern
search over the logarithms of the positive ones) until the rain's figures are within a factor of 1.5 of the clip's.
CLIP is a movie or a pattern (frames/%05d.jpg) with a camera that stands still. Needs python3-numpy, python3-opencv.
"""
import argparse
import importlib.util
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import cv2
import numpy as np

repository = pathlib.Path(__file__).resolve().parents[2]

FACTOR = np.log2(1.5)
# Figures that must agree within that factor, and the powers that must lie on the same side of 1.
SHARES = ["dark net 20", "dark net 40", "mid net 20", "mid net 40", "strokes per megapixel and frame"]
SPREADS = ["length px p10/p50/p90", "width px p10/p50/p90", "contrast levels p10/p50/p90"]
TILT = "tilt deg p10/p50/p90"

# What is searched: name, first step, least, most. Steps are in log2, except for those of LINEAR.
SEARCHED = [
    ("exposure", 0.4, 1e-4, 0.1), ("opacity", 0.4, 0.2, 40), ("rate", 0.8, 0.5, 1000), ("near", 0.5, 0.05, 20),
    ("drop-size", 0.4, 0.25, 6), ("threshold", 0.7, 0.002, 0.3), ("env-gain", 0.3, 0.3, 3), ("focus", 0.6, 0.2, 50),
    ("fstop", 0.6, 0.7, 64), ("turbulence", 0.5, 0.02, 4), ("wind-x", 0.15, -20, 20), ("softness", 0.4, 0.1, 8),
]
LINEAR = {"wind-x"}
FIRST = {"exposure": 0.004, "opacity": 2, "rate": 50, "near": 0.6, "drop-size": 1.5, "threshold": 0.02, "env-gain": 1,
         "focus": 4, "fstop": 4, "turbulence": 0.25, "wind-x": 0, "softness": 0.6}


def default_virga():
    return shutil.which("virga") or str(repository / "build/release/bin/virga")


def default_realism():
    return str(repository.parent / "shared/tools/realism.py")


def load_realism(path):
    spec = importlib.util.spec_from_file_location("realism", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def median_plate(clip, count, path):
    capture, frames = cv2.VideoCapture(clip), []
    while len(frames) < count:
        good, frame = capture.read()
        if not good:
            break
        frames.append(frame)
    if not frames:
        sys.exit(f"match.py: no frame can be read from '{clip}'")
    cv2.imwrite(str(path), np.round(np.median(np.stack(frames), 0)).astype(np.uint8))
    return capture.get(cv2.CAP_PROP_FPS)


def differences(filmed, ours):
    """Name -> log2 of ours over filmed; absent where the clip has no such figure."""
    found = {}
    for name in SHARES:
        if filmed.get(name, 0) > 1e-4:
            found[name] = np.log2(max(ours.get(name, 0), 1e-5) / filmed[name])
    for name in SPREADS:
        if name in filmed:
            for part, a, b in zip(("p10", "p50", "p90"), filmed[name], ours.get(name, [1e-3] * 3)):
                found[name.replace("p10/p50/p90", part)] = np.log2(b / a)
    return found


def sides(filmed, ours):
    """Name -> (filmed, ours) of the powers across over along."""
    return {k: (filmed[k], ours[k]) for k in filmed if k.startswith("power") and k in ours}


def loss(filmed, ours):
    total = 0.0
    for value in differences(filmed, ours).values():
        value = min(abs(value), 6)
        total += 0.1 * value**2 + 3 * max(0, value - 0.75 * FACTOR) ** 2
    for a, b in sides(filmed, ours).values():
        margin = 0.3 * min(abs(np.log2(a)), 1)
        total += 2 * max(0, margin - np.log2(b) * np.sign(np.log2(a))) ** 2
    if TILT in filmed and TILT in ours:
        total += sum((0.05 * (a - b)) ** 2 for a, b in zip(filmed[TILT], ours[TILT]))
    # Not asked for, but seen: haze of strokes too faint to be counted, and how spiky the rain is.
    for name in ("dark net 10", "mid net 10", "skewness"):
        if filmed.get(name, 0) > 1e-3 and ours.get(name, 0) > 0:
            total += 0.1 * np.log2(ours[name] / filmed[name]) ** 2
    return total


class Renderer:
    def __init__(self, options, realism, crop, folder, fps):
        self.options, self.realism, self.crop, self.folder, self.fps = options, realism, crop, folder, fps
        self.count = 0

    def command(self, settings, output, frames):
        words = [self.options.virga, "rain", str(self.folder / "median.png"), "-o", output, "--frames",
                 f"0-{frames - 1}", "--fps", str(self.fps), "--quiet"]
        for name, value in settings.items():
            words += [f"--{name}", str(value)]
        return words

    def measure(self, settings, frames):
        self.count += 1
        pattern = str(self.folder / "rain.%04d.png")
        done = subprocess.run(self.command(to_flags(settings), pattern, frames), capture_output=True, text=True)
        if done.returncode:
            print(done.stderr.strip(), file=sys.stderr)
            return {}
        return self.realism.stats(pattern, frames, self.crop)


def to_flags(settings):
    flags = {k: v for k, v in settings.items() if k != "wind-x"}
    if "wind-x" in settings:
        flags["wind"] = f"{settings['wind-x']:.4g},0"
    return {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in flags.items()}


def read_toml(path):
    """The flat settings files of virga rain --save-settings."""
    found = {}
    for line in open(path):
        match = re.match(r'\s*([\w-]+)\s*=\s*(.+?)\s*(#.*)?$', line)
        if not match:
            continue
        name, text = match.group(1), match.group(2).strip('"')
        if name == "wind":
            found["wind-x"] = float(re.findall(r"[-+.\de]+", text)[0])
        else:
            try:
                found[name] = float(text)
            except ValueError:
                pass
    return found


def value_of(figures, name):
    if name in figures:
        return figures[name]
    kind, part = name.rsplit(" ", 1)
    return figures.get(kind + " p10/p50/p90", [0] * 3)[("p10", "p50", "p90").index(part)]


def report(filmed, ours):
    """Prints filmed, ours and the log2 of their ratio; False if something is out."""
    ok = True
    for name, value in differences(filmed, ours).items():
        within = abs(value) <= FACTOR
        ok &= within
        a, b = value_of(filmed, name), value_of(ours, name)
        print(f"{name:34s} {a:10.4f} {b:10.4f}  {value:+.2f}{'' if within else '  OUT'}")
    for name, (a, b) in sides(filmed, ours).items():
        same = (a > 1) == (b > 1)
        ok &= same
        print(f"{name:34s} {a:10.4f} {b:10.4f}  {'same side' if same else 'OTHER SIDE'}")
    return ok


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("clip")
    parser.add_argument("-o", "--output", required=True, help="settings file to write")
    parser.add_argument("--crop", help="x,y,w,h of the part that is measured")
    parser.add_argument("--start", help="settings file to start from")
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", help="a setting that is held")
    parser.add_argument("--clip-frames", type=int, default=60, help="frames measured at the end and of the clip")
    parser.add_argument("--plate-frames", type=int, default=150, help="frames in the plate's median")
    parser.add_argument("--frames", type=int, default=20, help="frames rendered while searching")
    parser.add_argument("--evaluations", type=int, default=150)
    parser.add_argument("--fps", type=float)
    parser.add_argument("--virga", default=default_virga())
    parser.add_argument("--realism", default=default_realism())
    options = parser.parse_args()

    realism = load_realism(options.realism)
    crop = tuple(map(int, options.crop.split(","))) if options.crop else None
    filmed = realism.stats(options.clip, options.clip_frames, crop)
    held = {"darken": 0.0, "desaturate": 0.0, "fog": 0.0, "splashes": 0.0, "gust": 0.0}
    held.update((n, float(v)) for n, v in (item.split("=") for item in options.set))
    known = subprocess.run([options.virga, "rain", "--help"], capture_output=True, text=True).stdout
    searched = [s for s in SEARCHED if s[0] not in held and (s[0] in LINEAR or f"--{s[0]}" in known)]
    start = dict(FIRST)
    if options.start:
        start.update(read_toml(options.start))

    with tempfile.TemporaryDirectory(prefix="virga_match_") as folder:
        folder = pathlib.Path(folder)
        fps = median_plate(options.clip, options.plate_frames, folder / "median.png")
        renderer = Renderer(options, realism, crop, folder, options.fps or round(fps, 3))
        best = {**held, **{name: start[name] for name, *_ in searched}}
        ours = renderer.measure(best, options.frames)
        lowest = loss(filmed, ours)
        steps = {name: step for name, step, *_ in searched}
        print(f"start: loss {lowest:.3f}", flush=True)
        while renderer.count < options.evaluations and max(abs(steps[n]) / s for n, s, *_ in searched) > 0.1:
            for name, first, least, most in searched:
                for sign in (1, -1):
                    value = best[name] + sign * steps[name] if name in LINEAR else best[name] * 2 ** (sign * steps[name])
                    trial = {**best, name: float(min(max(value, least), most))}
                    figures = renderer.measure(trial, options.frames)
                    found = loss(filmed, figures) if figures else np.inf
                    if found < lowest - 1e-3:
                        best, lowest, ours = trial, found, figures
                        steps[name] *= sign * 1.3  # a step that went well is tried first, and longer, next time
                        print(f"{renderer.count:4d} loss {lowest:.3f}  {name} {trial[name]:.4g}", flush=True)
                        break
                else:
                    steps[name] *= 0.5
                steps[name] = np.copysign(max(abs(steps[name]), 0.05 * first), steps[name])
                if renderer.count >= options.evaluations:
                    break

        ours = renderer.measure(best, options.clip_frames)
        print(f"{options.clip_frames} frames: loss {loss(filmed, ours):.3f}")
        ok = report(filmed, ours)
        print("settings:", json.dumps(to_flags(best)))
        throwaway = str(folder / "last.png")
        subprocess.run(renderer.command(to_flags(best), throwaway, 1) + ["--save-settings", options.output], check=True)
    sys.exit(0 if ok else 1)


if __name__ == "__main__":
    main()
