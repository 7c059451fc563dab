#!/usr/bin/env python3
"""Many frame requests in random order from several clients, some cancelled, some malformed, against one virga serve: no
error that is not the client's, no growth of memory, every frame equal to the command line's.

    VIRGA=build/release/bin/virga scripts/stress_server.py [--requests 10000] [--clients 8] [--seed 1] [--device auto]

Builds with sanitizers (scripts/sanitize.sh, scripts/sanitize_threads.sh) hold on to memory of their own: --any-memory.
Prints what was asked and answered as JSON; fails with what went wrong. Needs Debian's python3-numpy and
python3-openimageio. tests/cli/serve_stress_test.py runs a short form.
"""
import argparse
import collections
import json
import os
import random
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "cli"))
import numpy as np  # noqa: E402
from serving import RAW, SHARED, Server, UnixConnection, raw  # noqa: E402
from support import readImage, street, writeImage  # noqa: E402

FRAMES, WIDTH, HEIGHT = 4, 64, 48
LOOKS = [{"rate": 50, "seed": 2}, {"rate": 50, "seed": 2, "wind": [2, 0]}, {"rate": 20, "darken": 0.4},
         {"rate": 90, "ground": "1.5,4", "fog": 0.01}]
MALFORMED = [("GET", "/frames/x"), ("GET", "/frames/0?region=1,1,-1,4"), ("GET", "/frames/0?scale=7"), ("GET", "/frames/999"),
             ("GET", "/frames/0?layers=%"), ("GET", "/frames/0?set.rate=-3"), ("GET", "/frames/0?set.depth=../../etc/passwd"),
             ("PATCH", ""), ("PUT", "/plates/0"), ("POST", "/frames/0"), ("GET", "/nothing")]


def flagsOf(look):
    return [text for name, value in look.items()
            for text in ("--" + name, ",".join(map(str, value)) if isinstance(value, list) else str(value))]


def expected(program, folder, device):
    """What virga rain makes of each look and frame: half planes R, G, B."""
    pictures = {}
    for i, look in enumerate(LOOKS):
        out = folder / f"look{i}.%04d.exr"
        subprocess.run([program, "rain", folder / "root" / "shot.%04d.exr", "-o", out, "--quiet", "--device", device, "--no-cache",
                        *flagsOf(look)], check=True)
        for frame in range(FRAMES):
            pixels, _ = readImage(str(out) % frame, "half")
            pictures[i, frame] = [np.asarray(pixels[..., c]).copy() for c in range(3)]
    return pictures


class Stress:
    def __init__(self, program, requests, clients, seed, device):
        self.counts, self.wrong = collections.Counter(), []
        self.lock = threading.Lock()
        self.memory = []
        with tempfile.TemporaryDirectory(prefix="virga-stress-") as name:
            folder = Path(name)
            (folder / "root").mkdir()
            for frame in range(FRAMES):
                writeImage(folder / "root" / f"shot.{frame:04d}.exr", street(WIDTH, HEIGHT, seed=frame))
            self.pictures = expected(program, folder, device)
            environment = dict(os.environ, XDG_CACHE_HOME=str(folder / "cache"))
            # A cache that does not hold what is asked for: most frames are rendered anew.
            self.server = Server(program, "--root", folder / "root", "--socket", folder / "s.sock", "--device", device, "--cache", 0.3,
                                 "--max-body", 1, env=environment)
            try:
                client = self.server.client()
                self.sessions = [client.post("/sessions", {"plate": "shot.%04d.exr", "settings": look}).headers["Location"]
                                 for look in LOOKS]
                threads = [threading.Thread(target=self.work, args=(random.Random(seed * 1000 + i), requests // clients))
                           for i in range(clients)]
                begun = time.monotonic()
                for thread in threads:
                    thread.start()
                while any(thread.is_alive() for thread in threads):
                    self.memory.append(self.server.memory_mb())
                    time.sleep(0.2)
                self.seconds = time.monotonic() - begun
                self.metrics = self.server.client().get("/metrics").body.decode()  # the first one has been idle for too long
                if self.server.process.poll() is not None:
                    self.wrong.append("the server ended")
            finally:
                code = self.server.stop()
            if code != 0:
                self.wrong.append(f"the server ended with {code}")
            self.wrong += [line for line in self.server.log if "Sanitizer" in line or "runtime error" in line]

    def fault(self, sentence):
        with self.lock:
            self.wrong.append(sentence)

    def count(self, what):
        with self.lock:
            self.counts[what] += 1

    def work(self, dice, requests):
        client = self.server.client()
        for _ in range(requests):
            try:
                self.one(client, dice)
            except Exception as error:  # noqa: BLE001
                self.fault(f"{type(error).__name__}: {error}")
                if self.server.process.poll() is not None:
                    return

    def one(self, client, dice):
        look, frame, kind = dice.randrange(len(LOOKS)), dice.randrange(FRAMES), dice.random()
        path = f"{self.sessions[look]}/frames/{frame}"
        if kind < 0.08:  # a client that goes away
            connection = UnixConnection(self.server.ready["socket"])
            connection.request("GET", path + f"?seed={dice.randrange(1000)}", headers={"Accept": RAW})
            time.sleep(dice.random() * 0.01)
            connection.close()
            return self.count("cancelled")
        if kind < 0.16:
            method, rest = dice.choice(MALFORMED)
            answer = client.ask(method, self.sessions[look] + rest, None if method == "GET" else bytes(dice.randbytes(20)))
            if not 400 <= answer.status < 500 or not answer.json["sentence"]:
                self.fault(f"{method} {rest}: {answer}")
            return self.count("malformed")
        if kind < 0.24:  # an artist at a slider: newer ones overtake
            answer = client.get(path + f"?viewer={dice.randrange(2)}&seed={dice.randrange(1000)}", Accept=RAW)
            if answer.status not in (200, 409):
                self.fault(f"{path}: {answer}")
            return self.count("overtaken" if answer.status == 409 else "viewed")
        if kind < 0.30:
            answer = client.get(path + "?scale=0.5&region=2,2,20,10&layers=all", Accept=RAW)
            if answer.status != 200 or raw(answer.body)[0]["window"] != (2, 2, 20, 10):
                self.fault(f"{path}: {answer}")
            return self.count("regions")
        if kind < 0.34:
            made = client.post("/sessions", {"plate": "shot.%04d.exr"})
            if made.status == 201:
                client.get(made.headers["Location"] + "/frames/0", Accept="image/png")
                client.ask("DELETE", made.headers["Location"])
            elif made.status != 503:
                self.fault(f"POST /sessions: {made}")
            return self.count("sessions")
        if kind < 0.40:
            answer = client.get(path, Accept=SHARED)
            shared = answer.json
            try:
                with open(shared["path"], "rb") as file:
                    body = file.read()
            except FileNotFoundError:  # newer ones needed its room
                return self.count("shared memory that was gone")
            client.ask("DELETE", shared["release"])
        else:
            answer = client.get(path, Accept=RAW)
            if answer.status != 200:
                return self.fault(f"{path}: {answer}")
            body = answer.body
        _, planes = raw(body)
        for name, wanted in zip("RGB", self.pictures[look, frame]):
            if not np.array_equal(planes[name], wanted):
                return self.fault(f"look {look}, frame {frame}, {name}: differs from virga rain's by "
                                  f"{np.abs(planes[name].astype(float) - wanted).max()}")
        self.count("frames compared")

    def report(self):
        third = max(1, len(self.memory) // 3)
        middle, last = max(self.memory[third:2 * third] or [0]), max(self.memory[2 * third:] or [0])
        rendered = float(self.metrics.split("\nvirga_renders_total ")[1].split("\n")[0])
        return {"requests": dict(self.counts), "seconds": round(self.seconds, 1), "rendered": int(rendered),
                "memory_mb": {"most in the middle third": round(middle, 1), "most in the last third": round(last, 1)},
                "wrong": self.wrong[:20]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--requests", type=int, default=10000)
    parser.add_argument("--clients", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--device", default="auto")
    parser.add_argument("--any-memory", action="store_true", help="memory may grow")
    given = parser.parse_args()
    report = Stress(os.environ["VIRGA"], given.requests, given.clients, given.seed, given.device).report()
    print(json.dumps(report, indent=2))
    grown = report["memory_mb"]["most in the last third"] - report["memory_mb"]["most in the middle third"]
    if grown > 30 and not given.any_memory:
        sys.exit(f"memory grew by {grown:.0f} MB in the last third")
    sys.exit(1 if report["wrong"] else 0)


if __name__ == "__main__":
    main()
