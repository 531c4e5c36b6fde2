"""Server: register the requests of the language server protocol and answer them."""

from __future__ import annotations

import asyncio
import json
import logging
import sys
import threading
from importlib.metadata import version
from typing import BinaryIO

from lsprotocol import types
from pygls.exceptions import (
    JsonRpcException,
    JsonRpcInvalidParams,
    JsonRpcServerNotInitialized,
)
from pygls.io_ import StdoutWriter
from pygls.lsp.server import LanguageServer

from language.text.diagnostic import SpecError
from modewright.editing.formatter import format_text
from modewright.lsp.completion import complete
from modewright.lsp.hover import hover, reference_at
from modewright.lsp.message_check import CheckedProtocol, parse_error, strict_converter
from modewright.lsp.message_reader import MessageReader
from modewright.lsp.open_documents import OpenDocuments
from modewright.lsp.outline import outline
from modewright.lsp.positions import range_of
from modewright.lsp.quick_fix import quick_fixes
from modewright.lsp.rename import definition, references, rename
from modewright.lsp.rename_check import RenameRefused

TRIGGER_CHARACTERS = [" ", ".", "{", ",", "("]
"""Characters after which an editor requests completions."""
REFUSALS = (
    *(JsonRpcInvalidParams, JsonRpcServerNotInitialized),
    *(json.JSONDecodeError, UnicodeDecodeError),
)
"""Exceptions that the editor gets as an answer."""
MALFORMED = "Unable to deserialize message"
"""Start of the log of pygls about a malformed response, which is ignored."""


class SpecServer(LanguageServer):
    """The language server; it answers malformed messages, and its end waits for no thread."""

    protocol: CheckedProtocol

    def __init__(self) -> None:
        super().__init__(
            "modewright",
            version("modewright"),
            protocol_cls=CheckedProtocol,
            converter_factory=strict_converter,
        )

    def start_io(self, requests: BinaryIO | None = None, responses: BinaryIO | None = None) -> None:
        """Answer the messages of a stream until `exit`, its end, or an interrupt.

        The loop of pygls is not used, because it ignores a message with an invalid header and all
        messages after it.
        """
        self._stop_event = threading.Event()
        self.protocol.set_writer(StdoutWriter(responses or sys.stdout.buffer))
        try:
            asyncio.run(self._answer_messages(MessageReader(requests or sys.stdin.buffer)))
        except (BrokenPipeError, KeyboardInterrupt, SystemExit):
            pass
        finally:
            self.shutdown()

    async def _answer_messages(self, reader: MessageReader) -> None:
        """Answer the messages of a reader; those without valid header or JSON get an error."""
        loop = asyncio.get_running_loop()
        assert self._stop_event is not None
        while not self._stop_event.is_set():
            try:
                body = await loop.run_in_executor(self.thread_pool, reader.read_body)
                if body is None:
                    return
                message = json.loads(body, object_hook=self.protocol.structure_message)
            except (ValueError, RecursionError) as error:
                self.protocol.refuse_message(None, parse_error(error))
                continue
            try:
                self.protocol.handle_message(message)
            except Exception as error:
                logging.getLogger("pygls.server").exception("a message cannot be handled")
                self.report_server_error(error, JsonRpcException)

    def shutdown(self) -> None:
        """Stop the server without waiting for the thread that reads messages."""
        if self._stop_event is not None:
            self._stop_event.set()
        self.thread_pool.shutdown(wait=False, cancel_futures=True)


def serve(requests: BinaryIO, responses: BinaryIO) -> int:
    """Run the language server until `exit`, the end of the requests, or an interrupt.

    Returns the exit code: 0 after the request `shutdown`, else 1.
    """
    server = create_server()
    server.start_io(requests, responses)
    return 0 if server.protocol.is_shut_down else 1


def create_server() -> SpecServer:
    """Return a language server, not yet started and without open documents.

    Its features are diagnostics, hover, completion, quick fixes, formatting, definition,
    references, outline and rename. Refused messages are no longer logged as errors.
    """
    for name in ("pygls.protocol.json_rpc", "pygls.server"):
        logging.getLogger(name).addFilter(_is_unexpected)
    server = SpecServer()

    def publish(uri: str, number: int | None, found: list[types.Diagnostic]) -> None:
        params = types.PublishDiagnosticsParams(uri, found, number)
        server.text_document_publish_diagnostics(params)

    open_documents = OpenDocuments(publish)
    _register_synchronisation(server, open_documents)
    _register_editing(server, open_documents)
    _register_navigation(server, open_documents)
    return server


def _is_unexpected(record: logging.LogRecord) -> bool:
    """Return whether a log record is more than a refused message."""
    kind = record.exc_info[0] if record.exc_info else None
    is_refusal = kind is not None and issubclass(kind, REFUSALS)
    return not is_refusal and not str(record.msg).startswith(MALFORMED)


def _register_synchronisation(server: LanguageServer, open_documents: OpenDocuments) -> None:
    """Register the notifications about opened, changed and closed documents."""

    @server.feature(types.INITIALIZED)
    def initialized(_: types.InitializedParams) -> None:
        encoding = server.workspace.position_encoding or types.PositionEncodingKind.Utf16
        open_documents.encoding = types.PositionEncodingKind(encoding).value

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def opened(params: types.DidOpenTextDocumentParams) -> None:
        open_documents.update(
            params.text_document.uri, params.text_document.version, params.text_document.text
        )

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: types.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        text = server.workspace.get_text_document(uri).source
        open_documents.update(uri, params.text_document.version, text)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(params: types.DidCloseTextDocumentParams) -> None:
        open_documents.update(params.text_document.uri, None, None)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def files_changed(_: object) -> None:
        for path, (uri, number) in list(open_documents.open_files.items()):
            workspace, _path = open_documents.workspace_of(uri)
            open_documents.update(uri, number, workspace.texts[path])


def _register_editing(server: LanguageServer, open_documents: OpenDocuments) -> None:
    """Register hover, completion, quick fixes and formatting."""

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hovered(params: types.HoverParams) -> types.Hover | None:
        return hover(*open_documents.workspace_of(params.text_document.uri), params.position)

    @server.feature(
        types.TEXT_DOCUMENT_COMPLETION,
        types.CompletionOptions(trigger_characters=TRIGGER_CHARACTERS),
    )
    def completed(params: types.CompletionParams) -> types.CompletionList:
        workspace, path = open_documents.workspace_of(params.text_document.uri)
        items = complete(workspace, path, workspace.texts.get(path, ""), params.position)
        return types.CompletionList(is_incomplete=False, items=items)

    @server.feature(
        types.TEXT_DOCUMENT_CODE_ACTION,
        types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix]),
    )
    def repaired(params: types.CodeActionParams) -> list[types.CodeAction]:
        return list(quick_fixes(params.text_document.uri, params.context.diagnostics))

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def laid_out(params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        workspace, path = open_documents.workspace_of(params.text_document.uri)
        return _formatting_edits(workspace.texts.get(path, ""))


def _formatting_edits(text: str) -> list[types.TextEdit]:
    """Return the edit that formats a text; empty if it is formatted or invalid."""
    try:
        formatted_text = format_text(text)
    except SpecError:
        return []
    everything = types.Range(types.Position(0, 0), types.Position(text.count("\n") + 1, 0))
    return [] if formatted_text == text else [types.TextEdit(everything, formatted_text)]


def _register_navigation(server: LanguageServer, open_documents: OpenDocuments) -> None:
    """Register definition, references, outline and rename."""

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def defined(params: types.DefinitionParams) -> list[types.Location]:
        return definition(*open_documents.workspace_of(params.text_document.uri), params.position)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def referred(params: types.ReferenceParams) -> list[types.Location]:
        workspace, path = open_documents.workspace_of(params.text_document.uri)
        return references(workspace, path, params.position, params.context.include_declaration)

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def outlined(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        return outline(*open_documents.workspace_of(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepared(params: types.PrepareRenameParams) -> types.Range | None:
        workspace, path = open_documents.workspace_of(params.text_document.uri)
        reference = reference_at(workspace, path, params.position)
        return range_of(reference.span, workspace.encoding) if reference else None

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def renamed(params: types.RenameParams) -> types.WorkspaceEdit:
        workspace, path = open_documents.workspace_of(params.text_document.uri)
        try:
            return rename(workspace, path, params.position, params.new_name)
        except RenameRefused as error:
            raise JsonRpcInvalidParams(str(error)) from None
