"""Mention: every place of a spec that names something, and what it names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from language.model import CHART
from language.problem import Span
from modewright.lsp.mode_name import Meaning, Part, mode_parts, parts_of
from modewright.lsp.name import ASKED, Name
from modewright.lsp.namespace import Declared, Namespace, column_name, mode_path, namespace
from modewright.lsp.world import World

PREFIXES = ("initial", "inputs")
"""What stands before names in studies: `initial.plant.theta_d`, `inputs.T_req.start`."""
OWN = ("template", "fault")
"""What is named inside one spec only; an event of a study is a mode that is entered."""
OF_INSTANCE = (("values",), ("inputs",))
"""Sections of an instance whose keys are its names, not ours."""
SPECS = ("automaton", "system", "scenario", "map", "calibration", "spec", "effect")


@dataclass(frozen=True)
class Mention:
    """A part of a name that stands for something; `path` are the keys that lead to it."""

    declared: Declared
    span: Span
    path: tuple[str, ...]
    is_key: bool

    @property
    def is_declaration(self) -> bool:
        """Whether this is where the thing gets its name; an equation does so in several modes."""
        is_equation = self.is_key and self.path[-2:-1] == ("equations",)
        return self.span == self.declared.span or (is_equation and self.is_here)

    @property
    def is_here(self) -> bool:
        """Whether this stands in the file that declares the thing."""
        return Path(self.span.source.name).resolve() == self.declared.file


def mentions(world: World, path: Path) -> list[Mention]:
    """Return what a spec names, in the order of the file."""
    space = namespace(world, path)
    found = []
    for name in world.names(path) if space else ():
        assert space is not None
        for (offset, part), declared in meaning(world, space, name):
            if declared:
                span = name.span.inside(offset, len(part))
                found.append(Mention(declared, span, name.path, name.is_key))
    return found


def mentions_of(world: World, declared: Declared) -> list[Mention]:
    """Return where something is named, in the whole project and in the file that declares it."""
    files = dict.fromkeys((declared.file, *(path for path, _ in world.documents())))
    return [
        mention
        for path in files
        for mention in mentions(world, path)
        if mention.declared.identity == declared.identity
    ]


def meaning(world: World, space: Namespace, name: Name) -> Meaning:
    """Yield the parts of a dotted name with what each stands for."""
    whole = (0, name.text)
    if name.of in SPECS:
        yield whole, _spec(world, space, name)
    elif name.of in ("mode", "region") and name.path[-2:-1] in (("modes",), ("regions",)):
        yield whole, _of_key(space, name)
    elif name.of == "mode" and name.owner is not None:
        yield from _mode_of(*_owner(space, name.owner), parts_of(name.text))
    elif name.of == "mode":
        yield from mode_parts(space, parts_of(name.text), name.path)
    elif name.of == "column":
        yield whole, space.names.get(("column", column_name(name.path, name.text)))
    elif name.of in OWN or (name.of == "event" and (name.of, name.text) in space.names):
        yield whole, space.names.get((name.of, name.text))
    else:
        parts = parts_of(name.text)
        if name.of == "model_mode":
            yield from _of_model(space, parts)
            return
        region = region_of(space, name.owner or "") if name.of == "compared" else None
        if region:
            yield from _mode_of(*region, parts)
            return
        if name.of == "signal" and "measures" in name.path and space.model:
            space = space.model
        if name.path[:1] == ("instances",) and name.is_key and name.path[2:3] in OF_INSTANCE:
            space = space.instances.get(name.path[1], space)
        if space.document.kind == "study" and parts[0][1] in PREFIXES:
            parts = parts[1:]
        yield from _value(space, parts, name)


def _spec(world: World, space: Namespace, name: Name) -> Declared | None:
    if name.text == space.document.name:
        return space.names.get(("spec", name.text))
    path = world.find(name.text, space.file, is_effect=name.of == "effect")
    document = world.document(path) if path else None
    if path is None or document is None or document.name != name.text:
        return None
    return Declared(path, "spec", name.text, document.kind, document.name_span, document)


def _of_key(space: Namespace, name: Name) -> Declared | None:
    """Return the mode or region that a key declares."""
    inner = mode_path(name.path) if name.path[-2:] != ("regions", CHART) else CHART
    return space.names.get((name.of, inner))


def _value(space: Namespace, parts: Sequence[Part], name: Name) -> Meaning:
    """Yield what a name in an expression stands for; inside `in(...)` it is a mode."""
    if not parts:
        return
    head, *rest = parts
    declared = (
        space.names.get(("value", head[1])) if name.of not in ASKED.values() or rest else None
    )
    if declared is None and head[1] in space.instances:
        declared = space.names.get(("spec", head[1]))  # an automaton alone is its own instance
    if head[1] in space.instances and rest:
        yield head, declared
        yield from _value(space.instances[head[1]], rest, replace(name, path=()))
    elif space.model and rest and head[1] == space.model.document.name:
        yield from _of_model(space, parts)
    elif name.of == "asked_fault":
        yield head, space.names.get(("fault", head[1]))
    elif declared and not rest:
        yield head, declared
    else:
        found = list(mode_parts(space, parts, name.path))
        event = None if rest or found else space.names.get(("event", head[1]))
        yield from found or [(head, event or declared)]


def region_of(space: Namespace, path: str) -> tuple[Namespace, str] | None:
    """Return whose modes a name in an expression has, and of which region; None for other names.

    It is `mode`, `est.mode`, `est.gap`, or alone `gap`.
    """
    inner, region = _owner(space, path)
    if region.rpartition(".")[2] == "mode":
        return inner, region.rpartition(".")[0]
    return (inner, region) if ("region", region) in inner.names else None


def _owner(space: Namespace, path: str) -> tuple[Namespace, str]:
    """Return the automaton that a path begins with, and the region that is left of it."""
    head, _, region = path.partition(".")
    return (space.instances[head], region) if head in space.instances else (space, path)


def _mode_of(space: Namespace, region: str, parts: Sequence[Part]) -> Meaning:
    """Yield what a mode of a region stands for, or of the chart where none is named."""
    before = parts_of(region) if region else []
    found = list(mode_parts(space, [*before, *parts]))
    yield from found[len(before) :]


def _of_model(space: Namespace, parts: Sequence[Part]) -> Meaning:
    model = space.model
    if model and len(parts) > 1 and parts[0][1] == model.document.name:
        yield parts[0], model.names.get(("spec", parts[0][1]))
        yield from mode_parts(model, parts[1:])
