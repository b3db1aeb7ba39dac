"""Connections to ``creeping explore`` from pages of other sites and from other users: none may change anything.

A case is a burst of connections at once, by bare sockets, each with headers that one who is not the page would send,
and messages that turn the incidence and move the sliders sent before the answer, with the upgrade or after it. That
the same messages do turn the incidence when the page itself sends them is checked first.
"""

import base64
import os
import socket
import struct
import threading
import time
from pathlib import Path

import numpy as np
from numpy.random import Generator

from tests.fuzz.calls import REFUSED, SILENT, Verdict

BURST = 10
"""Connections of a case."""
PORT = 8360


class Origins:
    """Bursts of foreign connections."""

    def prepare(self, folder: Path) -> None:
        """Start the page, and see that its own messages are carried out."""
        import viser

        import creeping as cr
        import scatterers as sc
        from creeping.explorer.page import Explorer
        from creeping.explorer.request import ViewRequest

        body = sc.Ellipsoid(1.2, 0.8, 0.8)
        asked = ViewRequest(theta=50.0, phi=40.0, rays=16, length=1.0, spacing=0.5, wavenumber=20.0, boundary="hard")
        self.page = Explorer(cr.DirectFlow(body, rtol=1e-6), asked, port=PORT)
        self.protocol = f"viser-v{viser.__version__}"
        self.port, self.token = self.page.server.get_port(), self.page.server.door.token
        before = self.page.request
        cookie = f"Cookie: creeping-{self.port}={self.token}"
        answer = self._connect([f"Host: 127.0.0.1:{self.port}", cookie], self._messages(), "after")
        until = time.monotonic() + 20
        while self.page.request == before:
            if time.monotonic() > until:
                raise RuntimeError(f"messages of the page itself turn nothing; the answer was {answer[:80]!r}")
            time.sleep(0.05)
        self._settle()

    def attempt(self, number: int, rng: Generator, place: Path) -> Verdict:
        """Connect ten times at once."""
        before = self.page.request
        sent = [(self._headers(rng), str(rng.choice(["before", "with", "after"]))) for _ in range(BURST)]
        place.with_suffix(".txt").write_text("\n\n".join(f"{when}\n" + "\n".join(lines) for lines, when in sent))
        answers: list[bytes] = []
        messages = self._messages()

        def connect(lines: list[str], when: str) -> None:
            answers.append(self._connect(lines, messages, when))

        threads = [threading.Thread(target=connect, args=case) for case in sent]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        opened = [answer for answer in answers if b" 101 " in answer[:40] or b" 200 " in answer[:40]]
        if opened:
            return Verdict(SILENT, f"let in: {opened[0][:100]!r}")
        time.sleep(0.02)
        if self.page.request != before:
            return Verdict(SILENT, f"changed: {before} to {self.page.request}")
        if self.page.server.get_clients():
            return Verdict(SILENT, f"clients: {self.page.server.get_clients()}")
        return Verdict(REFUSED, f"{len(answers)} connections")

    def _settle(self) -> None:
        """Wait until what was asked has been shown and the connection is gone."""
        until = time.monotonic() + 20
        while self.page.server.get_clients() and time.monotonic() < until:
            time.sleep(0.05)
        time.sleep(1.0)

    def _headers(self, rng: Generator) -> list[str]:
        there, port, token = "127.0.0.1", self.port, self.token
        own, wrong = f"{there}:{port}", "x" * len(token)
        good = f"creeping-{port}={token}"
        origins = [
            *("http://a.example", "null", "file://", f"http://{there}.a.example", f"http://a.example:{port}", ""),
            *("http://localhost", f"http://{there}:{port + 1}", f"https://{there}:{port}", f"http://[::1]:{port}x"),
            *(f"http://user@{there}:{port}", f"http://{there}:{port}/", f"http://{there}:{port}\thttp://a.example"),
            *(f"http://{there}:{port}#@a.example", f"http://{there}:{port} http://a.example", "http://[::1"),
        ]
        hosts = ["a.example", f"a.example:{port}", there, f"{there}:{port + 1}", f"{there}.a.example:{port}", ""]
        cookies = [
            *(f"creeping-{port}={wrong}", f"creeping-{port}=", f"creeping-{port + 1}={token}", f"creeping={token}"),
            *(f"creeping-{port}={token[:-1]}", f"creeping-{port}={token}x", "\xe9=\xff", "a" * 3000, token),
            *(f"creeping-{port}={token}; creeping-{port}={wrong}", f"creeping-{port}={token.swapcase()}"),
        ]
        kind = int(rng.integers(6))
        if kind == 0:
            # a page of another site, in a browser that even has the cookie
            return [f"Host: {own}", f"Origin: {rng.choice(origins)}", f"Cookie: {good}"]
        if kind == 1:
            return [f"Host: {rng.choice(hosts)}", f"Cookie: {good}"]
        if kind == 2:
            return [f"Host: {own}", f"Cookie: {rng.choice(cookies)}"]
        if kind == 3:
            return [f"Host: {own}", f"Host: {rng.choice(hosts)}", f"Cookie: {good}"]
        if kind == 4:
            return [f"Host: {own}", f"Origin: http://{own}", f"Origin: {rng.choice(origins)}", f"Cookie: {good}"]
        return [f"Host: {own}", f"Origin: {rng.choice(origins)}"]

    def _messages(self) -> bytes:
        """Frames that turn the incidence and move a slider."""
        import msgspec

        slider = self.page.sliders["theta"]
        turned = {"name": "/incidence", "wxyz": [0.9, 0.3, 0.1, 0.2], "position": [0.0] * 3}
        camera: dict[str, object] = {
            "wxyz": [1.0, 0.0, 0.0, 0.0],
            "position": [3.0] * 3,
            "look_at": [0.0] * 3,
            "fov": 1.0,
            "near": 0.1,
        }
        camera |= {"far": 100.0, "image_height": 400, "image_width": 400, "up_direction": [0.0, 0.0, 1.0]}
        said = [
            {"type": "ViewerCameraMessage", **camera},
            {"type": "TransformControlsUpdateMessage", **turned},
            {"type": "GuiUpdateMessage", "uuid": slider._impl.uuid, "updates": {"value": 12.0}},
        ]
        return b"".join(frame(msgspec.msgpack.encode(message)) for message in said)

    def _connect(self, lines: list[str], messages: bytes, when: str) -> bytes:
        """Answer to an upgrade; messages follow before it is read, in the same packet, or after it."""
        key = base64.b64encode(os.urandom(16)).decode()
        head = ["GET / HTTP/1.1", *lines, "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                f"Sec-WebSocket-Key: {key}", f"Sec-WebSocket-Protocol: {self.protocol}", "", ""]  # fmt: skip
        asked = "\r\n".join(head).encode("latin-1")
        answer = b""
        try:
            with socket.create_connection(("127.0.0.1", self.port), timeout=5) as raw:
                raw.sendall(asked + messages if when == "with" else asked)
                if when == "before":
                    raw.sendall(messages)
                answer = raw.recv(4096)
                if when == "after":
                    raw.sendall(messages)
                    # a door that is open reads them while the connection is
                    time.sleep(0.3 if b" 101 " in answer[:40] else 0.0)
        except OSError:
            # reset by a server that does not read on
            pass
        return answer


def frame(payload: bytes) -> bytes:
    """A masked binary frame of a websocket [RFC 6455, 5.2]."""
    mask = b"\1\2\3\4"
    long = len(payload) > 125
    size = struct.pack("!BBH", 0x82, 0xFE, len(payload)) if long else struct.pack("!BB", 0x82, 0x80 | len(payload))
    covered = np.frombuffer(payload, dtype=np.uint8) ^ np.resize(np.frombuffer(mask, dtype=np.uint8), len(payload))
    return size + mask + covered.tobytes()
