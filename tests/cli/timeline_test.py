"""virga rain --timeline: one lane a thread, one event a stage a frame, events beside or inside one another."""
import json
import unittest
from collections import Counter, defaultdict

import support

STAGES = {"wait for plate", "render", "cells", "inputs", "environment", "draw", "hand over"}


class Timeline(support.CliTest):
    @classmethod
    def makePlates(cls):
        support.makeMovie(cls.folder / "plate.mp4", sound=False, seconds=0.24)
        support.writeImage(cls.folder / "still.exr", support.street())

    def events(self, *flags, out="rain.mkv", plate="plate.mp4"):
        self.rain(plate, "-o", out, "--strokes", "200", "--fov", "60", "--timeline", "t.json", *flags)
        with open(self.path("t.json"), encoding="utf-8") as file:
            events = json.load(file)["traceEvents"]
        names = {e["tid"]: e["args"]["name"] for e in events if e["ph"] == "M"}
        lanes = defaultdict(list)
        for e in events:
            if e["ph"] == "X":
                lanes[names[e["tid"]]].append(e)
        self.assertEqual(len(names), len(set(names.values())))
        for lane, ofLane in lanes.items():
            self.nest(lane, ofLane)
        return lanes

    def nest(self, lane, events):
        """Each event ends before the ones around it do."""
        around = []
        for e in events:
            start, end = e["ts"], e["ts"] + e["dur"]
            self.assertGreaterEqual(start, 0)
            while around and around[-1] <= start + 0.2:  # a tenth of a microsecond is what is written
                around.pop()
            if around:
                self.assertLessEqual(end, around[-1] + 0.2, f"{lane}: {e}")
            around.append(end)

    def once(self, events, stages, frames=6):
        counts = Counter((e["name"], e["args"]["frame"]) for e in events if e["name"] in stages)
        self.assertEqual(counts, Counter({(stage, frame): 1 for stage in stages for frame in range(frames)}))

    def testOneEventAStageAFrame(self):
        lanes = self.events("--device", "cpu", "--codec", "libx264")
        self.assertEqual(set(lanes), {"reader", "renderer", "passes", "encoder"})
        self.once(lanes["reader"], {"read", "decode"})
        self.once(lanes["renderer"], STAGES)
        self.once(lanes["passes"], {"light", "drops", "strokes", "composite", "conversion"})
        self.once(lanes["encoder"], {"encode"})
        self.assertEqual([e["name"] for e in lanes["renderer"] if e["name"] == "start"], ["start"])

    def testWholePicturesAreConvertedOnTheirOwn(self):
        lanes = self.events("--device", "cpu", "--codec", "libx264", "--preview", "sheet.png")
        self.once(lanes["reader"], {"read", "decode", "convert"})
        self.once(lanes["encoder"], {"encode", "convert"})

    def testADeviceWorksOnSeveralFrames(self):
        lanes = self.events("--device", "0", "--codec", "libx264")
        self.once(lanes["renderer"], STAGES | {"wait for device"})
        self.once(lanes["passes"], {"upload", "to light", "light", "drops", "strokes", "composite", "to codes",
                                    "read-back"})
        render = {e["args"]["frame"]: e["ts"] for e in lanes["renderer"] if e["name"] == "render"}
        wait = {e["args"]["frame"]: e["ts"] for e in lanes["renderer"] if e["name"] == "wait for device"}
        for frame in range(4):  # two more are handed over before the first is asked for
            self.assertLess(render[frame + 2], wait[frame])

    def testImagesAndCopies(self):
        lanes = self.events("--device", "cpu", plate="still.exr", out="out.exr")
        self.assertEqual(Counter(e["name"] for e in lanes["writer"]), {"write": 1})
        self.rain("plate.mp4", "-o", "copy.mp4", *support.OFF, "--timeline", "c.json")
        with open(self.path("c.json"), encoding="utf-8") as file:
            self.assertEqual([e for e in json.load(file)["traceEvents"] if e["ph"] == "X"], [])

    def testRefusals(self):
        self.refused(5, ["nowhere"], "rain", "plate.mp4", "-o", "o.mkv", "--timeline", "nowhere/t.json")
        self.refused(5, ["--timeline 'plate.mp4'", "plate itself"], "rain", "plate.mp4", "-o", "o.mkv", "--timeline",
                     "plate.mp4")
        self.refused(5, ["--timeline 'o.mkv'", "another output"], "rain", "plate.mp4", "-o", "o.mkv", "--timeline",
                     "o.mkv")


if __name__ == "__main__":
    unittest.main()
