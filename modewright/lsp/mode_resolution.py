"""Mode resolution: find the modes and regions that the parts of a name denote.

The rules are those of `language/model/chart_paths.py`: a path from the root is exact, else the
search goes outwards. A transition's target is searched beside its mode first and inside it last.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from language.ir.root_region import CHART
from modewright.lsp.symbol_table import Symbol, SymbolTable, mode_path

NamePart = tuple[int, str]
"""A part of a dotted name: its offset and its text."""
Resolution = Iterator[tuple[NamePart, Symbol | None]]
"""Parts of a name with their symbols, None for unknown ones."""
KeyPath = tuple[str, ...]


def split_name(text: str) -> list[NamePart]:
    """Return the parts of a name between dots, each with its offset in the name."""
    parts, offset = [], 0
    for part in text.split("."):
        parts.append((offset, part))
        offset += len(part) + 1
    return parts


def resolve_mode_parts(
    symbols: SymbolTable, parts: Sequence[NamePart], path: KeyPath = ()
) -> Resolution:
    """Yield each part of the name of a mode with the mode or region that it denotes.

    `path` are the keys that lead to the name; they determine where it is searched. A scope in which
    the whole name is known takes precedence over one in which only the first part is; unknown parts
    have None. Yields nothing if no scope has the first part. A leading `chart` is the main region,
    whose rest is searched from the root.
    """
    if len(parts) > 1 and parts[0][1] == CHART:
        yield parts[0], symbols.names.get(("region", CHART))
        parts, path = parts[1:], ()
    scopes = _lookup_scopes(path, is_dotted=len(parts) > 1)
    whole = ".".join(text for _, text in parts)
    reached = [scope for scope in scopes if _find_mode(symbols, scope, whole)]
    partial = [scope for scope in scopes if _find_mode(symbols, scope, parts[0][1])]
    scope = next(iter((*reached, *partial)), None)
    for k, part in enumerate(parts if scope is not None else ()):
        assert scope is not None
        yield part, _find_mode(symbols, scope, ".".join(text for _, text in parts[: k + 1]))


def _find_mode(symbols: SymbolTable, scope: str, name: str) -> Symbol | None:
    """Return the mode or region of a name in a scope; None if there is none."""
    name = f"{scope}.{name}" if scope else name
    return symbols.names.get(("mode", name)) or symbols.names.get(("region", name))


def _lookup_scopes(path: KeyPath, is_dotted: bool) -> list[str]:
    """Return the scopes in which a name is searched, in this order."""
    enclosing, last = mode_path(path).split("."), ""
    if "transition_table" in path:
        row = path[path.index("transition_table") + 2 :][:1]
        last = ".".join((*filter(None, enclosing), *row))
    elif "transitions" in path:
        last = ".".join(enclosing)
        enclosing = enclosing[:-1]
    outwards = [".".join(enclosing[:k]) for k in range(len(enclosing), 0, -1)]
    ordered = ["", *outwards, last] if is_dotted else [*outwards, "", last]
    return list(dict.fromkeys(ordered))
