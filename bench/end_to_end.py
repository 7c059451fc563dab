#!/usr/bin/env python3
"""The whole command against a plain transcode of the same clip with the same codec settings, in turn, in one run:
    bench/end_to_end.py [--virga build/release/bin/virga] [--clip FILE] [--size 1920x1080] [--frames 48] [--laps 3]
                        [--grain 0] [--json] [-- MORE FLAGS OF virga rain]
The clip is cut from the sample, or from --clip, scaled and stored as H.264; --grain adds noise, as cameras have it. Three
commands take turns: `ffmpeg` with the plate, `virga rain`, and `ffmpeg` with what that made, which is the encoder's part of
it: rain is harder to encode than what it falls on. Prints medians of wall-clock time and of all processors' time a frame,
ratios, the passes, and of --timeline what each lane did."""

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections import defaultdict

root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))


def run(command):
    """(wall-clock seconds, seconds of all processors)"""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, check=False)
    wall, after = time.perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr.decode()}")
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def lanes(path, frames):
    """{lane: {stage: ms a frame}}, what the renderer did before the first frame left out."""
    with open(path, encoding="utf-8") as file:
        events = json.load(file)["traceEvents"]
    names = {e["tid"]: e["args"]["name"] for e in events if e["ph"] == "M"}
    begin = max((e["ts"] + e["dur"] for e in events if e["name"] == "start"), default=0)
    found = defaultdict(lambda: defaultdict(float))
    for e in events:
        if e["ph"] == "X" and (e["ts"] >= begin or names[e["tid"]] != "renderer"):
            found[names[e["tid"]]][e["name"]] += 1e-3 * e["dur"] / frames
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--virga", default=f"{root}/build/release/bin/virga")
    parser.add_argument("--clip", default=f"{root}/samples/street.mp4")
    parser.add_argument("--size", default="1920x1080")
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--laps", type=int, default=3)
    parser.add_argument("--grain", type=int, default=0, help="strength of ffmpeg's noise filter")
    parser.add_argument("--json", action="store_true", help="print one object")
    own, flags = (sys.argv[1:], []) if "--" not in sys.argv else (
        sys.argv[1:sys.argv.index("--")], sys.argv[sys.argv.index("--") + 1:])
    o = parser.parse_args(own)
    ffmpeg = ["ffmpeg", "-v", "error", "-nostdin", "-y"]
    codec = ["-an", "-c:v", "libx264", "-crf", "18"]
    with tempfile.TemporaryDirectory() as work:
        clip, rainy, timeline = f"{work}/clip.mp4", f"{work}/rain.mp4", f"{work}/timeline.json"
        noise = f",noise=alls={o.grain}:allf=t" if o.grain else ""
        run(ffmpeg + ["-stream_loop", "-1", "-i", o.clip, "-frames:v", str(o.frames), "-vf",
                      f"scale={o.size.replace('x', ':')}:flags=lanczos,setsar=1{noise}"] + codec + [clip])
        rain = [o.virga, "rain", clip, "-o", rainy, "--codec", "libx264", "--quality", "18", "--quiet"] + flags
        commands = {"plain": ffmpeg + ["-i", clip] + codec + [f"{work}/plain.mp4"], "rain": rain,
                    "rainy": ffmpeg + ["-i", rainy] + codec + [f"{work}/again.mp4"]}
        times = {name: [] for name in commands}
        for _ in range(o.laps):
            for name, command in commands.items():
                times[name].append(run(command))
        report = json.loads(subprocess.run(rain + ["--json", "--timeline", timeline], check=True,
                                           stdout=subprocess.PIPE).stdout)
        stages = lanes(timeline, o.frames)
    median = {name: [1e3 * statistics.median(t[k] for t in laps) / o.frames for k in (0, 1)]
              for name, laps in times.items()}
    ratio = {"plain": median["rain"][0] / median["plain"][0], "rainy": median["rain"][0] / median["rainy"][0]}
    if o.json:
        print(json.dumps({"clip": o.clip, "size": o.size, "frames": o.frames, "grain": o.grain, "flags": flags,
                          "ms_per_frame": {n: dict(zip(("wall", "processors"), m)) for n, m in median.items()},
                          "ratio_to_plain": ratio["plain"], "ratio_to_plain_of_the_result": ratio["rainy"],
                          "start_seconds": report["start_seconds"], "device": report["device"],
                          "passes": report["passes"], "lanes": stages}, indent=1))
        return
    print(f"{os.path.basename(o.clip)}, {o.size}, {o.frames} frames, {report['device']}, "
          f"{report['strokes_per_frame']:.0f} strokes a frame\n")
    print("| | wall clock, ms a frame | all processors, ms a frame |\n|---|---|---|")
    words = {"plain": "plain transcode of the plate", "rain": "virga rain", "rainy": "plain transcode of the result"}
    for name, (wall, cpu) in median.items():
        print(f"| {words[name]} | {wall:.1f} | {cpu:.1f} |")
    print(f"\n{ratio['plain']:.2f} times the plain transcode of the plate, {ratio['rainy']:.2f} times that of the same "
          f"pictures; start {1e3 * report['start_seconds']:.0f} ms, in both")
    for lane, of in stages.items():
        print(f"{lane}: " + ", ".join(f"{stage} {ms:.1f}" for stage, ms in of.items()) + " ms a frame")


if __name__ == "__main__":
    main()
