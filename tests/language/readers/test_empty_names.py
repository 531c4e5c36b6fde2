"""Empty names: a name that is '' or left out is a problem at its place, never a defect."""

from __future__ import annotations

from pathlib import Path

import pytest

from language.text.diagnostic import Problem
from language.text.document import MappingNode, ScalarNode, SequenceNode, YamlNode
from modewright.api.spec_check import check_spec
from tests.language.spec_builders import document

SAMPLED = """\
language: 1
automaton: here
period: 1 ms
numbers: float64
parameters:
  curve: {table: {over: u, points: {0: 1, 1: 2}}}
inputs: {u: {unit: 1}}
events: {go: {}}
faults: {broken: {}}
fault_mode: stopped
regions:
  left: {initial: low, modes: {low: {transitions: {up: {to: high, when: u > 1}}}, high: {}}}
  chart:
    initial: moving
    modes:
      moving: {transitions: {stop: {to: stopped, when: u > 2}}}
      stopped: {}
"""
CONTINUOUS = """\
language: 1
automaton: here
method: rk4
step: 1 ms
numbers: float64
inputs: {u: {unit: 1}}
states: {x: {unit: 1, initial: 0}}
initial: up
modes:
  up: {flow: {x: der(x) = 1 / 1 s}, transitions: {down: {to: down, when: x > 1}}}
  down: {flow: {x: der(x) = -1 / 1 s}}
outputs: [x]
"""
CHART = """\
language: 1
automaton: here
period: 1 ms
numbers: float64
inputs: {u: {unit: 1}}
events: {go: {from: input}, done: {}}
initial: outer
modes:
  outer:
    initial: inner
    modes:
      inner: {transitions: {other: {to: other, event: go, raise: [done]}}}
      other: {}
      last: {history: deep, initial: inner}
  away: {transitions: {back: {to: outer.last, event: done}}}
"""
REFERENCES = ("initial", "to", "event", "raise", "over", "fault_mode")


def places(node: YamlNode, key: str = "") -> list[tuple[str, ScalarNode]]:
    """Return all scalars of a tree with the last key above them."""
    if isinstance(node, ScalarNode):
        return [(key, node)]
    if isinstance(node, SequenceNode):
        return [found for item in node.nodes for found in places(item, key)]
    assert isinstance(node, MappingNode)
    return [found for entry in node for found in places(entry.node, entry.key)]


@pytest.mark.parametrize("text", [SAMPLED, CONTINUOUS, CHART], ids=["sampled", "flow", "chart"])
def test_an_empty_name_is_refused_where_it_is_written(text: str, tmp_path: Path) -> None:
    spec = tmp_path / "here.yaml"
    assert [p for p in _problems(spec, text) if p.severity == "error"] == []
    scalars = [found for found in places(document(text).root) if found[0] in REFERENCES]
    assert len(scalars) > 2
    for key, scalar in scalars:
        lines = text.splitlines()
        line = lines[scalar.span.line - 1]
        begin = scalar.span.column - 1
        new = f"{line[:begin]}''{line[begin + len(scalar.text) :]}"
        changed = [*lines[: scalar.span.line - 1], new, *lines[scalar.span.line :]]
        found = _problems(spec, "\n".join(changed) + "\n")
        there = [(p.span.line, p.span.column) for p in found if p.severity == "error"]
        assert {(scalar.span.line, begin + 1 + shift) for shift in (0, 1)} & {*there}, (
            key,
            new,
            found,
        )


@pytest.mark.parametrize("kind", ["automaton", "system", "scenario", "effect", "variant", "study"])
def test_a_document_with_an_empty_name_is_refused(kind: str, tmp_path: Path) -> None:
    for empty in ("''", "", '""'):
        found = _problems(tmp_path / "here.yaml", f"language: 1\n{kind}: {empty}\n")
        assert any(p.severity == "error" and p.span.line == 2 for p in found)


def _problems(spec: Path, text: str) -> tuple[Problem, ...]:
    """Return the problems of a text as a file of a project."""
    spec.write_text(text)
    return check_spec(str(spec), spec.parent).problems
