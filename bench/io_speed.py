#!/usr/bin/env python3
"""Reading and writing alone, with every effect off, against ffmpeg and oiiotool on the same files, in turn, in one run:
    bench/io_speed.py [--virga build/release/bin/virga] [--clip FILE] [--width 1920] [--frames 48] [--laps 3]
Clips are cut from the sample, or from --clip, and scaled. Prints the medians of each, their ratio, and the spread."""

import argparse
import os
import statistics
import subprocess
import tempfile
import time

root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
OFF = ["--rate", "0", "--darken", "0", "--desaturate", "0", "--fog", "0", "--splashes", "0", "--blur", "0", "--quiet"]

# name, how ffmpeg makes the clip, container, how ffmpeg writes it again, how virga does
MOVIES = [
    ("h264 8 bit", ["-c:v", "libx264", "-crf", "16"], "mp4", ["-c:v", "libx264", "-crf", "18"],
     ["--codec", "libx264", "--quality", "18"]),
    ("hevc 10 bit", ["-c:v", "libx265", "-pix_fmt", "yuv420p10", "-crf", "18", "-x265-params", "log-level=none"], "mkv",
     ["-c:v", "libx265", "-crf", "20", "-x265-params", "log-level=none"], ["--codec", "libx265", "--quality", "20"]),
    ("prores 422 hq", ["-c:v", "prores_ks", "-profile:v", "3", "-pix_fmt", "yuv422p10"], "mov",
     ["-c:v", "prores_ks", "-profile:v", "3"], ["--codec", "prores_ks"]),
    ("dnxhr hq", ["-c:v", "dnxhd", "-profile:v", "dnxhr_hq", "-pix_fmt", "yuv422p"], "mov",
     ["-c:v", "dnxhd", "-profile:v", "dnxhr_hq"], ["--codec", "dnxhd"]),
    ("ffv1 10 bit", ["-c:v", "ffv1", "-pix_fmt", "yuv422p10", "-slices", "16"], "mkv",
     ["-c:v", "ffv1", "-slices", "16"], ["--codec", "ffv1"]),
    ("raw 8 bit", ["-c:v", "rawvideo", "-pix_fmt", "yuv420p"], "nut", ["-c:v", "rawvideo"], ["--codec", "rawvideo"]),
]
IMAGES = [("exr half zip", ["-d", "half", "--compression", "zip"]), ("exr half piz", ["-d", "half", "--compression", "piz"]),
          ("exr half none", ["-d", "half", "--compression", "none"]), ("exr half dwaa", ["-d", "half", "--compression", "dwaa"])]


def run(command):
    start = time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr.decode()}")
    return time.perf_counter() - start


def compare(name, theirs, ours, frames, laps):
    times = ([], [])
    for _ in range(laps):
        for command, to in zip((theirs, ours), times):
            to.append(run(command))
    a, b = (statistics.median(t) for t in times)
    spread = max((max(t) - min(t)) / statistics.median(t) for t in times)
    print(f"| {name} | {1e3 * a / frames:.1f} | {1e3 * b / frames:.1f} | {b / a:.2f} | {100 * spread:.0f} % |", flush=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--virga", default=f"{root}/build/release/bin/virga")
    parser.add_argument("--clip", default=f"{root}/samples/street.mp4")
    parser.add_argument("--width", type=int, default=1920)
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--laps", type=int, default=3)
    parser.add_argument("--only", default="", help="cases whose name has this in it")
    o = parser.parse_args()
    ffmpeg = ["ffmpeg", "-v", "error", "-nostdin", "-y"]
    with tempfile.TemporaryDirectory() as work:
        # Without loss first, so that each codec is given the same pictures. Noise, as cameras have it.
        source = f"{work}/source.mkv"
        run(ffmpeg + ["-stream_loop", "-1", "-i", o.clip, "-frames:v", str(o.frames), "-an", "-vf",
                      f"scale={o.width}:-2,noise=alls=4:allf=t", "-c:v", "ffv1", source])
        print("| | ffmpeg or oiiotool, ms a frame | virga, ms a frame | ratio | spread of laps |\n|---|---|---|---|---|")
        for name, make, container, again, flags in MOVIES:
            if o.only not in name:
                continue
            clip = f"{work}/clip.{container}"
            run(ffmpeg + ["-i", source] + make + [clip])
            compare(name, ffmpeg + ["-i", clip] + again + [f"{work}/theirs.{container}"],
                    [o.virga, "rain", clip, "-o", f"{work}/ours.{container}", "--reencode"] + OFF + flags, o.frames, o.laps)
        few = min(o.frames, 12)
        for name, how in IMAGES:
            if o.only not in name:
                continue
            for old in os.listdir(work):
                if old.endswith(".exr"):
                    os.remove(f"{work}/{old}")
            run(ffmpeg + ["-i", source, "-frames:v", str(few), "-pix_fmt", "gbrpf32le", f"{work}/raw.%04d.exr"])
            run(["oiiotool", "--frames", f"1-{few}", f"{work}/raw.%04d.exr"] + how + ["-o", f"{work}/in.%04d.exr"])
            compare(name, ["oiiotool", "--frames", f"1-{few}", f"{work}/in.%04d.exr", "-o", f"{work}/theirs.%04d.exr"],
                    [o.virga, "rain", f"{work}/in.%04d.exr", "-o", f"{work}/ours.%04d.exr"] + OFF, few, o.laps)


if __name__ == "__main__":
    main()
