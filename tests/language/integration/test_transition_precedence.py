"""Which transition is first, one of a mode or one of a mode inside: told is what is certain."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw

HEAD = """language: 1
automaton: nested
period: 10 ms
numbers: float64
order: {order}
inputs: {{w: {{type: bool}}}}
events: {{go: {{from: input}}}}
initial: busy
modes:
  busy:
    initial: low
    transitions: {{rest: {{when: {outer}}}}}
    modes:
      low: {{transitions: {{high: {{when: {inner}}}}}}}
      high: {{transitions: {{low: {{when: {inner}}}}}}}
  rest: {{transitions: {{busy: {{{back}}}}}}}
outputs: [mode]
"""


SHADOWED = {"shadowed", "unreached"}


@pytest.mark.parametrize(
    ("order", "outer", "inner", "back", "expected"),
    [
        ("outer_first", "after(40 ms)", "after(50 ms)", "when: w", SHADOWED),
        ("outer_first", "after(40 ms)", "after(40 ms)", "when: w", SHADOWED),
        ("outer_first", "after(40 ms)", "after(30 ms)", "when: w", set()),
        ("outer_first", "after(40 ms) and w", "after(50 ms)", "when: w", set()),
        ("inner_first", "after(40 ms)", "after(40 ms)", "when: w", set()),  # `high` is younger
        ("inner_first", "after(40 ms)", "after(50 ms)", "when: w", set()),
        ("outer_first", "rising(w)", "rising(w)", "when: w", set()),  # in another activation
        ("inner_first", "rising(w)", "rising(w)", "when: w", set()),
        ("outer_first", "w", "rising(w)", "when: w", SHADOWED),
        ("outer_first", "after(40 ms)", "after(50 ms)", "event: go, history: deep", SHADOWED),
    ],
)
def test_a_mode_is_not_active_for_longer_than_one_around_it(
    order: str, outer: str, inner: str, back: str, expected: set[str], tmp_path: Path
) -> None:
    path = tmp_path / "nested.yaml"
    path.write_text(HEAD.format(order=order, outer=outer, inner=inner, back=back))
    found = {problem.kind for problem in mw.check(str(path))}
    assert found - {"unused", "stuck"} == expected


ENDING = """language: 1
automaton: ending
period: 10 ms
numbers: float64
inputs: {{w: {{type: bool}}, v: {{type: bool}}}}
initial: both
modes:
  both:
    transitions: {{done: {{}}, idle: {{when: {guard}}}}}
    initial: begin
    modes: {{begin: {{transitions: {{end: {{when: w}}}}}}, end: {{final: true}}}}
  done: {{transitions: {{both: {{when: w}}}}}}
  idle: {{transitions: {{both: {{when: w}}}}}}
outputs: [mode]
"""


@pytest.mark.parametrize(
    ("guard", "expected"), [("not in(both.end) and v", set()), ("v", {"priority"})]
)
def test_a_completion_is_enabled_in_final_modes_alone(
    guard: str, expected: set[str], tmp_path: Path
) -> None:
    path = tmp_path / "ending.yaml"
    path.write_text(ENDING.format(guard=guard))
    assert {problem.kind for problem in mw.check(str(path))} == expected
