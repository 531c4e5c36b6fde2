"""Command lsp: the language server, started by an editor."""

from __future__ import annotations

import os

from language.text.diagnostic import MissingToolError


def lsp() -> None:
    """Answer an editor's questions about specs on stdin and stdout (docs/editing.md).

    \b
    modewright lsp
    """
    try:
        from modewright.lsp.server import create_server
    except ModuleNotFoundError as error:
        hint = "pip install 'modewright[lsp]'"
        raise MissingToolError(f"the language server needs {error.name}: {hint}") from None
    with os.fdopen(os.dup(0), "rb") as asked, os.fdopen(os.dup(1), "wb") as answered:
        create_server().start_io(asked, answered)
