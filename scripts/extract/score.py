#!/usr/bin/env python3
"""Scores what `virga extract` finds in cases whose truth is known: RMSE of alpha, RMSE of the scene, F1 of wet pixels.

usage: score.py [CASE ...] [--reference FOLDER] --virga PATH [--flags "..."] [--keep FOLDER]
       score.py [CASE ...] [--reference FOLDER] --result FOLDER

CASE is NAME.json of cases.py, or a folder of them. --reference adds the cases of independently computed reference
numbers (16-bit stacks with float32 solutions) and those that their table has beyond them, made from them: 5/255 noise,
three frames, 48 % of pixels wet. Beside each stands that table's 'bounds + linear cost': the figures to meet, which for
the made cases come from other noise and other strokes of the same kind. "met" names those of alpha, S and F1 that are.

--virga runs   PATH extract NAME_I.png --stack N --linear -o DIR --quiet FLAGS   on each, where {slant} and {color} in
FLAGS become the truth (--flags "--slant {slant}"). --keep leaves inputs and results (FOLDER/NAME) there; --result
scores such a folder again, or, for one case, the folder that holds its alpha.####.exr and clean.exr. Alpha is clipped
to 0..1 first, as the reference's was. Exit code 1 if a case gave no result.
"""
import argparse
import json
import pathlib
import shlex
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace

import numpy as np

from cases import WET, Case, filmed, read_case, read_image, to_16_bits, unstack

# RMSE of alpha / of S / F1 of 0 <= alpha <= 1 with a linear cost, solved to 1e-10 with the true slant and colour: the
# reference's table (slant 7) and, to as many digits, its file em_table.json (slant 0).
TO_MEET = {
    "slant+0_noise0": (0.0037, 0.0005, 0.988), "slant+0_noise2": (0.0060, 0.0020, 0.976),
    "slant+7_noise0": (0.0039, 0.0005, 0.990), "slant+7_noise2": (0.0060, 0.0019, 0.976),
    "slant+7_noise5": (0.0117, 0.0047, 0.949), "slant+7_noise2_wet48": (0.0134, 0.0048, 0.973),
    "slant+7_noise2_frames3": (0.0082, 0.0051, 0.958),
}


class Failure(Exception):
    pass


@dataclass
class Scores:
    alpha: float
    scene: float
    f1: float


def reference_cases(folder):
    """Those of the folder, then those made from slant+7_noise2. Its noise-free twin is composed from the truth."""
    result = []
    for name in ("slant+0_noise0", "slant+0_noise2", "slant+7_noise2"):
        facts = json.loads((folder / f"{name}.json").read_text())
        shape = facts["height"], facts["width"], facts["channels"]
        scene = np.fromfile(folder / f"{name}.f32", "<f4", int(np.prod(shape))).reshape(shape).astype(float)
        kept = {key: facts[key] for key in ("width", "height", "frames", "slant_deg", "noise_255", "C")}
        result.append(Case(name, unstack(folder / f"{name}_I.png", facts["frames"]),
                           unstack(folder / f"{name}_alpha_true.png", facts["frames"])[..., 0], scene, kept))
    base = result[-1]
    color, noise = base.facts["C"], base.facts["noise_255"]
    result.append(replace(base, name="slant+7_noise0", facts={**base.facts, "noise_255": 0},
                          frames=filmed(base.scene, base.alpha, color, 0, np.random.default_rng(0))))
    more = np.random.default_rng(5).normal(0, np.sqrt(5 ** 2 - noise ** 2) / 255, base.frames.shape)
    result.append(replace(base, name="slant+7_noise5", facts={**base.facts, "noise_255": 5},
                          frames=to_16_bits(base.frames + more)))
    alpha = merged(base.alpha, 4, np.random.default_rng(48))
    result.append(replace(base, name="slant+7_noise2_wet48", alpha=alpha,
                          frames=filmed(base.scene, alpha, color, noise, np.random.default_rng(2))))
    result.append(replace(base, name="slant+7_noise2_frames3", facts={**base.facts, "frames": 3},
                          frames=base.frames[:3], alpha=base.alpha[:3]))
    return result


def merged(alpha, layers, rng):
    """Each frame's strokes with those of others, shifted around the picture's edges so that no two frames have a stroke
    in the same place."""
    clear = 1 - alpha
    for layer in range(1, layers):
        for k in range(len(alpha)):
            other = alpha[(k + layer * len(alpha) // layers) % len(alpha)]
            clear[k] *= 1 - np.roll(other, rng.integers(12, other.shape[0] - 12, 2), (0, 1))
    return to_16_bits(1 - clear)


def read_channels(path, wanted):
    pixels, names = read_image(path)
    if not set(wanted) <= set(names):
        raise Failure(f"{path}: has channels {','.join(names)}, must have {','.join(wanted)}")
    return pixels[..., [names.index(name) for name in wanted]]


def score(case, result):
    files = sorted(result.glob("alpha.*.exr"), key=lambda file: int(file.name.split(".")[1]))
    if len(files) != len(case.alpha):
        raise Failure(f"{result}: {len(files)} files alpha.####.exr, must be {len(case.alpha)}")
    alpha = np.clip(np.stack([read_channels(file, ["A"])[..., 0] for file in files]), 0, 1)
    scene = read_channels(result / "clean.exr", ["R", "G", "B"])
    if alpha.shape != case.alpha.shape or scene.shape != case.scene.shape:
        raise Failure(f"{result}: pictures of {scene.shape[1]} x {scene.shape[0]}, must be "
                      f"{case.scene.shape[1]} x {case.scene.shape[0]}")
    found, wet = alpha > WET, case.alpha > WET
    rms = lambda difference: float(np.sqrt((difference ** 2).mean()))
    return Scores(rms(alpha - case.alpha), rms(scene - case.scene),
                  2 * float((found & wet).sum()) / max(1, found.sum() + wet.sum()))


def run(case, options, work):
    """Seconds that it took; results in work/NAME."""
    case.write(work)
    truth = {"slant": f"{case.facts['slant_deg']:g}", "color": ",".join(f"{c:g}" for c in case.facts["C"])}
    words = [options.virga, "extract", str(work / f"{case.name}_I.png"), "--stack", str(case.facts["frames"]),
             "--linear", "-o", str(work / case.name), "--quiet"]
    words += [word.format(**truth) for word in shlex.split(options.flags)]
    start = time.monotonic()
    try:
        done = subprocess.run(words, capture_output=True, text=True)
    except OSError as error:
        raise SystemExit(f"--virga '{options.virga}': {error.strerror}")
    if done.returncode:
        raise Failure((done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1])
    return time.monotonic() - start


def rain_found(result):
    """Slant and colour out of report.json, and the error that it claims for the colour; "-" where it has none."""
    file = result / "report.json"
    rain = json.loads(file.read_text()).get("rain", {}) if file.is_file() else {}
    number = lambda key: "-" if rain.get(key) is None else f"{rain[key]:.3f}"
    color = rain.get("color")
    return number("slant_deg"), "-" if color is None else ",".join(f"{c:.3f}" for c in color), number("color_error")


def row(case, options, work, is_alone):
    if options.result:
        result, seconds = options.result / case.name, None
        if is_alone and not result.is_dir():
            result = options.result
    else:
        seconds, result = run(case, options, work), work / case.name
    scores = score(case, result)
    cells = [f"{scores.alpha:.4f} / {scores.scene:.4f} / {scores.f1:.3f}"]
    limit = TO_MEET.get(case.name)
    if limit:
        met = [name for name, good in (("a", round(scores.alpha, 4) <= limit[0]),
                                        ("S", round(scores.scene, 4) <= limit[1]),
                                        ("F", round(scores.f1, 3) >= limit[2])) if good]
        cells += [f"{limit[0]:.4f} / {limit[1]:.4f} / {limit[2]:.3f}", " ".join(met) or "none"]
    else:
        cells += ["-", "-"]
    slant, color, error = rain_found(result)
    return cells + [f"{slant} ({case.facts['slant_deg']:g})",
                    f"{color} ({','.join(f'{c:g}' for c in case.facts['C'])})", error,
                    "-" if seconds is None else f"{seconds:.2f}"]


def print_table(rows):
    widths = [max(len(cells[i]) for cells in rows) for i in range(len(rows[0]))]
    for number, cells in enumerate(rows):
        print("| " + " | ".join(cell.ljust(width) for cell, width in zip(cells, widths)) + " |")
        if number == 0:
            print("|" + "|".join("-" * (width + 2) for width in widths) + "|")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", type=pathlib.Path, metavar="CASE")
    parser.add_argument("--reference", type=pathlib.Path, metavar="FOLDER")
    parser.add_argument("--only", default="", metavar="TEXT", help="cases whose name has this text")
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--virga", metavar="PATH")
    source.add_argument("--result", type=pathlib.Path, metavar="FOLDER")
    parser.add_argument("--flags", default="", help="more for virga extract")
    parser.add_argument("--keep", type=pathlib.Path, metavar="FOLDER")
    options = parser.parse_args()

    files = [file for path in options.cases for file in (sorted(path.glob("*.json")) if path.is_dir() else [path])]
    cases = (reference_cases(options.reference) if options.reference else []) + [read_case(file) for file in files]
    cases = [case for case in cases if options.only in case.name]
    if not cases:
        parser.error("no cases: give NAME.json, a folder of them, or --reference")
    table = [["case", "wet", "alpha RMSE / S RMSE / F1", "to meet", "met", "slant (true) [deg]", "colour (true)",
              "its error", "s"]]
    failures = []
    with tempfile.TemporaryDirectory(prefix="virga_extract_") as temporary:
        work = options.keep or pathlib.Path(temporary)
        work.mkdir(parents=True, exist_ok=True)
        for case in cases:
            start = [case.name, f"{100 * case.wet:.1f} %"]
            try:
                table.append(start + row(case, options, work, len(cases) == 1))
            except Failure as failure:
                failures.append(f"{case.name}: {failure}")
                table.append(start + ["no result"] + ["-"] * 6)
    print_table(table)
    for failure in failures:
        print(failure, file=sys.stderr)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
