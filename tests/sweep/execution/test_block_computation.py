"""A row of a study is what `simulate` gives for the same values, bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import modewright as mw
from engine.batch.batch import Batch, BatchResult
from engine.batch.interpreted_batch import run_interpreted_batch
from modewright.runtime.back_end_choice import run_batch, run_block
from sweep.design.variant_system import format_decimal
from sweep.execution.block_computation import compute_rows
from sweep.store.row import Block, Row
from tests.sweep.example_studies import STUDIES, make_study


def rows_of(name: str, *numbers: int) -> list[Row]:
    made = make_study(name)
    return [compute_rows(made, Block(k, k + 1), run_interpreted_batch)[0] for k in numbers]


def events(run: mw.Trajectory, instance: str, target: str) -> list[float]:
    return [event.time for event in run.events_of(instance) if event.target == target]


def scenario(folder: Path, name: str, *changes: tuple[str, str]) -> str:
    """Write a scenario of the tests with texts replaced; return its path."""
    text = (STUDIES / "spec" / f"{name}.yaml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / f"{name}.yaml").write_text(text)
    return str(folder / f"{name}.yaml")


@pytest.mark.parametrize("number", [3, 58])
def test_parameters_and_steps_are_those_of_simulate(number: int, tmp_path: Path) -> None:
    (row,) = rows_of("grid", number)
    step = f"1 s: {format_decimal(row.values['inputs.push.steps.1'])} m/s^2"
    run = mw.simulate(
        "oscillator",
        scenario(tmp_path, "swing", ("1 s: 0.5 m/s^2", step)),
        {
            "w": f"{format_decimal(row.values['w'])} rad/s",
            "d": f"{format_decimal(row.values['d'])} 1/s",
            "x_0": f"{format_decimal(row.values['x_1'])} m",
        },
        STUDIES,
    )
    x = run.signals["oscillator.x"]
    falls = events(run, "oscillator", "below")
    assert row.status == "done"
    assert row.measures == {
        "t_1": falls[0], "falls": len(falls), "peak": float(np.max(np.abs(x))),
        "final": float(x[-1]), "twice": 2.0 * falls[0], "soon": falls[0] < 0.5,
    }  # fmt: skip


def test_times_noise_periods_and_starts_are_those_of_simulate(tmp_path: Path) -> None:
    """The last variant: sd 0.1 m, period 100 ms, step at 0.7003 s, turns 0.3, other noise."""
    (row,) = rows_of("seen", 31)
    system = (STUDIES / "spec" / "measured.yaml").read_text().replace("sd: 0.05 m", "sd: 0.1 m")
    (tmp_path / "measured.yaml").write_text(system.replace("of: tracker", "of: tracker.yaml"))
    tracker = (STUDIES / "spec" / "tracker.yaml").read_text()
    (tmp_path / "tracker.yaml").write_text(tracker.replace("50 ms", "100 ms"))
    start = ("horizon:", "initial: {plant.v: -0.3 m/s}\nhorizon:")
    changes = (("1 s: 0.5", "0.7003 s: 0.5"), ("seed: 5", "seed: 6"), start)
    run = mw.simulate(
        str(tmp_path / "measured.yaml"),
        scenario(tmp_path, "pushed", *changes),
        {"w": f"{format_decimal(0.3 * 6.25)} rad/s"},
        STUDIES,
    )
    low, seen = events(run, "plant", "below"), events(run, "eye", "low")
    error = run.signals["s"] - run.signals["plant.x"]
    assert (row.seed, row.replicate, row.values["turns"]) == (6, 1, 0.3)
    assert row.measures["t_low"] == low[0]
    assert row.measures["final"] == run.signals["plant.x"][-1]
    assert row.measures["error"] == pytest.approx(float(np.sqrt(np.mean(error**2))), rel=1e-14)
    late = row.measures["late"]
    assert late == next((t - low[0] for t in seen if t >= low[0] - 0.2), None)
    assert late is not None


def test_a_block_has_the_rows_of_its_variants_alone() -> None:
    made = make_study("seen")
    together = compute_rows(made, Block(2, 10), run_interpreted_batch)
    assert together == [
        compute_rows(made, Block(k, k + 1), run_interpreted_batch)[0] for k in range(2, 10)
    ]
    assert {row.values["inputs.push.times.1"] for row in together} == {1.0, 0.7003}
    assert together[0].measures["error"] != together[1].measures["error"]  # other noise


def test_a_variant_with_many_events_keeps_all_of_them() -> None:
    fast = ("[1 rad/s, 3 rad/s, 5]", "[49 rad/s, 50 rad/s, 2]")
    undamped = ("[0.1 1/s, 0.2 1/s, 0.4 1/s]", "[0 1/s]")
    row = compute_rows(make_study("grid", fast, undamped), Block(0, 1), run_interpreted_batch)[0]
    assert row.measures["falls"] == pytest.approx(4.0 * 49.0 / (2.0 * np.pi), abs=1.0)


def test_variants_are_systems_or_automata_in_place_of_others() -> None:
    names = ("of: oscillator", "of: oscillator\nvariants: [oscillator, stiff]")
    made = make_study("alone", names, ("  w: [1 rad/s, 3 rad/s]\n", ""))
    rows = compute_rows(made, Block(0, made.count), run_interpreted_batch)
    assert [row.variant for row in rows] == ["oscillator"] * 3 + ["stiff"] * 3
    for row, name in ((rows[0], "oscillator"), (rows[3], "stiff")):
        run = mw.simulate(name, "swing", root=STUDIES)
        assert row.measures["falls"] == len(events(run, name, "below"))
        assert row.measures["final"] == run.signals[f"{name}.x"][-1]
    inner = ("of: measured", "of: measured\nvariants: {plain: {}, hard: {plant: stiff}}")
    own = ("set: {w: turns * 6.25 rad/s, initial", "set: {initial")
    made = make_study("seen", inner, own)
    assert [kind.name for kind in made.system_variants] == ["plain", "hard"]
    assert made.system_variants[1].system.instances["plant"].automaton.parameters["w"].value == 4
    last = compute_rows(made, Block(made.count - 1, made.count), run_interpreted_batch)[0]
    assert (last.variant, last.status) == ("hard", "done")


def test_compiled_blocks_have_the_rows_of_the_interpreter_at_other_times_of_steps_too() -> None:
    made, notes = make_study("seen"), []

    def run(batch: Batch) -> BatchResult:
        result = run_batch(batch, threads=1)
        notes.append((batch.count, len(batch.variant_inputs), result.note))
        return result

    assert compute_rows(made, Block(2, 8), run) == compute_rows(
        made, Block(2, 8), run_interpreted_batch
    )
    assert notes == [(6, 6, "compiled")]


def test_ramps_that_differ_are_one_compiled_batch() -> None:
    ramp = ("inputs.push.times.1: [1 s, 0.7003 s]", "inputs.push.ramp.from: [1 s, 0.7003 s]")
    made, notes = make_study("seen", ("[pushed]", "[ramped]"), ramp), []

    def run(batch: Batch) -> BatchResult:
        result = run_batch(batch, threads=1)
        notes.append((batch.count, len(batch.variant_inputs), result.note))
        return result

    rows = compute_rows(made, Block(2, 8), run)
    assert rows == compute_rows(made, Block(2, 8), run_interpreted_batch)
    assert notes == [(6, 6, "compiled")]
    assert len({row.measures["final"] for row in rows}) == 3


def test_few_steps_are_not_compiled_for() -> None:
    made, notes = make_study("seen"), set()

    def run(batch: Batch) -> BatchResult:
        result = run_block(batch)
        notes.add(result.note)
        return result

    assert compute_rows(made, Block(2, 8), run) == compute_rows(
        made, Block(2, 8), run_interpreted_batch
    )
    assert notes == {"interpreter: too few steps to compile for"}


def test_whole_numbers_words_and_truths_vary_too() -> None:
    """x(1 s) = (10 or 1) * gear * count, exactly: the flow is constant."""
    made = make_study("typed_more")  # a variant of `typed_study`: every point twice
    rows = compute_rows(made, Block(0, made.count), run_block)
    assert (made.count, {row.status for row in rows}) == (36, {"done"})
    for row in rows:
        fast, gear, count = (row.values[name] for name in ("is_fast", "gear", "count"))
        product = (10.0 if fast else 1.0) * (gear + 1.0) * count
        assert row.measures["last"] == pytest.approx(product, rel=1e-12)
    assert {row.values["gear"] for row in rows} == {0.0, 2.0}
    assert [varied.words for varied in made.variables] == [
        ("false", "true"), ("first", "second", "third"), (),
    ]  # fmt: skip
