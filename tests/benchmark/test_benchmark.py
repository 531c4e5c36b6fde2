"""The benchmark runs, and its rivals in C are the ones that were given."""

from __future__ import annotations

import hashlib
import json
from functools import partial
from pathlib import Path

import pytest

from codegen.simulator.simulator_library import load_library
from codegen.toolchain.compiler import flags_at_level
from tests.benchmark import (
    chart_speed as charts,
    competitors as rivals,
    modewright_run as ours,
    performance_ratios as figures,
    run_benchmark as run,
    timing,
    variants,
)
from tests.benchmark.hand_written_c import HERE, PEERS
from tests.benchmark.manoeuvre import Manoeuvre


def test_the_rivals_in_c_are_those_that_were_given() -> None:
    listed = {}
    for line in (HERE / "peers.sha256").read_text().splitlines():
        digest, _, name = line.partition("  ")
        listed[name] = digest
    found = {p.name: hashlib.sha256(p.read_bytes()).hexdigest() for p in PEERS.iterdir()}
    assert found == listed


@pytest.mark.long
def test_a_small_run_has_every_figure_with_its_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    short = Manoeuvre("short", step_ms=20, horizon_ms=80)
    monkeypatch.setattr(figures, "TIP_OUT", short)
    monkeypatch.setattr(run, "TIP_OUT", short)
    monkeypatch.setattr(run, "CHATTER", short)
    monkeypatch.setattr(figures, "STEPS", ("2 ms",))
    monkeypatch.setattr(figures, "COMPILED_STEPS", ("2 ms",))
    monkeypatch.setattr(figures, "VARIANTS", 4)
    monkeypatch.setattr(ours, "load_library", partial(load_library, flags=flags_at_level("O0")))
    monkeypatch.setattr(variants, "load_library", partial(load_library, flags=flags_at_level("O0")))
    monkeypatch.setattr(timing, "SHORTEST", 0.0)
    monkeypatch.setattr(charts, "TICKS_IN_C", 2000)
    monkeypatch.setattr(run, "measure_first_step", lambda: {"total_s": 1.0, "compiler_s": 0.5})
    path = tmp_path / "bench.json"
    assert run.main(["--pairs", "1", "--out", str(path)]) == 0
    found = json.loads(path.read_text())
    for group in ("single_run", "sweep"):
        for ratio in found[group].values():
            assert 0.0 < ratio["low"] <= ratio["median"] <= ratio["high"]
    assert found["single_run"]["interpreter_over_scipy"]["errors"]["scipy"]["is_complete"]
    for side in ("modewright", "c"):
        errors = found["accuracy"]["2 ms"]["short"][side]
        assert errors["is_complete"]
        assert errors["events"] == 2
        assert 0.0 < errors["late"] < 1e-6
        assert 0.0 < errors["rms"] <= errors["largest"] < 1e-6
    assert found["single_run"]["compiled_over_c"]["errors"]["compiled"]["largest"] < 1e-6
    machines = {f"interpreter_over_{name}" for name in charts.MACHINES}
    assert machines < set(found["chart"])
    assert found["chart"]["interpreter_over_fastest"]["fastest"] in charts.MACHINES
    assert found["chart"]["generated_over_c"]["median"] > 0.0
    swept = found["sweep"]["batch_over_c"]
    assert swept["errors"]["batch"]["other_events"] == swept["errors"]["c"]["other_events"] == 0
    assert swept["errors"]["batch"]["late"] < 1e-4
    assert "interpreter_over_scipy" in capsys.readouterr().out


def test_a_rival_without_its_environment_is_left_out_with_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rivals, "ROOT", tmp_path)
    monkeypatch.setattr(rivals, "UV", tmp_path / "uv")
    assert run.rival_figure("diffrax", 1) == {
        "missing": f"diffrax: {tmp_path / 'uv'} is missing: make setup"
    }
    (tmp_path / "uv").write_text("#!/bin/sh\necho 'no index in reach' >&2\nexit 2\n")
    (tmp_path / "uv").chmod(0o755)
    assert run.rival_figure("diffrax", 1)["missing"].endswith("no index in reach")
    with pytest.raises(SystemExit):
        run.main(["--peers", "diffraks"])


def test_the_page_ends_with_the_figures_of_the_last_run() -> None:
    page = run.PAGE.read_text()
    once = run.insert_figures(page, ["a", "b"])
    assert once.startswith(page.partition("## Figures")[0])
    assert once.endswith("## Figures\n\n```text\na\nb\n```\n")
    assert run.insert_figures(once, ["c"]) == run.insert_figures(page, ["c"])


def test_a_ratio_is_the_median_of_pairs_with_its_quartiles() -> None:
    assert timing.quartiles([3.0, 1.0, 2.0, 5.0, 4.0]) == (2.0, 3.0, 4.0)
    assert timing.quartiles([7.0]) == (7.0, 7.0, 7.0)
