"""Mode name: what each part of the name of a mode or region stands for, where it is written.

As in `language/chart_target.py`: a path from the root is exact, else a name is looked for outwards,
a transition's beside its mode first and inside it last.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from language.model import CHART
from modewright.lsp.namespace import Declared, Namespace, mode_path

Part = tuple[int, str]
"""A part of a dotted name: where it begins, and its text."""
Meaning = Iterator[tuple[Part, Declared | None]]
Keys = tuple[str, ...]


def parts_of(text: str) -> list[Part]:
    """Return the parts of a dotted name."""
    found, offset = [], 0
    for part in text.split("."):
        found.append((offset, part))
        offset += len(part) + 1
    return found


def mode_parts(space: Namespace, parts: Sequence[Part], path: Keys = ()) -> Meaning:
    """Yield the parts of a name of a mode with the modes and regions that they name.

    `path` are the keys that lead to where it is written.
    """
    if len(parts) > 1 and parts[0][1] == CHART:
        yield parts[0], space.names.get(("region", CHART))
        parts, path = parts[1:], ()
    scopes = _scopes(path, is_dotted=len(parts) > 1)
    whole = ".".join(text for _, text in parts)
    reached = [scope for scope in scopes if _declared(space, scope, whole)]
    begun = [scope for scope in scopes if _declared(space, scope, parts[0][1])]
    scope = next(iter((*reached, *begun)), None)
    for k, part in enumerate(parts if scope is not None else ()):
        assert scope is not None
        yield part, _declared(space, scope, ".".join(text for _, text in parts[: k + 1]))


def _declared(space: Namespace, scope: str, name: str) -> Declared | None:
    name = f"{scope}.{name}" if scope else name
    return space.names.get(("mode", name)) or space.names.get(("region", name))


def _scopes(path: Keys, is_dotted: bool) -> list[str]:
    """Return the modes and regions in which a name is looked for, in this order."""
    around, last = mode_path(path).split("."), ""
    if "transition_table" in path:
        row = path[path.index("transition_table") + 2 :][:1]
        last = ".".join((*filter(None, around), *row))
    elif "transitions" in path:
        last = ".".join(around)
        around = around[:-1]
    outwards = [".".join(around[:k]) for k in range(len(around), 0, -1)]
    ordered = ["", *outwards, last] if is_dotted else [*outwards, "", last]
    return list(dict.fromkeys(ordered))
