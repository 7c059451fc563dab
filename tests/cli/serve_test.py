"""virga serve as its clients meet it: sessions, frames equal to virga rain's, errors with a sentence each."""
import json
import os
import shutil
import subprocess
import unittest

import numpy as np

from serving import RAW, SHARED, Server, raw, rawBody, waitFor
from support import VIRGA, CliTest, bits, makeMovie, readImage, street, writeImage

SETTINGS = {"rate": 60, "seed": 3, "near": 0.5, "darken": 0.2}
FLAGS = ["--rate", 60, "--seed", 3, "--near", 0.5, "--darken", 0.2]


class ServeTest(CliTest):
    """A server on a Unix socket for the class."""

    @classmethod
    def makePlates(cls):
        root = cls.root = cls.folder / "root"
        root.mkdir()
        for frame in range(4):
            writeImage(root / f"shot.{frame:04d}.exr", street(seed=frame))
        makeMovie(root / "street.mp4", seconds=0.4)
        writeImage(cls.folder / "secret.exr", street())
        (root / "way_out.exr").symlink_to(cls.folder / "secret.exr")
        (root / "odd.0000.exr").symlink_to(root / "shot.0000.exr")
        (root / "odd.0001.exr").symlink_to(cls.folder / "secret.exr")
        (root / "look.toml").write_text("[rain]\nrate = 60\nseed = 3\nnear = 0.5\n[grade]\ndarken = 0.2\n")
        cls.server = Server(VIRGA, "--root", root, "--socket", cls.folder / "s.sock", "--device", "cpu", "--no-cache",
                            "--max-body", 4, cwd=cls.folder)
        cls.client = cls.server.client()

    @classmethod
    def tearDownClass(cls):
        cls.client.close()
        code = cls.server.stop()
        super().tearDownClass()
        assert code == 0, "".join(cls.server.log)

    def session(self, plate="shot.%04d.exr", **settings):
        answer = self.client.post("/sessions", {"plate": plate, "settings": settings or SETTINGS})
        self.assertEqual(answer.status, 201, answer)
        path = answer.headers["Location"]
        self.addCleanup(lambda: self.client.ask("DELETE", path))
        return path

    def refuses(self, status, code, words, method, path, body=None, **headers):
        answer = self.client.ask(method, path, body, **headers)
        self.assertEqual(answer.status, status, answer)
        self.assertEqual(answer.json["code"], code, answer)
        for word in [words] if isinstance(words, str) else words:
            self.assertIn(word, answer.json["sentence"])
        if body is None or str(self.folder) not in str(body):  # where the root lies is nobody's business
            self.assertNotIn(str(self.folder), answer.json["sentence"])
        return answer

    def fetch(self, path, kind, **headers):
        answer = self.client.get(path, Accept=kind, **headers)
        self.assertEqual(answer.status, 200, answer)
        return answer

    def saved(self, answer, name):
        path = self.folder / name
        path.write_bytes(answer.body)
        return path


class FramesAreTheCommandLines(ServeTest):
    @classmethod
    def makePlates(cls):
        super().makePlates()
        for plate, out in (("shot.%04d.exr", "rain"), ("street.mp4", "wet")):
            for ending in ("exr", "png", "jpg"):
                subprocess.run([VIRGA, "rain", cls.root / plate, "-o", cls.folder / f"{out}.%04d.{ending}", "--quiet",
                                "--layers" if ending == "exr" else "--quiet", "--device", "cpu", *map(str, FLAGS)],
                               check=True)

    def test_exr_with_layers(self):
        for plate, out, frame in (("shot.%04d.exr", "rain", 2), ("street.mp4", "wet", 7)):
            path = self.session(plate)
            got = self.saved(self.fetch(f"{path}/frames/{frame}?layers=all", "image/x-exr"), "got.exr")
            kind, names, words = bits(self.folder / f"{out}.{frame:04d}.exr")
            gotKind, gotNames, gotWords = bits(got)
            self.assertEqual((kind, names), (gotKind, gotNames))
            np.testing.assert_array_equal(words, gotWords)

    def test_png_and_jpeg_in_any_order(self):
        path = self.session("street.mp4")
        for frame in (9, 0, 5, 4, 9, 1):
            for ending, kind in (("png", "image/png"), ("jpg", "image/jpeg")):
                got = self.saved(self.fetch(f"{path}/frames/{frame}", kind), f"got.{ending}")
                np.testing.assert_array_equal(readImage(got)[0], readImage(self.folder / f"wet.{frame:04d}.{ending}")[0])

    def test_raw_and_shared_memory(self):
        path = self.session()
        pixels, _ = readImage(self.folder / "rain.0001.exr", "half")
        header, planes = raw(self.fetch(f"{path}/frames/1", RAW).body)
        self.assertEqual(header, {"window": (0, 0, 96, 54), "size": (96, 54), "frame": 1})
        self.assertEqual(list(planes), ["R", "G", "B", "A"])
        for c, name in enumerate("RGB"):
            np.testing.assert_array_equal(planes[name], np.asarray(pixels[..., c]))
        shared = self.fetch(f"{path}/frames/1", SHARED).json
        with open(shared["path"], "rb") as file:
            again = raw(file.read())
        np.testing.assert_array_equal(again[1]["G"], planes["G"])
        self.assertEqual(self.client.ask("DELETE", shared["release"]).status, 204)
        self.assertFalse(os.path.exists(shared["path"]))
        _, floats = raw(self.fetch(f"{path}/frames/1?samples=float&layers=beauty,rain,rain.Z", RAW).body)
        self.assertEqual(list(floats), ["R", "G", "B", "A", "rain.R", "rain.G", "rain.B", "rain.A", "rain.Z"])
        self.assertEqual(floats["R"].dtype, np.float32)

    def test_a_changed_slider_is_another_command_line(self):
        path = self.session()
        self.fetch(f"{path}/frames/0", "image/x-exr")
        self.assertEqual(self.client.patch(path, {"wind": [3, 1], "rate": "80"}).status, 200)
        got = self.saved(self.fetch(f"{path}/frames/0", "image/x-exr"), "got.exr")
        self.rain("root/shot.%04d.exr", "-o", "other.%04d.exr", "--frames", "0", "--device", "cpu", *FLAGS[2:], "--rate", "80",
                  "--wind", "3,1")
        np.testing.assert_array_equal(bits(got)[2], bits(self.folder / "other.0000.exr")[2])

    def test_values_for_one_frame_alone(self):
        path = self.session()
        plain = self.fetch(f"{path}/frames/0", RAW).body
        other = self.fetch(f"{path}/frames/0?seed=9&set.wind=2,0", RAW).body
        self.assertNotEqual(plain, other)
        self.assertEqual(plain, self.fetch(f"{path}/frames/0", RAW).body)
        self.assertEqual(self.client.get(path).json["settings"]["seed"], 3)

    def test_a_layer_as_a_picture(self):
        path = self.session()
        pixels, names = readImage(self.saved(self.fetch(f"{path}/frames/0?layers=rain", "image/png"), "layer.png"))
        self.assertEqual(len(names), 4)
        self.assertGreater(pixels[..., 3].max(), 0.1)
        self.assertEqual(pixels[..., 3].min(), 0)

    def test_plates_as_they_are(self):
        path = self.session()
        _, planes = raw(self.fetch(f"{path}/plates/2", RAW).body)
        np.testing.assert_array_equal(planes["R"], readImage(self.root / "shot.0002.exr", "half")[0][..., 0])

    def test_time_chooses_the_plates_frame(self):
        path = self.session("street.mp4", rate=0, fog=0, darken=0, desaturate=0)
        later = raw(self.fetch(f"{path}/frames/0?time=0.2", RAW).body)[1]
        np.testing.assert_array_equal(later["R"], raw(self.fetch(f"{path}/frames/5", RAW).body)[1]["R"])

    def test_data_window(self):
        path = self.session("shot.%04d.exr", rate=0, fog=0, darken=0.5, desaturate=0)
        _, planes = raw(self.fetch(f"{path}/frames/0?data_window=10,5,20,30", RAW).body)
        self.assertGreater(planes["G"][5:35, 10:30].min(), 0)
        self.assertEqual(planes["G"][:5].max(), 0)
        self.assertEqual(planes["A"][:, 30:].max(), 0)

    def test_a_region_is_the_crop_of_the_whole(self):
        path = self.session(**SETTINGS, blur=1)
        _, whole = raw(self.fetch(f"{path}/frames/0?samples=float&layers=beauty,rain", RAW).body)
        for x, y, width, height in ((10, 5, 40, 30), (0, 0, 1, 1), (60, 40, 36, 14)):
            answer = self.fetch(f"{path}/frames/0?samples=float&layers=beauty,rain&region={x},{y},{width},{height}", RAW)
            self.assertEqual(answer.headers["Virga-Data-Window"], f"{x},{y},{width},{height}")
            header, planes = raw(answer.body)
            self.assertEqual((header["window"], header["size"]), ((x, y, width, height), (96, 54)))
            for name, plane in planes.items():
                np.testing.assert_allclose(plane, whole[name][y:y + height, x:x + width], atol=2e-4, err_msg=name)
        part = self.saved(self.fetch(f"{path}/frames/0?region=10,5,40,30", "image/x-exr"), "part.exr")
        np.testing.assert_allclose(readImage(part)[0][..., 1], whole["G"][5:35, 10:50], rtol=2e-3, atol=1e-3)
        header, planes = raw(self.fetch(f"{path}/frames/0?region=-4,-2,20,10", RAW).body)  # beyond the frame
        self.assertEqual(header["window"], (-4, -2, 20, 10))

    def test_a_proxy_is_the_picture_reduced(self):
        path = self.session()
        _, whole = raw(self.fetch(f"{path}/frames/0?samples=float", RAW).body)
        header, half = raw(self.fetch(f"{path}/frames/0?samples=float&scale=0.5", RAW).body)
        self.assertEqual(header["size"], (48, 27))
        reduced = whole["G"].reshape(27, 2, 48, 2).mean((1, 3))
        self.assertLess(np.sqrt(np.mean((half["G"] - reduced) ** 2)), 0.05 * reduced.mean())
        self.assertEqual(raw(self.fetch(f"{path}/frames/0?scale=0.25&region=0,0,8,8", RAW).body)[0]["size"], (24, 14))
        self.assertEqual(readImage(self.saved(self.fetch(f"{path}/frames/0?scale=0.5", "image/png"), "half.png"))[0].shape[:2],
                         (27, 48))

    def test_posted_plates(self):
        plate = street(seed=5)
        made = self.client.post("/sessions", {"plate": {"width": 96, "height": 54}, "settings": SETTINGS})
        self.assertEqual(made.status, 201, made)
        path = made.headers["Location"]
        self.refuses(404, "no-plate", "posted", "GET", f"{path}/frames/0")
        for frame in (0, 1):
            put = self.client.ask("PUT", f"{path}/plates/{frame}", rawBody(plate, frame), Content_Type=RAW)
            self.assertEqual(put.status, 204, put)
        got = self.saved(self.fetch(f"{path}/frames/1", "image/x-exr"), "got.exr")
        for frame in (0, 1):
            writeImage(self.folder / f"same.{frame:04d}.exr", plate)
        self.rain("same.%04d.exr", "-o", "sameout.%04d.exr", "--frames", 1, "--device", "cpu", "--env-frames", 0, *FLAGS)
        np.testing.assert_array_equal(readImage(got)[0][..., :3], readImage(self.folder / "sameout.0001.exr")[0][..., :3])
        self.refuses(422, "input", ["10x8", "96x54"], "PUT", f"{path}/plates/2", rawBody(street(10, 8)), Content_Type=RAW)
        self.refuses(415, "content-type", "png", "PUT", f"{path}/plates/2", b"x", Content_Type="image/png")
        self.refuses(400, "bad-raw", "VIRGARAW", "PUT", f"{path}/plates/2", b"x", Content_Type=RAW)
        self.client.ask("DELETE", path)


class Answers(ServeTest):
    def test_unchanged_frames_cost_nothing(self):
        path = self.session()
        first = self.fetch(f"{path}/frames/0", "image/png")
        again = self.client.get(f"{path}/frames/0", Accept="image/png", If_None_Match=first.headers["ETag"])
        self.assertEqual((again.status, again.body), (304, b""))
        self.assertEqual(self.fetch(f"{path}/frames/0", "image/png").headers["Virga-Cache"], "body")
        self.assertEqual(self.fetch(f"{path}/frames/0", "image/jpeg").headers["Virga-Cache"], "picture")
        tags = {first.headers["ETag"], self.fetch(f"{path}/frames/1", "image/png").headers["ETag"],
                self.fetch(f"{path}/frames/0", "image/jpeg").headers["ETag"],
                self.fetch(f"{path}/frames/0?seed=4", "image/png").headers["ETag"]}
        self.assertEqual(len(tags), 4)
        shutil.copy(self.root / "shot.0003.exr", self.root / "new.exr")
        os.replace(self.root / "new.exr", self.root / "shot.0000.exr")
        now = self.client.get(f"{path}/frames/0", Accept="image/png", If_None_Match=first.headers["ETag"])
        self.assertEqual(now.status, 200)
        self.assertNotEqual(now.body, first.body)

    def test_sessions(self):
        path = self.session("street.mp4")
        self.assertIn({"id": path.split("/")[-1], "plate": "street.mp4"}, self.client.get("/sessions").json)
        shot = self.client.get(path).json
        self.assertEqual((shot["plate"]["width"], shot["plate"]["first"], shot["plate"]["last"]), (96, 0, 9))
        self.assertEqual(shot["settings"]["rate"], 60)
        toml = self.client.get(f"{path}/settings.toml").body.decode()
        made = self.client.ask("POST", "/sessions?plate=street.mp4", toml, Content_Type="application/toml")
        self.assertEqual(made.json["settings"], shot["settings"])
        self.assertEqual(self.client.ask("DELETE", made.headers["Location"]).status, 204)
        self.refuses(404, "no-session", "there is no session", "GET", made.headers["Location"])

    def test_nothing_of_a_change_that_is_refused(self):
        path = self.session()
        self.refuses(400, "invalid-argument", ["rate", "0 to 2000"], "PATCH", path, json.dumps({"seed": 5, "rate": -1}))
        self.assertEqual(self.client.get(path).json["settings"]["seed"], 3)

    def test_refusals(self):
        path = self.session()
        frame = f"{path}/frames/0"
        for status, code, words, url in (
                (400, "invalid-argument", ["region", "x,y,width,height"], frame + "?region=1,2"),
                (400, "invalid-argument", ["scale '2'", "0.015625 to 1"], frame + "?scale=2"),
                (400, "invalid-argument", ["did you mean 'region'"], frame + "?regoin=1"),
                (400, "invalid-argument", ["layers 'mist'", "splash"], frame + "?layers=mist"),
                (400, "invalid-argument", ["did you mean 'wind'"], frame + "?set.wnd=1"),
                (400, "invalid-argument", ["frame 'x'"], f"{path}/frames/x"),
                (400, "invalid-argument", ["frame 9", "0-3"], f"{path}/frames/9"),
                (400, "invalid-argument", ["colour space", "nope"], frame + "?colorspace=nope"),
                (400, "bad-request", "escape", frame + "?layers=%zz"),
                (404, "not-found", "nothing at", "/frames/0"),
                (404, "no-session", "no session", "/sessions/abc/frames/0")):
            self.refuses(status, code, words, "GET", url)
        self.refuses(406, "not-acceptable", "image/x-exr", "GET", frame, Accept="text/html")
        self.refuses(405, "method", "GET", "POST", frame, "")
        self.refuses(405, "method", "no method", "BREW", "/")
        self.refuses(400, "bad-json", "no JSON", "POST", "/sessions", "{")
        self.refuses(400, "bad-json", "nested", "POST", "/sessions", "[" * 100000)
        self.refuses(422, "input", "line 1", "POST", "/sessions?plate=street.mp4", "rate = ", Content_Type="application/toml")
        self.refuses(415, "content-type", "text/plain", "POST", "/sessions", "x", Content_Type="text/plain")
        self.refuses(415, "content-encoding", "gzip", "POST", "/sessions", "x", Content_Encoding="gzip")
        self.refuses(411, "length-required", "Content-Length", "POST", "/sessions", iter([b"{}"]), Transfer_Encoding="chunked")
        self.refuses(414, "target-too-long", "4096", "GET", "/" + "x" * 5000)
        self.refuses(413, "body-too-large", "4194304", "POST", "/sessions", b"", Content_Length=str(1 << 30))

    def test_no_path_leaves_the_root(self):
        for plate in ("../secret.exr", str(self.folder / "secret.exr"), "way_out.exr", "odd.%04d.exr", "/etc/passwd", "..",
                      "a/../../secret.exr", "../nothing.%04d.exr"):
            self.refuses(403, "outside-root", "leaves the folder", "POST", "/sessions", json.dumps({"plate": plate}))
        self.refuses(404, "not-found", "nothing.exr", "POST", "/sessions", json.dumps({"plate": "nothing.exr"}))
        path = self.session()
        for name in ("depth", "env", "camera", "mattes", "lights", "grade-from", "ocio"):
            for file in ("../secret.exr", "way_out.exr", "/etc/passwd"):
                self.refuses(403, "outside-root", name, "PATCH", path, json.dumps({name: file}))
                self.refuses(403, "outside-root", name, "GET", f"{path}/frames/0?set.{name}={file}")

    def test_a_plate_that_goes(self):
        shutil.copy(self.root / "street.mp4", self.root / "going.mp4")
        shutil.copy(self.root / "shot.0000.exr", self.root / "left.0000.exr")
        movie, images = self.session("going.mp4"), self.session("left.%04d.exr")
        self.fetch(f"{movie}/frames/0", RAW), self.fetch(f"{images}/frames/0", RAW)
        (self.root / "going.mp4").unlink(), (self.root / "left.0000.exr").unlink()
        self.assertIn(self.client.get(f"{movie}/frames/1").status, (404, 422))
        self.refuses(404, "not-found", "left.%04d.exr", "GET", f"{images}/frames/0")

    def test_what_programs_watch(self):
        health = self.client.get("/healthz").json
        self.assertEqual(health["status"], "ok")
        waitFor(lambda: self.client.get("/healthz").json["device"])
        self.assertIn("processor", self.client.get("/healthz").json["device"])
        path = self.session()
        self.fetch(f"{path}/frames/2", RAW), self.fetch(f"{path}/frames/2", RAW)
        text = self.client.get("/metrics").body.decode()
        values = dict(line.rsplit(" ", 1) for line in text.splitlines() if not line.startswith("#"))
        self.assertGreaterEqual(float(values['virga_requests_total{route="frame",status="200"}']), 2)
        self.assertGreaterEqual(float(values['virga_cache_total{result="body"}']), 1)
        self.assertGreater(float(values["virga_render_seconds_total"]), 0)
        self.assertGreater(float(values['virga_pass_seconds_total{pass="composite"}']), 0)


if __name__ == "__main__":
    unittest.main()
