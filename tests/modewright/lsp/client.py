"""Talk: the language server as an editor meets it, a process at the other end of two pipes."""

from __future__ import annotations

import json
import subprocess
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Any

LONGEST_SECONDS = 240.0
"""After which a server that says nothing more is ended."""
Message = dict[str, Any]


class LspClient:
    """One running server; a context that shuts it down."""

    def __init__(
        self,
        encodings: tuple[str, ...] = ("utf-16",),
        stderr: IO[bytes] | None = None,
        first: Message | None = None,
    ) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "modewright", "lsp"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
        )
        self.watchdog = threading.Timer(LONGEST_SECONDS, self.process.kill)
        self.watchdog.daemon = True
        self.watchdog.start()
        self.number = 0
        self.versions: dict[str, int] = {}
        self.told: dict[str, tuple[int | None, list[Message]]] = {}
        self.first_answer = self.request_raw(**first) if first else {}
        general = {"positionEncodings": list(encodings)}
        capabilities = {"general": general}
        start = {"processId": None, "rootUri": None, "capabilities": capabilities}
        self.capabilities = self.request("initialize", start)["capabilities"]
        self.notify("initialized", {})

    def __enter__(self) -> LspClient:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self.request("shutdown", None)
            self.notify("exit", None)
            assert self.process.wait(10) == 0
        self.close()

    def close(self) -> None:
        """End the process if it still runs."""
        self.watchdog.cancel()
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            with suppress(BrokenPipeError):
                if stream:
                    stream.close()

    def notify(self, method: str, params: Any) -> None:
        self._send({"jsonrpc": "2.0", "method": method, "params": params})

    def request(self, method: str, params: Any) -> Any:
        answer = self.request_raw(method, params)
        assert "error" not in answer, answer["error"]
        return answer["result"]

    def request_raw(self, method: str, params: Any) -> Message:
        self.number += 1
        self._send({"jsonrpc": "2.0", "id": self.number, "method": method, "params": params})
        while (message := self._receive()).get("id") != self.number or "method" in message:
            pass
        return message

    def open(self, path: Path, text: str) -> list[Message]:
        """Open a text and return its problems."""
        uri = path.as_uri()
        self.versions[uri] = 1
        item = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
        self.notify("textDocument/didOpen", {"textDocument": item})
        return self.problems(path)

    def change(self, path: Path, text: str) -> list[Message]:
        """Replace an open text and return its problems."""
        self.begin_change(path, text)
        return self.problems(path)

    def begin_change(self, path: Path, text: str) -> None:
        uri = path.as_uri()
        self.versions[uri] += 1
        document = {"uri": uri, "version": self.versions[uri]}
        change = {"textDocument": document, "contentChanges": [{"text": text}]}
        self.notify("textDocument/didChange", change)

    def problems(self, path: Path) -> list[Message]:
        """Wait for the problems of the newest version of a text."""
        uri = path.as_uri()
        while self.told.get(uri, (None, []))[0] != self.versions[uri]:
            self._receive()
        return self.told[uri][1]

    def problem(self, path: Path, code: str) -> Message:
        """Wait for a problem of a code."""
        while True:
            for each in self.told[path.as_uri()][1]:
                if each["code"] == code:
                    return each
            self._receive()

    def at(self, path: Path, line: int, character: int) -> Message:
        """Return the parameters of a question about a position; lines count from 1."""
        position = {"line": line - 1, "character": character}
        return {"textDocument": {"uri": path.as_uri()}, "position": position}

    def _send(self, message: Message) -> None:
        data = json.dumps(message).encode()
        assert self.process.stdin
        self.process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(data), data))
        self.process.stdin.flush()

    def _receive(self) -> Message:
        assert self.process.stdout
        length = 0
        while line := self.process.stdout.readline().strip():
            name, _, value = line.partition(b":")
            length = int(value) if name.lower() == b"content-length" else length
        assert length, "the server has ended"
        message: Message = json.loads(self.process.stdout.read(length))
        if message.get("method") == "textDocument/publishDiagnostics":
            params = message["params"]
            self.told[params["uri"]] = params.get("version"), params["diagnostics"]
        return message


def seconds_of_edit(talk: LspClient, path: Path, text: str) -> float:
    """Return the time from an edit to its problems [s]."""
    start = time.perf_counter()
    talk.change(path, text)
    return time.perf_counter() - start
