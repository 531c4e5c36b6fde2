"""Command lsp: run the language server."""

from __future__ import annotations

import os

from language.text.diagnostic import MissingToolError


def lsp() -> None:
    """Run the language server for specs on stdin and stdout (docs/editing.md).

    An editor starts this command.

    \b
    modewright lsp
    """
    try:
        from modewright.lsp.server import create_server
    except ModuleNotFoundError as error:
        hint = "pip install 'modewright[lsp]'"
        raise MissingToolError(f"the language server needs {error.name}: {hint}") from None
    with os.fdopen(os.dup(0), "rb") as requests, os.fdopen(os.dup(1), "wb") as responses:
        create_server().start_io(requests, responses)
