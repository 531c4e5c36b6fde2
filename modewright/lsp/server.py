"""Server: what the protocol asks for, answered by the other files of this folder."""

from __future__ import annotations

import logging
from importlib.metadata import version

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer

from language.problem import SpecError
from modewright.editing.format import formatted
from modewright.lsp.completion import complete
from modewright.lsp.desk import Desk
from modewright.lsp.hover import hover, mention_at
from modewright.lsp.outline import outline
from modewright.lsp.positions import range_of
from modewright.lsp.rename import definition, references, rename
from modewright.lsp.renamed import RenameRefused
from modewright.lsp.repair import repairs

TRIGGERS = [" ", ".", "{", ",", "("]
"""Characters after which an editor asks for completions by itself."""


def language_server() -> LanguageServer:
    """Return a server that knows no text yet."""
    logging.getLogger("pygls.protocol.json_rpc").addFilter(_is_unforeseen)
    server = LanguageServer("modewright", version("modewright"))

    def publish(uri: str, number: int | None, found: list[types.Diagnostic]) -> None:
        told = types.PublishDiagnosticsParams(uri, found, number)
        server.text_document_publish_diagnostics(told)

    desk = Desk(publish)
    _answer_changes(server, desk)
    _answer_while_writing(server, desk)
    _answer_about_names(server, desk)
    return server


def _is_unforeseen(record: logging.LogRecord) -> bool:
    """Tell whether a record is of more than an answer that refuses."""
    kind = record.exc_info[0] if record.exc_info else None
    return kind is None or not issubclass(kind, JsonRpcInvalidParams)


def _answer_changes(server: LanguageServer, desk: Desk) -> None:
    @server.feature(types.INITIALIZED)
    def initialized(_: types.InitializedParams) -> None:
        encoding = server.workspace.position_encoding or types.PositionEncodingKind.Utf16
        desk.encoding = types.PositionEncodingKind(encoding).value

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    async def opened(params: types.DidOpenTextDocumentParams) -> None:
        desk.changed(
            params.text_document.uri, params.text_document.version, params.text_document.text
        )

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    async def changed(params: types.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        text = server.workspace.get_text_document(uri).source
        desk.changed(uri, params.text_document.version, text)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    async def closed(params: types.DidCloseTextDocumentParams) -> None:
        desk.changed(params.text_document.uri, None, None)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    async def files_changed(_: object) -> None:
        for path, (uri, number) in list(desk.opened.items()):
            world, _path = desk.world(uri)
            desk.changed(uri, number, world.texts[path])


def _answer_while_writing(server: LanguageServer, desk: Desk) -> None:
    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def hovered(params: types.HoverParams) -> types.Hover | None:
        return hover(*desk.world(params.text_document.uri), params.position)

    @server.feature(
        types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=TRIGGERS)
    )
    def completed(params: types.CompletionParams) -> types.CompletionList:
        world, path = desk.world(params.text_document.uri)
        items = complete(world, path, world.texts.get(path, ""), params.position)
        return types.CompletionList(is_incomplete=False, items=items)

    @server.feature(
        types.TEXT_DOCUMENT_CODE_ACTION,
        types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix]),
    )
    def repaired(params: types.CodeActionParams) -> list[types.CodeAction]:
        return list(repairs(params.text_document.uri, params.context.diagnostics))

    @server.feature(types.TEXT_DOCUMENT_FORMATTING)
    def laid_out(params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        world, path = desk.world(params.text_document.uri)
        return _layout(world.texts.get(path, ""))


def _layout(text: str) -> list[types.TextEdit]:
    """Return the edit that formats a text; none where it is formatted or cannot be."""
    try:
        made = formatted(text)
    except SpecError:
        return []
    everything = types.Range(types.Position(0, 0), types.Position(text.count("\n") + 1, 0))
    return [] if made == text else [types.TextEdit(everything, made)]


def _answer_about_names(server: LanguageServer, desk: Desk) -> None:
    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def defined(params: types.DefinitionParams) -> list[types.Location]:
        return definition(*desk.world(params.text_document.uri), params.position)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def referred(params: types.ReferenceParams) -> list[types.Location]:
        world, path = desk.world(params.text_document.uri)
        return references(world, path, params.position, params.context.include_declaration)

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def outlined(params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        return outline(*desk.world(params.text_document.uri))

    @server.feature(types.TEXT_DOCUMENT_PREPARE_RENAME)
    def prepared(params: types.PrepareRenameParams) -> types.Range | None:
        world, path = desk.world(params.text_document.uri)
        mention = mention_at(world, path, params.position)
        return range_of(mention.span, world.encoding) if mention else None

    @server.feature(types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True))
    def renamed(params: types.RenameParams) -> types.WorkspaceEdit:
        world, path = desk.world(params.text_document.uri)
        try:
            return rename(world, path, params.position, params.new_name)
        except RenameRefused as error:
            raise JsonRpcInvalidParams(str(error)) from None
