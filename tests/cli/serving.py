"""virga serve in the background, and a client of it, for the tests and benchmarks of the frame server."""
import http.client
import json
import os
import signal
import socket
import struct
import subprocess
import threading
import time

import numpy as np

RAW, SHARED = "application/x-virga-raw", "application/x-virga-shm"


class UnixConnection(http.client.HTTPConnection):
    def __init__(self, path, timeout=120):
        super().__init__("localhost", timeout=timeout)
        self.path = path

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(self.timeout)
        self.sock.connect(str(self.path))


class Answer:
    def __init__(self, answer):
        self.status, self.body, self.headers = answer.status, answer.read(), answer.headers

    @property
    def json(self):
        return json.loads(self.body)

    def __str__(self):
        return f"{self.status} {dict(self.headers)} {self.body[:300]!r}"


class Client:
    """Keeps its connection, as a host would."""

    def __init__(self, connect, token=None):
        self.connect, self.token, self.connection = connect, token, None

    def ask(self, method, path, body=None, **headers):
        if self.connection is None:
            self.connection = self.connect()
        names = {name.replace("_", "-"): value for name, value in headers.items()}
        if self.token:
            names.setdefault("Authorization", "Bearer " + self.token)
        try:
            self.connection.request(method, path, body, names)
            answer = self.connection.getresponse()
            read = Answer(answer)
            if answer.will_close:
                self.close()
            return read
        except (OSError, http.client.HTTPException):
            self.close()
            raise

    def get(self, path, **headers):
        return self.ask("GET", path, **headers)

    def post(self, path, document, **headers):
        headers.setdefault("Content_Type", "application/json")
        return self.ask("POST", path, document if isinstance(document, (bytes, str)) else json.dumps(document), **headers)

    def patch(self, path, document):
        return self.ask("PATCH", path, json.dumps(document), Content_Type="application/json")

    def close(self):
        if self.connection is not None:
            self.connection.close()
            self.connection = None


class Server:
    """Runs until it is stopped. Its log is read as it comes, so that it never waits for us."""

    def __init__(self, program, *arguments, cwd=None, env=None):
        self.process = subprocess.Popen([str(program), "serve", "--json", *map(str, arguments)], cwd=cwd, env=env,
                                        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.log, self.clients = [], []
        self.reader = threading.Thread(target=lambda: self.log.extend(self.process.stderr), daemon=True)
        self.reader.start()
        line = self.process.stdout.readline()
        if not line:
            self.process.wait(30)
            self.reader.join(5)
            self.process.stdout.close()
            self.process.stderr.close()
            raise RuntimeError("".join(self.log))
        self.ready = json.loads(line)

    def client(self):
        if self.ready["socket"]:
            path = self.ready["socket"]
            return self.made(Client(lambda: UnixConnection(path)))
        return self.tcp()

    def made(self, client):
        self.clients.append(client)
        return client

    def tcp(self, token=True):
        port = self.ready["port"]
        return self.made(Client(lambda: http.client.HTTPConnection("127.0.0.1", port, timeout=120),
                                self.ready["token"] if token else None))

    def memory_mb(self):
        with open(f"/proc/{self.process.pid}/status") as file:
            return next(int(line.split()[1]) for line in file if line.startswith("VmRSS")) / 1024

    def stop(self, number=signal.SIGTERM):
        """The exit code. Requests under way are finished; clients are closed afterwards."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        code = self.process.wait(60)
        for client in self.clients:
            client.close()
        self.reader.join(5)
        self.process.stdout.close()
        self.process.stderr.close()
        return code


def raw(body):
    """A raw frame -> (header, {plane: height x width array}). docs/server.md, "Raw frames"."""
    assert body[:8] == b"VIRGARAW", body[:16]
    version, at, x, y, width, height, frameWidth, frameHeight, frame, sample, count, stride = \
        struct.unpack_from("<II4i2iqIIQ", body, 8)
    assert version == 1
    planes = {}
    for i in range(count):
        name = bytes(body[64 + 32 * i:96 + 32 * i]).rstrip(b"\0").decode()
        values = np.frombuffer(body, np.float16 if sample == 2 else np.float32, width * height, at + i * stride)
        planes[name] = values.reshape(height, width)
    return {"window": (x, y, width, height), "size": (frameWidth, frameHeight), "frame": frame}, planes


def rawBody(pixels, frame=0, kind=np.float16, window=None, size=None):
    """height x width x 3 or 4 array -> a raw frame."""
    height, width, channels = pixels.shape
    names = "RGBA"[:channels]
    x, y = (window or (0, 0))[:2]
    frameWidth, frameHeight = size or (width, height)
    plane = (width * height * np.dtype(kind).itemsize + 63) // 64 * 64
    at = (64 + 32 * channels + 63) // 64 * 64
    head = b"VIRGARAW" + struct.pack("<II4i2iqIIQ", 1, at, x, y, width, height, frameWidth, frameHeight, frame,
                                     np.dtype(kind).itemsize, channels, plane)
    head += b"".join(name.encode().ljust(32, b"\0") for name in names)
    body = head.ljust(at, b"\0")
    for c in range(channels):
        body += np.ascontiguousarray(pixels[..., c], kind).tobytes().ljust(plane, b"\0")
    return body


def waitFor(condition, seconds=30):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.02)
    return False
