"""Modes that nothing enters are told, as a warning with its place."""

from __future__ import annotations

from pathlib import Path

import modewright as mw

SPEC = """language: 1
automaton: lamp
period: 1 ms
numbers: float64
inputs: {on_off: {type: bool}}
initial: dark
modes:
  dark: {transitions: {lit: {when: on_off}}}
  lit: {transitions: {dark: {when: not on_off}}}
  broken: {transitions: {dark: {when: on_off}}}
outputs: [mode]
"""


def test_a_mode_that_is_never_entered_is_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "lamp.yaml"
    path.write_text(SPEC)
    problems = mw.check(str(path))
    assert [(p.severity, p.kind, p.span.line, p.label) for p in problems] == [
        ("warning", "unreached", 10, "mode `broken` is never entered")
    ]


def test_a_mode_that_is_entered_through_others_is_fine(tmp_path: Path) -> None:
    path = tmp_path / "lamp.yaml"
    path.write_text(SPEC.replace("{dark: {when: not on_off}}", "{broken: {when: not on_off}}"))
    assert mw.check(str(path)) == []
