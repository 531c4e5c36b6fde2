from __future__ import annotations

import ast
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.generators.open_cases.__main__ import main
from tests.generators.open_cases.case import Case, SimulatedRecording, draw_case, simulate_cases
from tests.generators.open_cases.driveline import NOMINAL, UNCERTAIN, perturb_driveline
from tests.generators.open_cases.driveline_simulation import STEP
from tests.generators.open_cases.effect_catalogue import LIBRARY, parse_effects
from tests.generators.open_cases.label import case_label
from tests.generators.open_cases.recording import HEADER, write_case
from tests.generators.open_cases.short_cases import largest_change, short_case

WEAK = 0.1
NOISE_SHARE = 0.1
"""Doubling the step may move a speed by this share of the noise: the step itself by a quarter."""
OWN_FLOORS = (
    "language",
    "engine",
    "codegen",
    "expectation",
    "lockstep",
    "sweep",
    "diagnosis",
    "modewright",
)


def ran(cases: Sequence[Case], step: float = STEP) -> list[list[SimulatedRecording]]:
    """Simulate short cases after little settling."""
    return simulate_cases(cases, step, settling_time=0.3)


def test_effects_show_above_the_noise_and_fade_with_their_strength() -> None:
    """Fading is read off the moving recordings: at standstill little decides where the gap lies."""
    within = [name for name, effect in LIBRARY.items() if effect.parts is not None]
    weak_cases = [short_case((name,), WEAK) for name in within]
    base, *results = ran([short_case(()), *(short_case((name,)) for name in LIBRARY), *weak_cases])
    plain = dict(zip(LIBRARY, results, strict=False))
    for name, recordings in plain.items():
        assert largest_change(recordings, base) > 1.0, name
    for name, recordings in zip(within, results[len(LIBRARY) :], strict=True):
        weak = largest_change(recordings[1:], base[1:])
        assert weak < 0.4 * largest_change(plain[name][1:], base[1:]), name


def test_at_strength_zero_nothing_is_left_of_an_effect() -> None:
    for name in LIBRARY:
        assert short_case((name,), 0.0) == short_case(())


def test_twice_the_step_moves_no_speed_by_more_than_a_tenth_of_the_noise() -> None:
    names = ("second_gap", "stiffness_hysteresis", "tyre_slip", "mount_compliance")
    cases = [short_case(()), *(short_case((name,)) for name in names)]
    for case, coarse, fine in zip(cases, ran(cases, 2 * STEP), ran(cases), strict=True):
        thinned = [
            SimulatedRecording(c.T_em[::2], c.T_br[::2], c.w_em[::2], c.w_w[::2]) for c in fine
        ]
        assert largest_change(coarse, thinned) < NOISE_SHARE, case.effects


def test_a_case_is_the_same_alone_and_among_others() -> None:
    case = short_case(("second_gap", "unknown_input", "brake_drag"))
    longer = replace(case, manoeuvres=(replace(case.manoeuvres[0], duration=1.4),))
    for one, other in zip(ran([case])[0], ran([longer, case])[1], strict=True):
        assert np.array_equal(one.w_em, other.w_em)
        assert np.array_equal(one.w_w, other.w_w)


def test_two_effects_act_together() -> None:
    first, second = ("mount_compliance",), ("sensor_scale",)
    neither, one, other, both = ran([short_case(e) for e in ((), first, second, second + first)])
    for recordings in (neither, one, other):
        assert largest_change(both, recordings) > 1.0


def test_names_sizes_and_stamps_of_the_files_do_not_tell_the_effect(tmp_path: Path) -> None:
    shapes: list[list[tuple[str, int, float]]] = []
    cases = [
        short_case(effects, rate=200) for effects in ((), ("torque_gain",), ("sensor_scale",), ())
    ]
    for number, recordings in enumerate(ran(cases)):
        folder = tmp_path / str(number)
        write_case(folder, cases[number], recordings)
        files = sorted(folder.rglob("*.csv"))
        shapes.append(
            [(str(f.relative_to(folder)), f.stat().st_size, f.stat().st_mtime) for f in files]
        )
        lines = files[0].read_text().splitlines()
        assert lines[0] == HEADER
        assert len(lines) == 1 + 241
        assert len(set(map(len, lines[1:]))) == 1
    assert [name for name, *_ in shapes[0]] == [
        "held_out/rec_00.csv",
        "train/rec_00.csv",
        "train/rec_01.csv",
    ]
    assert shapes[0] == shapes[1] == shapes[2]
    texts = [[f.read_bytes() for f in sorted((tmp_path / n).rglob("*.csv"))] for n in "0123"]
    assert texts[0] == texts[3]
    assert texts[0] != texts[1]


def test_the_effect_changes_nothing_else_of_a_drawn_case() -> None:
    for number in range(5):
        clean, other = draw_case(3, number, ()), draw_case(3, number, ("tyre_slip",))
        assert (clean.driveline, clean.manoeuvres) == (other.driveline, other.manoeuvres)
        assert (clean.rate, clean.sensors) == (other.rate, other.sensors)
        lengths = [manoeuvre.duration for manoeuvre in clean.manoeuvres]
        assert sum(lengths[: clean.train]) >= 50.0
        assert sum(lengths[clean.train :]) >= 30.0
    assert draw_case(3, 0, ()) == draw_case(3, 0, ())
    assert draw_case(3, 0, ()).driveline != draw_case(4, 0, ()).driveline


def test_base_values_are_5_to_20_per_cent_off() -> None:
    off = perturb_driveline(NOMINAL, np.random.Generator(np.random.PCG64(0)))
    for name in UNCERTAIN:
        error = abs(getattr(off, name) / getattr(NOMINAL, name) - 1.0)
        assert 0.05 <= error <= 0.20
    assert (off.R, off.tau_f) == (NOMINAL.R, NOMINAL.tau_f)


def test_a_label_holds_effect_place_and_parameters() -> None:
    case = short_case(("sensor_delay", "actuator_lag"))
    told = json.loads(json.dumps(case_label(case, 1.0)))
    assert [(e["id"], e["place"]) for e in told["effects"]] == [
        ("actuator_lag", "inputs.T_em"),
        ("sensor_delay", "outputs.w_s"),
    ]
    assert told["effects"][0]["parameters"] == case.effects[0].parameters
    assert told["base"]["k"] == case.driveline.k


def test_entries_of_the_command_line_are_read() -> None:
    assert parse_effects("none:2,sensor_lag+actuator_lag,tyre_slip", 1) == [
        (),
        (),
        ("sensor_lag", "actuator_lag"),
        ("tyre_slip",),
    ]
    assert len(parse_effects("all", 3)) == 3 * (len(LIBRARY) - 1)


@pytest.mark.parametrize("entry", ["gremlins", "none:x", "tyre_slip+added_inertia", "none+none"])
def test_an_unknown_entry_is_refused(entry: str) -> None:
    with pytest.raises(ValueError, match=r"none|known|together|number"):
        parse_effects(entry, 1)


def test_the_command_line_refuses_what_would_give_labels_away_or_mix_cases(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, used, labels = tmp_path / "out", tmp_path / "used", str(tmp_path / "labels.json")
    used.mkdir()
    (used / "case_000").touch()
    for given, reason in (
        (["--out", str(out), "--labels", str(out / "labels.json"), "--seed", "1"], "among"),
        (["--out", str(used), "--labels", labels, "--seed", "1"], "not empty"),
        (["--out", str(out), "--labels", labels, "--seed", "-1"], "seed"),
    ):
        assert main(given) == 2
        assert reason in capsys.readouterr().err
    assert not out.exists()


def test_the_generator_knows_nothing_of_the_product() -> None:
    for path in sorted(Path(__file__).parents[1].glob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [node.module]
            assert not [name for name in names if name.split(".")[0] in OWN_FLOORS], path.name
