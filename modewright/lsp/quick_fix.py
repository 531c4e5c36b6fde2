"""Quick fixes: offer the replacements that the help of a problem contains."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from lsprotocol import types

from modewright.lsp.diagnostics import SOURCE

REPLACEMENT_PATTERNS = (
    re.compile(r"^help: did you mean `(.+?)`\?", re.MULTILINE),
    re.compile(r"^help: write `(\S+?)`:", re.MULTILINE),
)
"""Forms of help texts that contain the replacement for the span of the problem."""


def quick_fixes(uri: str, diagnostics: Sequence[types.Diagnostic]) -> Iterator[types.CodeAction]:
    """Yield an edit for each problem of this server whose help contains a replacement.

    The forms of such a help are REPLACEMENT_PATTERNS, of which the first match counts. The edit
    replaces the range of the problem in the file `uri`. Problems of other files are skipped.
    """
    for problem in diagnostics:
        found = [match for each in REPLACEMENT_PATTERNS if (match := each.search(problem.message))]
        if not found or problem.source != SOURCE or problem.related_information:
            continue
        text = found[0].group(1)
        edit = types.TextEdit(problem.range, text)
        yield types.CodeAction(
            title=f"Write `{text}`",
            kind=types.CodeActionKind.QuickFix,
            diagnostics=[problem],
            is_preferred=True,
            edit=types.WorkspaceEdit(changes={uri: [edit]}),
        )
