#!/usr/bin/env python3
"""How long a client of virga serve waits: the first frame after the start, the next one, the same again, one slider moved;
and what the transport costs beside the render.

    VIRGA=build/release/bin/virga bench/serve_latency.py [--size 960x540] [--frames 20] [--device auto]

Prints a table, or with --json an object: p50 and p95 of what the client waits [ms], of what the server says that rendering
took, and their difference. docs/server.md has the figures of one machine.
"""
import argparse
import json
import mmap
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "cli"))
from serving import RAW, SHARED, Server  # noqa: E402
from support import ffmpeg  # noqa: E402

KINDS = {"shared memory": SHARED, "raw": RAW, "EXR": "image/x-exr", "PNG": "image/png", "JPEG": "image/jpeg"}


def share(values, part):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(part * len(ordered)))]


def touch(answer):
    """What a host does with it: shared memory is mapped and every page of it read."""
    if answer.headers["Content-Type"] == SHARED:
        with open(answer.json["path"], "rb") as file, mmap.mmap(file.fileno(), 0, prot=mmap.PROT_READ) as memory:
            return sum(memory[i] for i in range(0, len(memory), 4096))
    return len(answer.body)


class Latency:
    def __init__(self, program, size, frames, device):
        self.rows = {}
        with tempfile.TemporaryDirectory(prefix="virga-latency-") as name:
            folder = Path(name)
            ffmpeg("-f", "lavfi", "-i", f"testsrc2=s={size}:r=25:d={frames / 25}", "-c:v", "libx264", "-preset", "veryfast",
                   "-pix_fmt", "yuv420p", folder / "plate.mp4")
            for cache in ("cold", "warm"):
                begun = time.monotonic()
                server = Server(program, "--root", folder, "--socket", folder / "s.sock", "--prefetch", 0, "--device", device,
                                env=dict(os.environ, XDG_CACHE_HOME=str(folder / "cache")))
                client = server.client()
                path = client.post("/sessions", {"plate": "plate.mp4"}).headers["Location"]
                answer = self.ask(client, f"{path}/frames/0", SHARED)
                self.rows[f"first frame from the start, {cache} cache"] = [((time.monotonic() - begun) * 1e3, answer[1])]
                if cache == "cold":
                    client.close()
                    server.stop()
            try:
                for n in range(frames):  # decoded once: the rows tell rendering and transport
                    self.ask(client, f"{path}/plates/{n}", RAW)
                for kind, accept in KINDS.items():
                    self.rows[f"next frame, {kind}"] = [self.ask(client, f"{path}/frames/{n}?seed={len(self.rows)}", accept)
                                                        for n in range(frames)]
                    self.rows[f"same frame again, {kind}"] = [
                        self.ask(client, f"{path}/frames/{frames - 1}?seed={len(self.rows) - 1}", accept) for _ in range(frames)]
                tag = client.get(f"{path}/frames/0", Accept=RAW).headers["ETag"]
                self.rows["same frame again, 304"] = [self.ask(client, f"{path}/frames/0", RAW, If_None_Match=tag)
                                                      for _ in range(frames)]
                for slider, values in (("darken", lambda i: 0.1 + 0.01 * i), ("wind", lambda i: [0.1 * i, 0]),
                                       ("rate", lambda i: 25 + i), ("env-yaw", lambda i: i)):
                    waits = []
                    for i in range(frames):
                        start = time.monotonic()
                        assert client.patch(path, {slider: values(i + 1)}).status == 200
                        render = self.ask(client, f"{path}/frames/0", SHARED)[1]
                        waits.append(((time.monotonic() - start) * 1e3, render))
                    self.rows[f"slider moved, {slider}"] = waits
                self.device = client.get("/healthz").json["device"]
            finally:
                server.stop()

    @staticmethod
    def ask(client, path, accept, **headers):
        begun = time.monotonic()
        answer = client.get(path, Accept=accept, **headers)
        assert answer.status in (200, 304), answer
        if answer.status == 200:
            touch(answer)
        return (time.monotonic() - begun) * 1e3, float(answer.headers["Virga-Render-Ms"])

    def report(self):
        return {name: {"p50_ms": share([w for w, _ in row], 0.5), "p95_ms": share([w for w, _ in row], 0.95),
                       "render_p50_ms": share([r for _, r in row], 0.5),
                       "beside_p50_ms": statistics.median(w - r for w, r in row)} for name, row in self.rows.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--size", default="960x540")
    parser.add_argument("--frames", type=int, default=20)
    parser.add_argument("--device", default="auto")
    parser.add_argument("--json", action="store_true")
    given = parser.parse_args()
    latency = Latency(os.environ["VIRGA"], given.size, given.frames, given.device)
    report = latency.report()
    if given.json:
        return print(json.dumps({"size": given.size, "device": latency.device, "rows": report}, indent=2))
    print(f"{given.size} on {latency.device}, {os.cpu_count()} processors\n")
    print(f"| {'what':<42} | p50 [ms] | p95 [ms] | of it rendering | beside it |")
    print("|---|---|---|---|---|")
    for name, row in report.items():
        print(f"| {name:<42} | {row['p50_ms']:.1f} | {row['p95_ms']:.1f} | {row['render_p50_ms']:.1f} | {row['beside_p50_ms']:.1f} |")


if __name__ == "__main__":
    main()
