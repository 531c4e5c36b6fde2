"""What tests reach of a spec, derived by hand; probes change no bit of a run."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from engine.simulation.instance_programs import automata_of
from engine.simulation.simulate import simulate
from engine.simulation.stimuli import resolve_recording
from expectation.coverage_measurement import (
    Coverage,
    instrument_programs,
    measure_coverage,
    merge_coverages,
)
from language.ir.ops import Store
from language.ir.traversal import walk_ops
from language.loading.load import load_automaton
from language.overlays.expand_document import Project
from modewright.api import spec_tests as tests
from modewright.api.spec_coverage import coverage_diagram
from modewright.cli.app import app
from modewright.diagram.svg import SHADE_COLOURS
from tests.expectation.latch_project import AUTOMATON, HEAD, write_project

ROOT = Path(__file__).parent.parent.parent


def reached(folder: Path, head: str = HEAD) -> Coverage:
    path = write_project(folder, "any: {always: level < 20 V}", head=head)
    (found,) = merge_coverages(measure_coverage(tests.load_test(str(path), folder)))
    return found


def test_everything_is_reached(tmp_path: Path) -> None:
    found = reached(tmp_path)
    assert found.count() == {
        "modes": (2, 2), "transitions": (2, 2), "outcomes": (4, 4), "conditions": (2, 2),
    }  # fmt: skip
    assert found.list_missed() == []


def test_what_is_not_reached_is_listed(tmp_path: Path) -> None:
    found = reached(tmp_path, HEAD.replace("20 ms: -2 V, 30 ms: 3 V", "20 ms: 3 V"))
    assert found.count() == {
        "modes": (2, 2), "transitions": (1, 2), "outcomes": (3, 4), "conditions": (1, 2),
    }  # fmt: skip
    assert found.list_missed() == [
        "`modes.high.transitions.low` was not taken",
        "`modes.high.transitions.low.when`: `level < -1 V` was never true",
    ]


def test_a_wait_is_no_condition(tmp_path: Path) -> None:
    """At 5 and 6 ms the guard is true, the transition not taken: it fires at 7 ms."""
    head = HEAD.replace("20 ms: -2 V, 30 ms: 3 V", "6 ms: 0 V")
    found = reached(tmp_path, head)
    assert found.count() == {
        "modes": (1, 2), "transitions": (0, 2), "outcomes": (2, 4), "conditions": (1, 2),
    }  # fmt: skip
    assert found.list_missed() == [
        "mode `high` was not entered",
        "`modes.low.transitions.high` was not taken",
        "`modes.high.transitions.low` was not taken",
        "`modes.high.transitions.low.when` was never read",
    ]


def test_what_tests_reach_is_summed(tmp_path: Path) -> None:
    late = HEAD.replace("5 ms: 2 V, 20 ms: -2 V, 30 ms: 3 V", "5 ms: 0 V")
    parts = [reached(tmp_path, HEAD.replace("20 ms: -2 V, ", "")), reached(tmp_path, late)]
    (both,) = merge_coverages(parts)
    assert both.count()["transitions"] == (1, 2)
    first, second = (part.combinations for part in parts)
    joined = {key: first.get(key, set()) | second.get(key, set()) for key in both.combinations}
    assert both.combinations == joined


def test_probes_change_no_bit_of_a_run_and_each_guard_has_one() -> None:
    test = tests.load_test("tip_in_crosses_the_gap", ROOT)
    scenario = resolve_recording(test.scenario)
    decisions, programs, arrays = instrument_programs(automata_of(test.system, scenario))
    plain = simulate(test.system, scenario)
    with_probes = simulate(test.system, scenario, programs=programs)
    assert with_probes.events == plain.events
    for name, values in plain.signals.items():
        assert np.array_equal(with_probes.signals[name], values)
    for name, program in programs.items():
        ops = [op for block in program.blocks.values() for op in walk_ops(block)]
        stored = {op.array for op in ops if isinstance(op, Store) and "probe." in op.array}
        assert stored == set(arrays[name].values())
        assert set(arrays[name]) == {decision.key for decision in decisions[name]}


def test_conditions_that_change_together_are_not_shown_to_matter(tmp_path: Path) -> None:
    path = write_project(tmp_path, "any: {always: level < 20 V}")
    spec = tmp_path / "spec" / "latch.yaml"
    spec.write_text(spec.read_text().replace("level > 1 V", "level > 1 V and level < 1.5 V"))
    (found,) = merge_coverages(measure_coverage(tests.load_test(str(path), tmp_path)))
    assert found.list_missed() == [
        "mode `high` was not entered",
        "`modes.low.transitions.high` was not taken",
        "`modes.low.transitions.high.when`: `level > 1 V` was not shown to matter",
        "`modes.low.transitions.high.when`: `level < 1.5 V` was not shown to matter",
        "`modes.high.transitions.low` was not taken",
        "`modes.high.transitions.low.when` was never read",
    ]


def test_coverage_colours_the_graph_and_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_project(tmp_path, "any: {always: level < 20 V}")
    path.write_text(path.read_text().replace("20 ms: -2 V, 30 ms: 3 V", "20 ms: 3 V"))
    spec = tmp_path / "spec" / "latch.yaml"
    spec.write_text(spec.read_text().replace("level > 1 V", "level > 1 V and level < 9 V"))
    monkeypatch.chdir(tmp_path)
    command = ["test", "--interpreted", "--coverage", "--graphs", "out"]
    told = CliRunner().invoke(app, command).output
    assert "latch: 2 of 2 modes, 1 of 2 transitions, 3 of 4 outcomes, 1 of 3 conditions" in told
    assert "`level < 9 V` was never false" in told
    found = (tmp_path / "out" / "latch.svg").read_text()
    assert found.count(f'stroke="{SHADE_COLOURS["covered"]}" stroke-width="1.6"') == 2  # both modes
    arrow = 'stroke="{}" stroke-width="1.3"[^>]*stroke-dasharray'
    assert re.search(arrow.format(SHADE_COLOURS["missed"]), found)
    assert (
        not re.search(arrow.format(SHADE_COLOURS["part"]), found) and SHADE_COLOURS["part"] in found
    )
    assert "? level &lt; 9 V" in found
    drawn = CliRunner().invoke(app, ["graph", "latch", "--tests", "--out", "same.svg"])
    assert drawn.exit_code == 0 and Path("same.svg").read_text() == found
    assert CliRunner().invoke(app, ["graph", "latch", "--tests"]).exit_code == 2
    found = json.loads(CliRunner().invoke(app, [*command, "--json"]).stdout)["coverage"][0]
    assert [way["taken"] for way in found["transitions"]] == [True, False]
    assert [each["shown"] for each in found["transitions"][0]["conditions"]] == [
        "unique cause", "always true",
    ]  # fmt: skip


@pytest.mark.parametrize(
    "spec",
    [
        "after_counts_the_time_since_entry_of_the_source/spec/stages.yaml",
        "edges_of_a_continuous_automaton_are_events_of_their_argument/spec/edges.yaml",
        "every_and_changed_are_events_of_a_continuous_automaton/spec/beats.yaml",
        "every_beats_from_entry_and_changed_needs_an_earlier_instant/spec/beats.yaml",
    ],
)
def test_guards_with_memory_are_one_condition_with_a_probe(spec: str) -> None:
    path = ROOT / "tests" / "semantics" / "rules" / spec
    automaton = load_automaton(str(path), Project(path.parent.parent))
    decisions, _, arrays = instrument_programs({"one": (automaton, [])})
    assert set(arrays["one"]) == {decision.key for decision in decisions["one"]}
    assert {len(decision.conditions) for decision in decisions["one"]} <= {0, 1, 2}


def test_a_guard_with_too_many_conditions_is_told(tmp_path: Path) -> None:
    path = write_project(tmp_path, "any: {always: level < 20 V}")
    spec = tmp_path / "spec" / "latch.yaml"
    many = " and ".join(f"level > {k / 10} V" for k in range(1, 12))
    spec.write_text(spec.read_text().replace("level > 1 V", many))
    (found,) = measure_coverage(tests.load_test(str(path), tmp_path))
    assert found.list_missed() == [
        "`modes.low.transitions.high.when` is not measured: 11 conditions"
    ]


@pytest.mark.parametrize("more", ["", "micro_steps: 2\n"])
def test_what_stands_in_the_region_chart_has_the_path_of_the_file(
    tmp_path: Path, more: str
) -> None:
    path = write_project(tmp_path, "any: {always: level < 20 V}")
    spec = tmp_path / "spec" / "latch.yaml"
    head, _, rest = AUTOMATON.partition("initial: low\nmodes:")
    modes, _, outputs = rest.partition("outputs")
    inner = f"initial: low\nmodes:{modes}".replace("\n", "\n    ").rstrip()
    spec.write_text(f"{head}{more}regions:\n  chart:\n    {inner}\noutputs{outputs}")
    path.write_text(path.read_text().replace("5 ms: 2 V, 20 ms: -2 V, 30 ms: 3 V", "5 ms: 0 V"))
    (found,) = measure_coverage(tests.load_test(str(path), tmp_path))
    assert found.list_missed() == [
        "mode `high` was not entered",
        "`regions.chart.modes.low.transitions.high` was not taken",
        "`regions.chart.modes.low.transitions.high.when`: `level > 1 V` was never true",
        "`regions.chart.modes.high.transitions.low` was not taken",
        "`regions.chart.modes.high.transitions.low.when` was never read",
    ]
    (chart,) = coverage_diagram(found, tmp_path).regions
    assert {box.name: box.shade for box in chart.modes} == {"low": "covered", "high": "missed"}
