"""Back: which transitions of a random sampled automaton have a `rewind`, and to what."""

from __future__ import annotations

import re
from random import Random

from tests.lockstep.random_specs.models import PlantModel

WISH = re.compile(r"<back (\w+) (\w+)>")
"""Where a transition from a mode to another may go back."""
MEMORY = re.compile(r"rising|falling|after|previous|delay|in\(|\b(b|i|s|e_\d)\b")
"""What `until` is not asked of, and equations that may read it."""
WITHINS_MS = (7, 10, 25, 80, 640)
"""Less than a tick, whole ticks, and between them, up to the most that are kept."""


def with_rewinds(draw: Random, lines: list[str], model: PlantModel | None) -> list[str]:
    """Return the lines with some wishes granted: then runs have one substep, sources one flow."""
    carriers = _carriers(lines)
    wishes = [wish.groups() for line in lines for wish in WISH.finditer(line)]
    granted = [way for way in wishes if "runs:" in carriers[way[1]] and draw.random() < 0.6]
    if model is None or draw.random() < 0.2:
        granted = []
    sources = {source for source, _ in granted}

    def written(wish: re.Match[str]) -> str:
        if model is None or wish.groups() not in granted:
            return ""
        return f", rewind: {_rewind(draw, model, wish.string)}"

    mode, found = "", []
    for line in lines:
        mode = _mode(line) or mode
        if granted:
            line = line.replace("substeps: 2", "substeps: 1")
        if mode in sources and line.startswith("    runs:"):
            line = re.sub(r", events: \d", ", follow: false", line)
        found.append(WISH.sub(written, line))
    return found


def _rewind(draw: Random, model: PlantModel, line: str) -> str:
    """Return a rewind to where the guard itself turned true, or to anything."""
    (state, unit, _), _ = model.states
    relation = f"{state} {draw.choice(('<', '>='))} {draw.choice((0, -0.05, 0.1, 0.3))} {unit}"
    guard = line.split('when: "')[1].split('"')[0]
    until = draw.choice((relation, f"q_{draw.randrange(4)}", f"{relation} or q_0"))
    if not MEMORY.search(guard) and draw.random() < 0.7:
        until = guard
    return f'{{until: "{until}", within: {draw.choice(WITHINS_MS)} ms}}'


def _mode(line: str) -> str:
    """Return the mode that a line begins, '' if none."""
    match = re.fullmatch(r"  (m_\d):", line)
    return match[1] if match else ""


def _carriers(lines: list[str]) -> dict[str, str]:
    """Return, by mode, the line that says who carries the states."""
    found: dict[str, str] = {}
    mode = ""
    for line in lines:
        mode = _mode(line) or mode
        found.setdefault(mode, "")
        if re.match(r"    (runs|observer):", line):
            found[mode] = line
    return found
