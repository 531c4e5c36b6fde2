"""Malformed messages get the error codes of JSON-RPC, and the server goes on."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.modewright.lsp.client import LspClient, Message
from tests.modewright.lsp.heater import HEATER

FILE = {"uri": "file:///project/spec/none.yaml"}
START = {"line": 0, "character": 0}
VALID = {"textDocument": FILE, "position": START}
MALFORMED: dict[str, tuple[Any, str]] = {
    "null": (None, "expected an object at `params`"),
    "list": ([], "expected an object at `params.textDocument`"),
    "text": ("here", "expected an object at `params.textDocument`"),
    "no key": ({}, "a key is missing at `params.textDocument`"),
    "no position": ({"textDocument": FILE}, "a key is missing at `params.position`"),
    "file of null": ({**VALID, "textDocument": None}, "expected "),
    "number as file": (
        {**VALID, "textDocument": {"uri": 5}},
        "expected str at `params.textDocument.uri`",
    ),
    "text as line": (
        {**VALID, "position": {"line": "0", "character": 0}},
        "expected int at `params.position.line`",
    ),
    "truth value as line": (
        {**VALID, "position": {"line": True, "character": 0}},
        "expected int at `params.position.line`",
    ),
    "negative line": (
        {**VALID, "position": {"line": -1, "character": 0}},
        "invalid value at `params.position`",
    ),
}
"""Parameters of a request about a position, and what the error says."""
NOTIFICATIONS: tuple[Any, ...] = (None, [], {}, {"textDocument": {"uri": 5}})
ANSWERS: tuple[Message, ...] = ({"result": []}, {"error": 5}, {"error": None})
REQUESTS = (
    *("completion", "codeAction", "formatting", "definition", "references"),
    *("documentSymbol", "prepareRename", "rename"),
)


@pytest.mark.parametrize("case", MALFORMED)
def test_malformed_parameters_are_invalid_params(talk: LspClient, case: str) -> None:
    params, expected = MALFORMED[case]
    error = talk.request_raw("textDocument/hover", params)["error"]
    assert error["code"] == -32602
    assert error["message"].startswith("textDocument/hover: ") and expected in error["message"]
    assert talk.request("textDocument/hover", VALID) is None


@pytest.mark.parametrize("method", REQUESTS)
@pytest.mark.parametrize("params", [None, [], {}, 5])
def test_every_request_refuses_malformed_parameters(
    talk: LspClient, method: str, params: Any
) -> None:
    error = talk.request_raw(f"textDocument/{method}", params)["error"]
    assert error["code"] == -32602 and method in error["message"]


@pytest.mark.parametrize("method", ["textDocument/foldingRange", "nothing", "$/nothing", ""])
@pytest.mark.parametrize("params", [None, [], VALID])
def test_an_unknown_method_is_method_not_found(talk: LspClient, method: str, params: Any) -> None:
    error = talk.request_raw(method, params)["error"]
    assert error == {"code": -32601, "message": f"Method Not Found: {method}"}


@pytest.mark.parametrize(
    "message",
    [
        [],
        5,
        None,
        {},
        {"jsonrpc": "2.0"},
        {"jsonrpc": "1.0", "method": "textDocument/hover", "params": VALID},
        {"jsonrpc": "2.0", "id": None, "method": "textDocument/hover", "params": VALID},
        {"jsonrpc": "2.0", "id": [1], "method": "textDocument/hover", "params": VALID},
        {"jsonrpc": "2.0", "id": 1, "method": 5},
        {"jsonrpc": "2.0", "id": 1},
    ],
)
def test_what_is_no_message_is_an_invalid_request(talk: LspClient, message: Any) -> None:
    if isinstance(message, dict) and message.get("jsonrpc") == "1.0":
        message["id"] = 1
    answer = answer_to(talk, json.dumps(message).encode())
    number = message.get("id") if isinstance(message, dict) else None
    assert answer["error"]["code"] == -32600
    assert answer["id"] == (number if isinstance(number, int) else None)


@pytest.mark.parametrize("data", [b"{a}", b"\xff\xff", b"{", b'"'])
def test_what_is_no_json_is_a_parse_error(talk: LspClient, data: bytes) -> None:
    answer = answer_to(talk, data)
    assert answer["error"]["code"] == -32700 and answer["id"] is None


@pytest.mark.parametrize("opening", ["[", '{"a":'])
def test_a_message_that_is_nested_deeply_is_a_parse_error(talk: LspClient, opening: str) -> None:
    error = answer_to(talk, opening.encode() * 100_000)["error"]
    assert error == {"code": -32700, "message": "the message is nested too deeply"}
    assert talk.request("textDocument/hover", VALID) is None


@pytest.mark.parametrize(
    "data",
    [
        b"Content-Length: abc\r\n\r\n{}",
        b"Content-Length: -5\r\n\r\n{}",
        b"Content-Length: 0\r\n\r\n",
        b"Content-Length:\r\n\r\n",
        b"Content-Length: 99999999999999999999\r\n\r\n{}",
        b"Content-Type: text\r\n\r\n{}",
        b"no header at all\n\n",
        b"Content-Length: 1\r\n\r\n{}",
    ],
)
def test_a_message_with_a_wrong_header_is_a_parse_error(talk: LspClient, data: bytes) -> None:
    answer = answer_to_bytes(talk, data)
    assert answer["error"]["code"] == -32700 and answer["id"] is None
    for _ in range(2):
        assert talk.request("textDocument/hover", VALID) is None


@pytest.mark.parametrize("header", [b"content-length:  %d\r\n\r\n", b"\r\nContent-Length: %d\n\n"])
def test_a_header_may_be_written_in_other_ways(talk: LspClient, header: bytes) -> None:
    answer = answer_to_bytes(talk, header % 2 + b"[]")
    assert answer["error"]["code"] == -32600


def answer_to(talk: LspClient, data: bytes) -> Message:
    """Send the body of a message, and return the next error."""
    return answer_to_bytes(talk, b"Content-Length: %d\r\n\r\n%s" % (len(data), data))


def answer_to_bytes(talk: LspClient, data: bytes) -> Message:
    """Send bytes, and return the next error."""
    assert talk.process.stdin
    talk.process.stdin.write(data)
    talk.process.stdin.flush()
    while "error" not in (message := talk._receive()):
        pass
    return message


def test_malformed_notifications_and_answers_are_ignored(talk: LspClient) -> None:
    for method in ("didOpen", "didChange", "didClose", "didSave"):
        for params in NOTIFICATIONS:
            talk.notify(f"textDocument/{method}", params)
    talk.notify("$/cancelRequest", None)
    talk.notify("nothing", [])
    for answer in ANSWERS:
        talk._send({"jsonrpc": "2.0", "id": "unknown", **answer})
    assert talk.request("textDocument/hover", VALID) is None


def test_a_key_jsonrpc_inside_parameters_is_no_message(talk: LspClient) -> None:
    assert talk.request("textDocument/hover", {**VALID, "more": {"jsonrpc": "2.0"}}) is None


@pytest.fixture
def server(tmp_path: Path) -> Iterator[LspClient]:
    """A server whose end a test observes; its stderr is in a file."""
    with (tmp_path / "stderr").open("wb") as file:
        talk = LspClient(stderr=file)
        yield talk
        talk.close()


def end_by(number: int) -> Callable[[LspClient], None]:
    return lambda talk: talk.process.send_signal(number)


def close_input(talk: LspClient) -> None:
    assert talk.process.stdin
    talk.process.stdin.close()


def shut_down(talk: LspClient) -> None:
    talk.request("shutdown", None)
    error = talk.request_raw("textDocument/hover", VALID)["error"]
    assert error["code"] == -32600


ENDS: dict[str, tuple[Callable[[LspClient], None], int]] = {
    "exit": (lambda talk: talk.notify("exit", None), 1),
    "end of input": (close_input, 1),
    "SIGTERM": (end_by(signal.SIGTERM), 143),
    "SIGHUP": (end_by(signal.SIGHUP), 129),
    "SIGINT": (end_by(signal.SIGINT), 130),
}


@pytest.mark.parametrize("end", ENDS)
def test_the_exit_code_without_shutdown(server: LspClient, tmp_path: Path, end: str) -> None:
    act, code = ENDS[end]
    act(server)
    assert server.process.wait(30) == code
    assert (tmp_path / "stderr").read_text() == ""


@pytest.mark.parametrize("end", ["exit", "end of input"])
def test_the_exit_code_after_shutdown_is_0(server: LspClient, tmp_path: Path, end: str) -> None:
    shut_down(server)
    ENDS[end][0](server)
    assert server.process.wait(30) == 0
    assert (tmp_path / "stderr").read_text() == ""


def test_a_signal_during_a_background_check_ends_the_check_too(
    server: LspClient, tmp_path: Path
) -> None:
    path = tmp_path / "spec" / "heater.yaml"
    path.parent.mkdir()
    server.open(path, HEATER)
    deadline = time.monotonic() + 60
    while not (found := children_of(server.process.pid)) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert found
    server.process.send_signal(signal.SIGTERM)
    assert server.process.wait(30) == 143
    while any(map(is_running, found)) and time.monotonic() < deadline:
        time.sleep(0.01)
    assert not any(map(is_running, found))
    assert (tmp_path / "stderr").read_text() == ""


def children_of(number: int) -> list[int]:
    command = ["ps", "-o", "pid=", "--ppid", str(number)]
    if sys.platform == "darwin":
        command = ["pgrep", "-P", str(number)]
    return [int(text) for text in subprocess.run(command, capture_output=True).stdout.split()]


def is_running(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("method", ["textDocument/hover", "shutdown", "nothing"])
def test_a_request_before_initialize_is_not_initialized(method: str) -> None:
    params = VALID if method == "textDocument/hover" else None
    with LspClient(first={"method": method, "params": params}) as talk:
        assert talk.first_answer["error"]["code"] == -32002
        assert talk.request("textDocument/hover", VALID) is None
        again = talk.request_raw(
            "initialize", {"processId": None, "rootUri": None, "capabilities": {}}
        )
        assert again["error"]["code"] == -32600
