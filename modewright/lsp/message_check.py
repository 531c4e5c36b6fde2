"""Message check: refuse malformed messages with the error codes of JSON-RPC.

The server goes on after each of them. A malformed notification is ignored, because the protocol has
no answer to it.
"""

from __future__ import annotations

import logging
import re
from enum import Enum
from typing import Any

from attrs import has
from cattrs import Converter, transform_error
from pygls.exceptions import (
    JsonRpcException,
    JsonRpcInvalidParams,
    JsonRpcInvalidRequest,
    JsonRpcParseError,
    JsonRpcServerNotInitialized,
)
from pygls.protocol import (
    JsonRPCNotification,
    JsonRPCRequestMessage,
    LanguageServerProtocol,
    default_converter,
)

from modewright.lsp.message_reader import HeaderError

INITIALIZE = "initialize"
"""The first request of an editor."""
BEFORE_INITIALIZE = (INITIALIZE, "exit")
"""Messages that are handled before it."""
MAX_CAUSES = 3
"""Largest number of causes in the message of an error."""
EXACT_TYPES = (str, int, bool)
"""Types whose values are not converted: the text "5" is no number."""
log = logging.getLogger("modewright.lsp")


def strict_converter() -> Converter:
    """Return the converter of messages that accepts values of EXACT_TYPES only as they are.

    It raises a TypeError or a validation error of cattrs for others.
    """
    converter: Converter = default_converter()  # type: ignore[no-untyped-call]
    for kind in EXACT_TYPES:
        converter.register_structure_hook(kind, _require_type)
    return converter


def _require_type(value: Any, kind: type) -> Any:
    """Return the value if it has the type; a truth value is no number. Raises TypeError.

    A member of an enumeration is returned for its value; enumerations are subclasses of int or str.
    Raises ValueError for a value without member.
    """
    if issubclass(kind, Enum):
        return kind(value)
    if not isinstance(value, kind) or isinstance(value, bool) != (kind is bool):
        raise TypeError(f"expected {kind.__name__}")
    return value


class CheckedProtocol(LanguageServerProtocol):
    """The protocol of the language server with an answer to each malformed request."""

    is_initialized = False
    """Whether the editor sent a valid request `initialize`."""

    @property
    def is_shut_down(self) -> bool:
        """Whether the editor sent the request `shutdown`."""
        return self._shutdown

    def structure_message(self, data: dict[str, Any]) -> Any:
        """Return an object of a message as it is; `handle_message` structures the whole message.

        The server calls this for each object inside the message too.
        """
        return data

    def handle_message(self, message: Any) -> None:
        """Answer a message; a malformed one gets the error JsonRpcInvalidRequest (-32600),
        JsonRpcMethodNotFound (-32601) or JsonRpcInvalidParams (-32602).

        Before `initialize` a request gets JsonRpcServerNotInitialized (-32002), and a notification
        other than `exit` is ignored.
        """
        try:
            structured_message = self._structure_message(message)
        except JsonRpcException as error:
            self.refuse_message(message, error)
            return
        if isinstance(message, dict) and message.get("method") == INITIALIZE:
            self.is_initialized = True
        super().handle_message(structured_message)

    def refuse_message(self, message: Any, error: JsonRpcException) -> None:
        """Answer a message with an error; log the error of a notification or a response."""
        is_object = isinstance(message, dict)
        if is_object and (("id" not in message and "method" in message) or _is_response(message)):
            log.warning("ignored a message: %s", error.message)
            return
        number = message.get("id") if is_object else None
        answer = {"code": error.code, "message": error.message}
        number = number if _is_request_id(number) else None  # null if the message has none
        self._send_data({"jsonrpc": self.VERSION, "id": number, "error": answer})

    def _structure_message(self, message: Any) -> Any:
        """Return a message as an object of the protocol. Raises JsonRpcException."""
        if not isinstance(message, dict) or message.get("jsonrpc") != self.VERSION:
            raise JsonRpcInvalidRequest(f'a message is an object with "jsonrpc": "{self.VERSION}"')
        if _is_response(message):
            return super().structure_message(message)
        method, is_request = message.get("method"), "id" in message
        if not isinstance(method, str):
            raise JsonRpcInvalidRequest("`method` is missing or no string")
        if is_request and not _is_request_id(message["id"]):
            raise JsonRpcInvalidRequest("`id` is neither a number nor a string")
        if not self.is_initialized and method not in BEFORE_INITIALIZE:
            raise JsonRpcServerNotInitialized("the first request is `initialize`")
        if is_request:
            self._get_handler(method)  # raises JsonRpcMethodNotFound
            if self.is_initialized and method == INITIALIZE:
                raise JsonRpcInvalidRequest("the server is initialized already")
            if self.is_shut_down:
                raise JsonRpcInvalidRequest("the server accepts no requests after `shutdown`")
        kind = self.get_message_type(method)
        if kind is None:
            message = {"params": None, **message}
            kind = JsonRPCRequestMessage if is_request else JsonRPCNotification
        try:
            return self._converter.structure(message, kind)
        except Exception as error:
            raise JsonRpcInvalidParams(f"{method}: {_describe_causes(error)}") from None


def parse_error(error: Exception) -> JsonRpcException:
    """Return the error JsonRpcParseError (-32700) for a message without valid header or JSON."""
    if isinstance(error, HeaderError):
        return JsonRpcParseError(f"the message cannot be read: {error}")
    if isinstance(error, RecursionError):
        return JsonRpcParseError("the message is nested too deeply")
    return JsonRpcParseError(f"the message is no JSON: {error}")


def _is_response(message: Any) -> bool:
    """Return whether a message answers a request of the server."""
    is_answer = isinstance(message, dict) and "id" in message and "method" not in message
    return is_answer and ("result" in message or "error" in message)


def _is_request_id(value: object) -> bool:
    """Return whether a value can be the number of a request."""
    return isinstance(value, int | str) and not isinstance(value, bool)


def _describe_causes(error: Exception) -> str:
    """Return at most MAX_CAUSES causes of a validation error, with the keys at which they are."""
    causes = [
        re.sub(r"_([a-z])", lambda match: match[1].upper(), cause).replace(" @ $.", " at `") + "`"
        for cause in transform_error(error, format_exception=_describe_cause)
    ]
    more = f" and {len(causes) - MAX_CAUSES} more" if len(causes) > MAX_CAUSES else ""
    return "; ".join(causes[:MAX_CAUSES]) + more


def _describe_cause(error: BaseException, kind: type | None) -> str:
    """Return what is wrong with a value that should have a type."""
    if isinstance(error, KeyError):
        return "a key is missing"
    if kind in EXACT_TYPES:
        return f"expected {kind.__name__}"
    return "expected an object" if kind is not None and has(kind) else "invalid value"
