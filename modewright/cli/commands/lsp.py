"""Command lsp: run the language server."""

from __future__ import annotations

import os
import signal
import sys

import typer

from language.text.diagnostic import MissingToolError
from modewright.cli.common.interruption import TERMINATION_SIGNALS, convert_signals


def lsp() -> None:
    """Run the language server for specs on stdin and stdout (docs/editing.md).

    An editor starts this command. It ends with code 0 if the editor sent `shutdown`, else with 1.

    \b
    modewright lsp
    """
    try:
        from modewright.lsp.server import serve
    except ModuleNotFoundError as error:
        hint = "pip install 'modewright[lsp]'"
        raise MissingToolError(f"the language server needs {error.name}: {hint}") from None
    with (
        os.fdopen(os.dup(0), "rb") as requests,
        os.fdopen(os.dup(1), "wb") as responses,
        convert_signals((signal.SIGINT, *TERMINATION_SIGNALS)) as received,
    ):
        code = serve(requests, responses)
        if received.number:
            sys.stderr.flush()
            os._exit(received.exit_code)  # a thread still reads; Python would wait for its end
    raise typer.Exit(code)
