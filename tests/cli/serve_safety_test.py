"""virga serve among clients that are slow, gone, many, hostile or strange, and what is left when it dies."""
import glob
import http.client
import json
import os
import signal
import socket
import stat
import subprocess
import threading
import time
import unittest

from serving import RAW, SHARED, Client, Server, UnixConnection, rawBody, waitFor
from support import VIRGA, CliTest, street, writeImage


def answerTo(connection, text, wait=15):
    """What comes back on a bare connection, until it is closed."""
    connection.settimeout(wait)
    connection.sendall(text if isinstance(text, bytes) else text.encode())
    back = b""
    try:
        while True:
            piece = connection.recv(65536)
            if not piece:
                return back
            back += piece
            head, _, body = back.partition(b"\r\n\r\n")
            if b"Content-Length: " in head:
                if len(body) >= int(head.split(b"Content-Length: ")[1].split(b"\r\n")[0]):
                    return back
    except TimeoutError:
        return back


class SafetyTest(CliTest):
    arguments = ["--listen", 0]

    @classmethod
    def makePlates(cls):
        cls.root = cls.folder / "root"
        cls.root.mkdir()
        for frame in range(3):
            writeImage(cls.root / f"shot.{frame:04d}.exr", street(seed=frame))

    def serve(self, *arguments, **options):
        server = Server(VIRGA, "--root", self.root, "--device", "cpu", "--no-cache", *arguments, cwd=self.folder, **options)
        self.addCleanup(server.stop)
        return server

    def unix(self, *arguments, **options):
        return self.serve("--socket", self.folder / "s.sock", *arguments, **options)

    def bare(self, server):
        made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        made.connect(str(server.ready["socket"]))
        self.addCleanup(made.close)
        return made

    def session(self, client):
        answer = client.post("/sessions", {"plate": "shot.%04d.exr", "settings": {"rate": 60}})
        self.assertEqual(answer.status, 201, answer)
        return answer.headers["Location"]


class WhoMayAsk(SafetyTest):
    def test_the_socket_is_this_users(self):
        server = self.unix()
        self.assertEqual(stat.S_IMODE(os.stat(server.ready["socket"]).st_mode), 0o600)
        self.assertEqual(server.client().get("/healthz").status, 200)
        server.stop()
        self.assertFalse(os.path.exists(server.ready["socket"]))

    def test_two_servers_on_one_socket(self):
        server = self.unix()
        with self.assertRaisesRegex(RuntimeError, "another server listens there"):
            self.unix()
        self.assertEqual(server.client().get("/healthz").status, 200)

    def test_tcp_asks_for_the_token(self):
        server = self.serve("--listen", 0)
        self.assertIsNone(server.ready["socket"])
        self.assertIn("#token=" + server.ready["token"], server.ready["url"])
        self.assertEqual(server.tcp().get("/healthz").status, 200)
        stranger = server.tcp(token=False)
        for path in ("/healthz", "/metrics", "/parameters", "/sessions", "/openapi.json", "//", "/page.js/../sessions"):
            answer = stranger.get(path)
            self.assertEqual((answer.status, answer.json["code"]), (401, "token"), path)
        for path in ("/", "/page.js", "/page.css"):
            self.assertEqual(stranger.get(path).status, 200)
        wrong = Client(stranger.connect, "0" * 32)
        self.assertEqual(wrong.get("/sessions").status, 401)

    def test_no_page_of_another_site_drives_it(self):
        server = self.serve("--listen", 0)
        port = server.ready["port"]
        client = server.tcp()
        self.assertEqual(client.get("/healthz", Host=f"rebound.example:{port}").json["code"], "host")
        self.assertEqual(client.get("/healthz", Origin="http://evil.example").json["code"], "origin")
        self.assertEqual(client.get("/healthz", Origin=f"http://127.0.0.1:{port}").status, 200)

    def test_beyond_loopback_only_if_it_is_meant(self):
        self.refused(2, ["--public", "0.0.0.0"], "serve", "--root", "root", "--listen", "0.0.0.0:0")
        server = self.serve("--listen", "0.0.0.0:0", "--public")
        self.assertEqual(server.tcp(token=False).get("/sessions").status, 401)
        self.assertEqual(server.tcp().get("/sessions").status, 200)

    def test_a_token_of_ones_own(self):
        path = self.folder / "token"
        server = self.serve("--listen", 0, "--token-file", path)
        self.assertEqual(stat.S_IMODE(os.stat(path).st_mode), 0o600)
        self.assertEqual(path.read_text().strip(), server.ready["token"])
        server.stop()
        path.write_text("mine\n")
        self.assertEqual(self.serve("--listen", 0, "--token-file", path).ready["token"], "mine")

    def test_what_it_will_not_begin_with(self):
        (self.folder / "plain").write_text("x")
        for code, words, arguments in (
                (2, "no folder", ["--root", "nowhere", "--socket", "a.sock"]),
                (5, "no socket", ["--socket", "plain"]),
                (5, "at most 107", ["--socket", "x" * 200]),
                (5, "cannot be made", ["--socket", "nowhere/s.sock"]),
                (2, "127.0.0.1:8717", ["--listen", "localhost:1"]),
                (2, "127.0.0.1:8717", ["--listen", "99999"]),
                (2, "go with --listen", ["--public", "--socket", "b.sock"]),
                (2, "must be 1 to 1000", ["--sessions", "0", "--socket", "b.sock"]),
                (2, "--plate", ["--settings", "plain", "--socket", "b.sock"]),
                (3, "no such file", ["--plate", "none.mp4", "--root", "root", "--socket", "c.sock"])):
            run = self.virga("serve", *arguments)
            self.assertEqual(run.code, code, run)
            self.assertIn(words, run.err, run)


class Crowds(SafetyTest):
    def test_a_thousand_idle_connections_starve_nobody(self):
        server = self.unix()
        path = server.ready["socket"]
        idle = [self.bare(server) for _ in range(1000)]
        for connection in idle[::2]:
            connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: lo")  # half of them have begun to speak
        client = server.client()
        begun = time.monotonic()
        session = self.session(client)
        self.assertEqual(client.get(f"{session}/frames/0", Accept=RAW).status, 200)
        self.assertLess(time.monotonic() - begun, 30)
        values = client.get("/metrics").body.decode()
        self.assertGreater(float(values.split("\nvirga_connections ")[1].split("\n")[0]), 1000)
        threads = len(os.listdir(f"/proc/{server.process.pid}/task"))
        self.assertLess(threads, 200)
        idle[0].sendall(b"calhost\r\n\r\n")
        self.assertIn(b"200 OK", idle[0].recv(4096))

    def test_a_half_request_is_told_and_dropped(self):
        server = self.unix()
        back = answerTo(self.bare(server), "GET / HTTP/1.1\r\nHost: x", 20)
        self.assertIn(b"408", back)
        self.assertIn(b"head-late", back)

    def test_a_body_that_does_not_come(self):
        server = self.unix()
        connection = self.bare(server)
        begun = time.monotonic()
        answerTo(connection, "POST /sessions HTTP/1.1\r\nHost: x\r\nContent-Length: 100\r\n\r\n{", 25)
        self.assertLess(time.monotonic() - begun, 24)
        self.assertEqual(server.client().get("/healthz").status, 200)

    def test_a_huge_body_is_refused_before_it_is_read(self):
        server = self.unix()
        before = server.memory_mb()
        connection = self.bare(server)
        connection.sendall(b"PUT /sessions/x/plates/0 HTTP/1.1\r\nHost: x\r\nContent-Length: 1073741824\r\n\r\n")
        self.assertIn(b" 413 ", answerTo(connection, b"x" * 65536))
        self.assertLess(server.memory_mb(), before + 20)

    def test_strange_bytes(self):
        server = self.unix()
        for text in (b"\0" * 100 + b"\r\n\r\n", b"\xff\xfe\r\n\r\n", b"GET / HTTP/1.1\r\n\0: x\r\n\r\n", b"\r\n\r\n", b"x" * 20000,
                     b"GET /%00 HTTP/1.1\r\nHost: x\r\n\r\n", b"GET /" + b"a/" * 2000 + b" HTTP/1.1\r\nHost: x\r\n\r\n",
                     b"GET /?" + b"a&" * 1000 + b" HTTP/1.1\r\nHost: x\r\n\r\n",
                     b"GET / HTTP/1.1\r\nHost: x\r\nRange: bytes=0-1,2-3,zz\r\n\r\n",
                     b"POST /sessions HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\nContent-Length: 1\r\n\r\n{"):
            back = answerTo(self.bare(server), text)
            self.assertRegex(back[:20], rb"^HTTP/1.1 (4\d\d|200|100)", (text[:60], back[:200]))
        self.assertEqual(server.client().get("/healthz").status, 200)

    def test_requests_one_behind_the_other_on_one_connection(self):
        server = self.unix()
        connection = self.bare(server)
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: x\r\n\r\n" * 3)
        back, end = b"", time.monotonic() + 10
        connection.settimeout(1)
        while back.count(b"200 OK") < 3 and time.monotonic() < end:
            try:
                back += connection.recv(65536)
            except TimeoutError:
                pass
        self.assertEqual(back.count(b"200 OK"), 3)

    def test_limits(self):
        server = self.unix("--sessions", 2, "--megapixels", 0.01, "--max-body", 0.01)
        client = server.client()
        first = self.session(client)
        self.session(client)
        answer = client.post("/sessions", {"plate": "shot.%04d.exr"})
        self.assertEqual((answer.status, answer.json["code"]), (503, "too-many-sessions"))
        self.assertEqual(client.ask("DELETE", first).status, 204)
        big = client.post("/sessions", {"plate": {"width": 200, "height": 100}})
        self.assertEqual((big.status, big.json["code"]), (413, "too-many-pixels"))

    def test_idle_sessions_are_closed(self):
        server = self.unix("--idle", 1)
        client = server.client()
        session = self.session(client)
        self.assertTrue(waitFor(lambda: client.get("/sessions").json == [], 15))
        self.assertEqual(client.get(session).status, 404)


class Overtaking(SafetyTest):
    def test_a_newer_request_of_the_viewer_overtakes_and_a_gone_client_cancels(self):
        for frame in range(3):
            writeImage(self.root / f"big.{frame:04d}.exr", street(1280, 720, seed=frame))
        server = self.unix("--prefetch", 0)
        client = server.client()
        session = client.post("/sessions", {"plate": "big.%04d.exr", "settings": {"rate": 100, "thin": 0}}).headers["Location"]
        statuses = []

        def ask(query):
            statuses.append(server.client().get(f"{session}/frames/0?{query}", Accept=RAW).status)

        threads = []
        for seed in range(6):
            threads.append(threading.Thread(target=ask, args=(f"viewer=a&seed={seed}",)))
            threads[-1].start()
            time.sleep(0.05)
        for thread in threads:
            thread.join()
        self.assertEqual(statuses.count(200) + statuses.count(409), 6, statuses)
        self.assertGreaterEqual(statuses.count(409), 1, statuses)
        self.assertGreaterEqual(statuses.count(200), 1, statuses)
        # The client's process goes away in the middle of a frame.
        gone = [self.bare(server) for _ in range(4)]
        for seed, connection in enumerate(gone):
            connection.sendall(f"GET {session}/frames/1?seed={100 + seed} HTTP/1.1\r\nHost: x\r\nAccept: {RAW}\r\n\r\n".encode())
        time.sleep(0.1)
        for connection in gone:
            connection.close()
        counted = lambda: float(client.get("/metrics").body.decode().split("\nvirga_clients_gone_total ")[1].split("\n")[0])
        self.assertTrue(waitFor(lambda: counted() >= 1, 60))
        self.assertEqual(client.get(f"{session}/frames/2", Accept=RAW).status, 200)

    def test_neighbours_are_rendered_ahead(self):
        server = self.unix()
        client = server.client()
        session = self.session(client)
        self.assertEqual(client.get(f"{session}/frames/1?viewer=a", Accept=RAW).headers["Virga-Cache"], "miss")
        counted = lambda: float(client.get("/metrics").body.decode().split("\nvirga_prefetched_total ")[1].split("\n")[0])
        self.assertTrue(waitFor(lambda: counted() == 2), client.get("/metrics"))
        for frame in (0, 2):
            self.assertEqual(client.get(f"{session}/frames/{frame}", Accept=RAW).headers["Virga-Cache"], "picture")


class Endings(SafetyTest):
    def test_sigterm_finishes_what_runs(self):
        server = self.unix()
        client = server.client()
        session = self.session(client)
        got = []
        asking = threading.Thread(target=lambda: got.append(client.get(f"{session}/frames/0?seed=77", Accept=RAW)))
        asking.start()
        time.sleep(0.05)
        self.assertEqual(server.stop(), 0)
        asking.join()
        self.assertEqual(got[0].status, 200)

    def test_a_killed_server_hinders_nobody(self):
        server = self.unix()
        client = server.client()
        session = self.session(client)
        shared = client.get(f"{session}/frames/0", Accept=SHARED).json
        posted = client.post("/sessions", {"plate": {"width": 8, "height": 4}}).headers["Location"]
        self.assertEqual(client.ask("PUT", f"{posted}/plates/0", rawBody(street(8, 4)), Content_Type=RAW).status, 204)
        pid = server.process.pid
        self.assertTrue(glob.glob(f"/dev/shm/virga-{pid}-*"))
        server.stop(signal.SIGKILL)
        self.assertTrue(os.path.exists(server.ready["socket"]))
        self.assertTrue(os.path.exists(shared["path"]))
        again = self.unix()
        self.assertEqual(again.client().get("/healthz").status, 200)
        self.assertEqual(glob.glob(f"/dev/shm/virga-{pid}-*"), [])
        self.assertEqual(self.leftovers(), [])

    def test_nothing_is_left(self):
        server = self.unix()
        client = server.client()
        client.get(f"{self.session(client)}/frames/0", Accept=SHARED)
        pid = server.process.pid
        self.assertEqual(server.stop(), 0)
        self.assertEqual(glob.glob(f"/dev/shm/virga-{pid}-*"), [])

    def test_without_a_gpu_the_processor_renders_and_it_is_said(self):
        server = Server(VIRGA, "--root", self.root, "--socket", self.folder / "g.sock", "--device", "7", "--no-cache")
        self.addCleanup(server.stop)
        client = server.client()
        session = self.session(client)
        self.assertEqual(client.get(f"{session}/frames/0", Accept=RAW).status, 200)
        health = client.get("/healthz").json
        self.assertIn("processor", health["device"])
        self.assertIn("7", health["fallback"])
        server.stop()
        self.assertIn("the processor renders from now on", "".join(server.log))

    def test_logs_for_machines(self):
        server = self.unix("--log-json", "--verbose")
        server.client().get("/healthz?x=\"")
        server.stop()
        lines = [json.loads(line) for line in server.log]
        asked = [line for line in lines if line.get("path") == "/healthz"]
        self.assertEqual((asked[0]["status"], asked[0]["level"]), ("200", "debug"))
        self.assertGreaterEqual(float(asked[0]["ms"]), 0)

    def test_the_description_is_the_servers(self):
        """Each path of docs/openapi.json is there with each of its methods, and no other method is."""
        server = self.unix()
        client = server.client()
        described = client.get("/openapi.json").json
        session = self.session(client)
        for path, item in described["paths"].items():
            real = path.replace("/sessions/{id}", session).replace("{n}", "0").replace("{name}", "none")
            methods = {m.upper() for m in item if m in ("get", "put", "post", "patch", "delete")}
            for method in ("PUT", "POST", "PATCH", "GET"):
                answer = client.ask(method, real, None if method == "GET" else "x")
                known = answer.json["code"] != "method" if answer.status >= 400 else True
                self.assertEqual(known, method in methods, (method, path, answer))
                if answer.status >= 400 and known:
                    codes = item[method.lower()]["responses"]
                    self.assertIn(str(answer.status), codes, (method, path, answer))
                if method == "GET" and method in methods:
                    self.assertEqual(answer.status, 200, (path, answer))
                    types = item["get"]["responses"]["200"]["content"]
                    self.assertIn(answer.headers["Content-Type"].split(";")[0], types)
                    schema = types.get("application/json", {}).get("schema")
                    if schema:
                        self.checkSchema(described, schema, answer.json, path)
        for name in described["paths"]["/sessions/{id}/frames/{n}"]["get"]["parameters"]:
            if name["in"] == "query":
                value = {"region": "0,0,8,8", "scale": "0.5", "layers": "beauty", "view": "", "seed": "2", "time": "0", "later": "0.5",
                         "data_window": "0,0,9,9", "colorspace": "sRGB", "samples": "float", "quality": "90", "viewer": "v",
                         "priority": "1", "set.NAME": "1"}[name["name"]]
                answer = client.get(f"{session}/frames/0?{name['name'].replace('NAME', 'gust')}={value}")
                self.assertEqual(answer.status, 200, (name["name"], answer))

    def checkSchema(self, described, schema, value, where):
        if "$ref" in schema:
            target = described
            for part in schema["$ref"][2:].split("/"):
                target = target[part]
            return self.checkSchema(described, target, value, where)
        if value is None:
            return self.assertTrue(schema.get("nullable") or not schema, where)
        kinds = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float), "boolean": bool}
        if "type" in schema:
            self.assertIsInstance(value, kinds[schema["type"]], where)
        if "enum" in schema:
            self.assertIn(value, schema["enum"], where)
        for name in schema.get("required", []):
            self.assertIn(name, value, where)
        if "properties" in schema:
            self.assertLessEqual(set(value), set(schema["properties"]), where)
            for name, inner in schema["properties"].items():
                if name in value:
                    self.checkSchema(described, inner, value[name], f"{where}.{name}")
        if isinstance(value, list):
            for item in value:
                self.checkSchema(described, schema.get("items", {}), item, where)


if __name__ == "__main__":
    unittest.main()
