"""Diagrams: what stands in them, and that nothing lies on anything else."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

import modewright as mw
from language.overlays.expand_document import parse_document
from language.text.diagnostic import Source, SpecError
from modewright.cli.app import app
from modewright.cli.common.exit_codes import run_with_exit_code
from modewright.diagram.diagram import Diagram, diagram_of
from modewright.diagram.layered_layout import Edge, compute_layout

ROOT = Path(__file__).parents[3]
NESTED = """\
language: 1
automaton: nested
regions:
  chart:
    initial: run
    modes:
      run:
        initial: slow
        transitions: {fault: {when: not ok, wait: 30 ms, priority: 1}}
        modes:
          slow: {transitions: {fast: {when: v > 3 m/s}, fault: {when: v > 9 m/s, priority: 2}}}
          fast: {transitions: {slow: {when: v < 2 m/s}, fast: {when: after(2 s)}}}
      fault: {entry: {T: 0 N*m}, transitions: {run: {event: clear, when: ok}}}
  thermal:
    initial: cool
    modes:
      cool: {transitions: {warm: {when: temp > 60 degC}}}
      warm: {transitions: {cool: {when: temp < 55 degC}}}
"""


def nested() -> Diagram:
    return diagram_of(parse_document(Source("nested.yaml"), NESTED))


def test_mermaid_of_the_driveline_is_what_a_reviewer_would_write(update: bool) -> None:
    golden = Path(__file__).parent / "golden" / "driveline.mmd"
    text = mw.graph("driveline", ROOT).mermaid()
    if update:
        golden.write_text(text)
    assert text == golden.read_text()


def test_the_svg_holds_every_mode_guard_wait_priority_and_reset() -> None:
    text = shown(mw.graph("estimator", ROOT).svg())
    for part in ("drive", "gap", "coast", "T_hs <= 0 N*m", "for t_wait", "(1) in(", "(2) in("):
        assert part in text
    assert "/ theta_b = alpha" in shown(mw.graph("driveline", ROOT).svg())
    assert "/ rewind: until T_hs <= 0 N*m" in shown(mw.graph("hko", ROOT).svg())


def shown(svg: str) -> str:
    root = ElementTree.fromstring(svg)
    return "\n".join(element.text or "" for element in root.iter() if element.tag.endswith("text"))


def test_nested_modes_stand_in_their_outer_mode_and_regions_beside_each_other() -> None:
    lines = [line.strip() for line in nested().mermaid().splitlines()]
    assert lines.count("--") == 1
    inside = lines[lines.index('state "run" as chart__run {') : lines.index("}")]
    assert "[*] --> chart__run__slow" in inside
    assert "chart__run__slow --> chart__run__fast : v > 3 m/s" in inside
    assert "chart__run__fast --> chart__run__fast : after(2 s)" in inside
    assert "chart__run --> chart__fault : (1) not ok<br/>for 30 ms" in lines
    assert "chart__fault --> chart__run : on clear and ok" in lines


def test_a_transition_that_leaves_an_outer_mode_starts_there_and_names_its_source() -> None:
    wanted = "chart__run --> chart__fault : from slow<br/>(2) v > 9 m/s"
    assert wanted in nested().mermaid()
    assert "from slow" in shown(nested().svg())


def test_a_transition_with_several_targets_has_an_arrow_to_each_one_without_stays() -> None:
    text = NESTED.replace(
        "run: {event: clear, when: ok}", "on_both: {to: [run, run.fast], event: e}"
    )
    text = text.replace("slow: {when: v < 2 m/s}", "slow: {to: [], when: v < 2 m/s}")
    arrows = {(a.source, a.target) for a in diagram_of(parse_document(Source("a"), text)).arrows}
    both = {(("fault",), ("run",)), (("fault",), ("run", "fast"))}
    ends = {tuple(tuple(p for p in path if p != "chart") for path in pair) for pair in arrows}
    assert both <= ends
    assert (("run", "fast"), ("run", "slow")) not in ends
    stays = "chart__run__fast --> chart__run__fast : v < 2 m/s<br/>/ stays"
    assert stays in diagram_of(parse_document(Source("a"), text)).mermaid()


def test_what_a_mode_takes_from_a_template_is_shown() -> None:
    text = """\
language: 1
automaton: templated
templates: {contact: {equations: {w: 0 rad/s}, transitions: {gap: {when: "T < 0 N*m"}}}}
initial: drive
modes:
  drive: {like: contact}
  gap: {transitions: {drive: {when: "T > 0 N*m"}}}
"""
    lines = diagram_of(parse_document(Source("x"), text)).mermaid().splitlines()
    assert '    state "drive<br/>w = 0 rad/s" as drive' in lines
    assert "    drive --> gap : T < 0 N*m" in lines


def test_the_same_spec_gives_the_same_bytes() -> None:
    assert nested().svg() == nested().svg()


def test_no_label_holds_a_character_that_ends_it_in_mermaid() -> None:
    text = NESTED.replace("when: ok}", 'when: ok, memory: continue, about: "a;b"}')
    for line in diagram_of(parse_document(Source("x"), text)).mermaid().splitlines()[2:]:
        label = re.sub(r"#\d+;", "", line.partition(" : ")[2])
        assert ";" not in label and ":" not in label


def test_a_spec_with_problems_is_refused_with_its_places() -> None:
    with pytest.raises(SpecError):
        mw.graph("no_such_automaton", ROOT)


@pytest.mark.parametrize("ending", ["svg", "mmd", "md"])
def test_the_command_writes_by_the_ending(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    out = tmp_path / f"graph.{ending}"
    assert (
        run_with_exit_code(
            lambda: app(["graph", "driveline", "-o", str(out)], standalone_mode=False)
        )
        == 0
    )
    starts = {"svg": "<svg ", "mmd": "stateDiagram-v2\n", "md": "```mermaid\nstateDiagram-v2\n"}
    assert out.read_text().startswith(starts[ending])


sizes = st.tuples(st.floats(20, 200), st.floats(15, 90))


@st.composite
def graphs(draw: st.DrawFn) -> tuple[list[tuple[float, float]], list[Edge]]:
    boxes = draw(st.lists(sizes, min_size=1, max_size=20))
    ends = st.integers(0, len(boxes) - 1)
    drawn = draw(st.lists(st.tuples(ends, ends, sizes), max_size=40))
    return boxes, [Edge(a, b, label) for a, b, label in drawn if a != b]


@given(graphs())
def test_no_box_and_no_label_lies_on_another(
    graph: tuple[list[tuple[float, float]], list[Edge]],
) -> None:
    boxes, edges = graph
    placed = compute_layout(boxes, edges)
    rectangles = [(x, y, w, h) for (x, y), (w, h) in zip(placed.boxes, boxes, strict=True)]
    rectangles += [
        (*route.label, *edge.label) for route, edge in zip(placed.routes, edges, strict=True)
    ]
    for (x, y, w, h), (u, v, p, q) in combinations(rectangles, 2):
        assert x + w <= u + 1e-6 or u + p <= x + 1e-6 or y + h <= v + 1e-6 or v + q <= y + 1e-6
    for x, y, w, h in rectangles:
        assert x >= -1e-6 and y >= -1e-6
        assert x + w <= placed.size[0] + 1e-6 and y + h <= placed.size[1] + 1e-6


@given(graphs())
def test_every_arrow_starts_at_its_source_and_ends_at_its_target(
    graph: tuple[list[tuple[float, float]], list[Edge]],
) -> None:
    boxes, edges = graph
    placed = compute_layout(boxes, edges)
    for edge, route in zip(edges, placed.routes, strict=True):
        for node, (px, py) in (
            (edge.source, route.pieces[0][0]),
            (edge.target, route.pieces[-1][-1]),
        ):
            (x, y), (w, h) = placed.boxes[node], boxes[node]
            assert min(abs(px - x), abs(px - x - w)) < 1e-6
            assert y - 1e-6 <= py <= y + h + 1e-6


def test_the_mode_that_faults_lead_to_says_so() -> None:
    rule = "a_fault_enters_the_fault_mode_before_any_other_transition"
    text = mw.graph("guarded", ROOT / "tests" / "semantics" / "rules" / rule).mermaid()
    (line,) = (line for line in text.splitlines() if "entered on a fault" in line)
    assert line.strip().startswith('state "safe<br/>entered on a fault')


CHART = """\
language: 1
automaton: chart
initial: run
modes:
  run:
    initial: slow
    modes:
      slow: {update: {n: n + 1}, transitions: {fast: {event: [go, hop], when: u > 1}}}
      fast: {transitions: {over: {when: u > 9}}}
      over: {final: true}
      back: {history: deep, initial: slow}
  idle: {}
transition_table:
  columns: {start: {event: go}, hot: {when: u > 5, wait: 30 ms}}
  rows: {run: {start: stay, hot: idle}, idle: {start: run.back, hot: stay}}
"""


def test_transitions_of_tables_are_drawn_and_modes_that_are_none() -> None:
    drawn = diagram_of(parse_document(Source("chart.yaml"), CHART))
    lines = [line.strip() for line in drawn.mermaid().splitlines()]
    for line in (
        "run --> idle : u > 5<br/>for 30 ms",
        "idle --> run : to back<br/>on go",
        'state "over<br/>final" as run__over',
        "run__over --> [*]",
        'state "(H) back<br/>deep history, else slow" as run__back',
        'state "slow<br/>update / n = n + 1" as run__slow',
        "run__slow --> run__fast : on go or hop and u > 1",
    ):
        assert line in lines, lines
    text = shown(drawn.svg())
    for part in ("for 30 ms", "to back", "final", "deep history, else slow", "update / n = n + 1"):
        assert part in text
