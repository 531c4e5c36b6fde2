"""Warnings of a checked automaton: what never fires, what changes for ever - and what does not."""

from __future__ import annotations

from pathlib import Path

import pytest

import modewright as mw
from modewright.api.spec_check import spec_files

ROOT = Path(__file__).parents[3]
HEAD = """language: 1
automaton: chooser
period: 10 ms
numbers: float64
parameters: {{limit: {{value: 1 m, range: [0.5, 2], tunable: true}}}}
inputs:
  x: {{unit: m, range: [-9, 9]}}
  v: {{unit: m/s, range: [-2, 2]}}
  key: {{type: enum, values: [parked, on_road]}}
initial: a
modes:
  a: {{transitions: {{b: {{{first}, priority: 1}}, c: {{{second}, priority: 2}}}}}}
  b: {{transitions: {{a: {{when: x < 0 m}}, c: {{when: x > 8 m}}}}}}
  c: {{transitions: {{a: {{when: x < 0 m}}, b: {{when: x > 8 m}}}}}}
outputs: [mode]
"""


def kinds(folder: Path, text: str) -> list[str]:
    path = folder / "chooser.yaml"
    path.write_text(text)
    found = [problem.kind for problem in mw.check(str(path))]
    return [kind for kind in found if kind not in ("unused", "unwritten")]


@pytest.mark.parametrize("path", sorted(spec_files(ROOT)), ids=lambda path: path.stem)
def test_no_shipped_spec_raises_an_alarm(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert mw.render_all(mw.check(str(path))) == ""


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        ("when: x > 1 m", "when: x > 2 m", ["shadowed"]),
        ("when: x > 2 m", "when: x > 1 m", []),
        ("when: x > limit", "when: x > 1.5 m", []),  # not for every value of the limit
        ("when: x > limit", "when: x > 2 m", ["shadowed"]),
        ("when: key == parked", "when: key == on_road and x > 0 m", []),
        ("when: key == parked or x > 0 m", "when: key != on_road", ["shadowed"]),
        ("when: x > 1 m", "when: x > 2 m, wait: 50 ms", ["timer"]),
        ("when: x > 1 m, wait: 50 ms", "when: x > 2 m", []),
        ("when: x > 1 m, wait: 50 ms", "when: x > 2 m, wait: 50 ms", ["timer"]),
        ("when: x > 1 m, wait: 50 ms", "when: x > 2 m, wait: 30 ms", []),
        ("when: x > 2 m, wait: 50 ms", "when: x > 1 m", ["timer"]),
        ("when: x > 0 m, wait: 42 ms", "when: v > 0 m/s, wait: 47 ms", ["near"]),
        ("when: x > 0 m, wait: 40 ms", "when: v > 0 m/s, wait: 50 ms", []),
        ("when: after(30 ms)", "when: x > 0 m, wait: 30 ms", ["timer"]),
        ("when: x > 0 m, wait: 30 ms", "when: after(30 ms)", []),
        ("when: after(20 ms), wait: 10 ms", "when: x > 0 m, wait: 20 ms", []),
        ("when: after(10 ms), wait: 10 ms", "when: x > 0 m, wait: 20 ms", ["timer"]),
        ("when: every(10 ms)", "when: x > 0 m, wait: 10 ms", ["timer"]),
        ("when: every(20 ms)", "when: x > 0 m, wait: 10 ms", []),
        ("when: after(15 ms)", "when: every(20 ms)", ["shadowed"]),  # 2 ticks both
        ("when: after(25 ms)", "when: every(20 ms)", []),
        ("when: x * v > 20 m^2/s", "when: x > 0 m", ["dead"]),
        ("when: rising(x > 1 m)", "when: x > 1 m", []),
        ("when: x > 1 m", "when: rising(x > 1 m)", ["shadowed"]),
        ("when: changed(x > 1 m)", "when: falling(x > 1 m)", ["shadowed"]),
        ("when: rising(x > 1 m)", "when: changed(x > 1 m) and x > 1 m", ["shadowed"]),
        ("when: rising(x > 1 m)", "when: changed(x > 1 m) and x > 0 m", []),
        ("when: rising(x > 1 m)", "when: rising(x > 2 m)", []),
        ("when: x > 0 m", "when: sin(x / 1 m) > 0.5", []),
        ("when: x > 0 m", "when: tanh(v * 1 s/m) > 0.99", []),  # never, but nothing knows it
    ],
)
def test_a_warning_is_given_where_it_is_certain(
    first: str, second: str, expected: list[str], tmp_path: Path
) -> None:
    assert kinds(tmp_path, HEAD.format(first=first, second=second)) == expected


ROUND = """language: 1
automaton: rounds
states:
  x: {{unit: m, initial: 0 m, range: [-1, 1]}}
  v: {{unit: m/s, initial: 1 m/s, range: [-2, 2]}}
discrete: {{turns: {{type: int, initial: 0, range: [0, 100]}}}}
flow: {{x: der(x) = v, v: der(v) = -x / 1 s^2}}
initial: a
modes:
  a: {{transitions: {{b: {{{first}}}}}}}
  b: {{transitions: {{c: {{{second}}}}}}}
  c: {{transitions: {{a: {{{third}}}}}}}
outputs: [x, v, turns]
"""


@pytest.mark.parametrize(
    ("first", "second", "third", "expected"),
    [
        ("when: x > 0 m", "when: x > 0.1 m", "when: x > 0.2 m", ["cycle"]),
        ("when: x > 0 m", "when: x > 0.1 m, wait: 1 ms", "when: x > 0.2 m", []),
        ("when: x > 0 m", "when: x > 0.1 m", "when: x < 0 m", []),
        ("when: x > 0 m, reset: {x: -x}", "when: x < 0 m", "when: x < 0.2 m", []),
        ("when: turns < 9, reset: {turns: turns + 1}", "when: x > 0 m", "when: x > 0 m", ["cycle"]),
        ("when: turns < 2, reset: {turns: turns + 1}", "when: x > 0 m", "when: x > 0 m", []),
        ("when: x > 0 m", "when: x^2 + v^2 * 1 s^2 < 0.01 m^2", "when: v > 0.2 m/s", []),
        ("when: x > 0 m", "when: after(1 ms)", "when: x > 0 m", []),
        ("when: x > 0 m", "when: rising(x > 0 m)", "when: x > 0 m", []),
    ],
)
def test_ways_round_at_one_instant(
    first: str, second: str, third: str, expected: list[str], tmp_path: Path
) -> None:
    assert kinds(tmp_path, ROUND.format(first=first, second=second, third=third)) == expected


def test_a_region_beside_may_end_a_way_round(tmp_path: Path) -> None:
    """The region leaves `still` in the same micro-step as the chart leaves `a`."""
    beside = "regions: {r: {initial: still, modes: {still: {transitions: {moving: "
    beside += "{when: x > 0 m}}}, moving: {}}}}\n"
    alone = ROUND.format(first="when: x > 0 m", second="when: x > 0 m", third="when: x > 0 m")
    assert kinds(tmp_path, alone) == ["cycle"]
    still = alone.replace("b: {when: x > 0 m}", "b: {when: x > 0 m and in(r.still)}")
    assert kinds(tmp_path, still + beside) == []


CHART = """language: 1
automaton: nested
period: 10 ms
numbers: float64
inputs: {{x: {{unit: m, range: [-9, 9]}}}}
regions:
  chart:
    initial: drive
    modes:
      drive:
        initial: slow
        transitions: {{rest: {{when: {out}}}}}
        modes:
          slow:
            transitions:
              fast: {{when: {up}, priority: 1}}
              rest: {{when: x < -1 m, priority: 2}}
          fast: {{transitions: {{slow: {{when: x < 1 m}}}}}}
      rest: {{transitions: {{drive: {{when: x > 0 m}}}}}}
  lamp:
    initial: dark
    modes:
      dark: {{transitions: {{lit: {{when: in(drive.fast) and x > 3 m}}}}}}
      lit: {{transitions: {{dark: {{when: in(rest)}}}}}}
outputs: [mode]
"""


@pytest.mark.parametrize(
    ("out", "up", "expected"),
    [
        ("x < -2 m", "x > 2 m", []),
        ("x < -20 m", "x > 2 m", ["dead"]),
        ("x < -2 m", "x < -4 m", ["shadowed", "unreached"]),  # by the transition of the mode around
        ("x < -2 m and in(lamp.lit)", "x > 2 m and in(drive)", []),
        ("x < -2 m", "x > 2 m and not in(drive)", ["dead", "unreached"]),
        ("x < -2 m and not in(chart.drive)", "x > 20 m", ["dead", "dead", "unreached"]),
    ],
)
def test_superstates_and_regions(out: str, up: str, expected: list[str], tmp_path: Path) -> None:
    assert kinds(tmp_path, CHART.format(out=out, up=up)) == expected


@pytest.mark.parametrize(
    ("order", "up", "expected"),
    [
        ("inner_first", "x > 0 m", ["shadowed", "unreached"]),  # one inside fires in every mode
        ("inner_first", "x > 2 m", []),
        ("inner_first", "x > 0 m, wait: 20 ms", []),
        ("inner_first", "x > 0 m and rising(x > 1 m)", []),
        ("outer_first", "x > 2 m", ["shadowed", "unreached"]),
        ("outer_first", "x > 2 m, event: go", ["shadowed", "unreached"]),
        ("outer_first", "x > 2 m, wait: 20 ms", ["timer", "unreached"]),
        ("outer_first", "x > 0 m", []),
    ],
)
def test_a_superstate_shadows_what_is_inside_and_the_other_way_round(
    order: str, up: str, expected: list[str], tmp_path: Path
) -> None:
    text = f"""language: 1
automaton: nested
period: 10 ms
numbers: float64
order: {order}
events: {{go: {{from: input}}}}
inputs: {{x: {{unit: m, range: [-9, 9]}}}}
initial: drive
modes:
  drive:
    initial: slow
    transitions: {{rest: {{when: x > 1 m}}}}
    modes:
      slow: {{transitions: {{fast: {{when: {up}}}}}}}
      fast: {{transitions: {{slow: {{when: x > 0.5 m}}, fast: {{event: go, when: x < 0 m}}}}}}
  rest: {{transitions: {{drive: {{when: x < 0 m}}}}}}
outputs: [mode]
"""
    assert kinds(tmp_path, text) == expected


ZENO = """language: 1
automaton: mass
parameters: {{k: {{value: 2 N/m, range: [1, 3], tunable: true}}, m: {{value: 2 kg}}}}
inputs: {{F: {{unit: N, range: [-9, 9]}}}}
states:
  x: {{unit: m, initial: 0 m, range: [-1, 1]}}
  v: {{unit: m/s, initial: 0 m/s, range: [-2, 2]}}
initial: a
modes:
  a:
    flow: {{x: der(x) = v, v: m * der(v) = {force_a}}}
    transitions: {{b: {{{first}}}}}
  b:
    flow: {{x: der(x) = v, v: m * der(v) = {force_b}}}
    transitions: {{a: {{{second}}}}}
outputs: [x, v]
"""


@pytest.mark.parametrize(
    ("force_a", "force_b", "first", "second", "expected"),
    [
        ("1 N", "-1 N", "when: v > 0 m/s", "when: v < 0 m/s", ["zeno"]),  # a relay
        ("-1 N", "1 N", "when: v > 0 m/s", "when: v < 0 m/s", []),  # each flow leads away
        ("F", "F", "when: v > 0 m/s", "when: v < 0 m/s", []),  # one flow goes one way
        ("1 N", "-1 N", "when: v > 0 m/s, wait: 1 ms", "when: v < 0 m/s", []),
        ("1 N", "-1 N", "when: v > 0.1 m/s", "when: v < 0 m/s", []),
        ("1 N", "-1 N", "when: x > 0 m", "when: x < 0 m", ["zeno"]),  # with no speed, at once
        ("-k * x", "-k * x", "when: x > 0 m", "when: x < 0 m", []),
        ("-k * x", "-k * x", "when: x >= 0.5 m", "when: x < 0.5 m", []),  # a graze is none
        ("F - k * x", "-F - k * x", "when: v > 0 m/s", "when: v < 0 m/s", ["zeno"]),
        ("1 N", "-1 N", "when: v > 0 m/s, reset: {v: 0.1 m/s}", "when: v < 0 m/s", []),
        ("exp(v * 1 s/m) * 1 N", "-1 N", "when: v > 0 m/s", "when: v < 0 m/s", ["zeno"]),
    ],
)
def test_flows_that_lead_back_at_once(
    force_a: str, force_b: str, first: str, second: str, expected: list[str], tmp_path: Path
) -> None:
    text = ZENO.format(force_a=force_a, force_b=force_b, first=first, second=second)
    assert kinds(tmp_path, text) == expected


BOUNCING = """language: 1
automaton: ball
step: 10 ms
states:
  h: {{unit: m, initial: 1 m}}
  v: {{unit: m/s, initial: 0 m/s}}
discrete: {{k: {{initial: 0}}, loud: {{type: bool, initial: true}}}}
initial: fly
modes:
  fly:
    equations: {{left: 5 - k}}
    flow: {{h: der(h) = v, v: der(v) = -9.81 m/s^2}}
    transitions:
      rest: {{{rest}}}
      bounce: {{to: fly, {bounce}}}
  rest:
    flow: {{h: der(h) = 0 m/s, v: der(v) = 0 m/s^2}}
    equations: {{left: 0}}
outputs: [h, v, k, loud, mode]
"""
FALLING = "when: h <= 0 m and v < 0 m/s"
SLOW = f"{FALLING} and v > -0.1 m/s"


@pytest.mark.parametrize(
    ("rest", "bounce", "is_zeno"),
    [
        (f"{SLOW}, priority: 1", f"{FALLING}, priority: 2", False),  # rest takes the point
        (f"{SLOW} and h > -1 m, priority: 1", f"{FALLING}, priority: 2", True),  # only above -1 m
        (f"{SLOW}, priority: 3", f"{FALLING}, priority: 2", True),
        (f"{SLOW}, priority: 1, wait: 1 ms", f"{FALLING}, priority: 2", True),
        (f"{SLOW}, priority: 1, wait: 0 s", f"{FALLING}, priority: 2", False),
        ("when: v > -0.1 m/s and h <= 0 m, priority: 1", f"{FALLING}, priority: 2", False),
        ("when: v > 0.1 m/s, priority: 1", f"{FALLING}, priority: 2", True),  # another point
        ("when: v >= 0 m/s and h <= 0 m, priority: 1", f"{FALLING}, priority: 2", True),
        ("when: rising(v > 0 m/s), priority: 1", f"{FALLING}, priority: 2", True),  # open
        ("when: h > 5 m, priority: 1", f"{FALLING} and k < 5, priority: 2", False),  # five times
        ("when: h > 5 m, priority: 1", f"{FALLING} and left > 0, priority: 2", False),
        ("when: h > 5 m, priority: 1", f"{FALLING} and loud, priority: 2", False),  # once
        ("when: h > 5 m, priority: 1", f"{FALLING} and k >= 0, priority: 2", False),
    ],
)
def test_a_ball_that_comes_to_rest_bounces_finitely_often(
    rest: str, bounce: str, is_zeno: bool, tmp_path: Path
) -> None:
    """A transition of a smaller priority or a counter ends the bounces."""
    reset = "reset: {v: -0.8 * v, k: k + 1, loud: false}"
    text = BOUNCING.format(rest=rest, bounce=f"{bounce}, {reset}")
    found = kinds(tmp_path, text)
    assert ("zeno" in found) == is_zeno and not {"name", "form", "type", "overflow"} & {*found}


@pytest.mark.parametrize(
    ("stick", "expected"),
    [("v > -0.01 m/s and v < 0.01 m/s", []), ("v > 0.1 m/s", ["zeno"])],
)
def test_a_relay_with_a_sticking_mode_does_not_chatter(
    stick: str, expected: list[str], tmp_path: Path
) -> None:
    stuck = f"when: v > 0 m/s, priority: 2}}, stuck: {{when: {stick}, priority: 1"
    text = ZENO.format(force_a="1 N", force_b="-1 N", first=stuck, second="when: v < 0 m/s")
    text = text.replace("outputs", "  stuck: {flow: {x: der(x) = v, v: m * der(v) = 0 N}}\noutputs")
    assert kinds(tmp_path, text) == expected


@pytest.mark.parametrize(("value", "expected"), [("5 m", ["past"]), ("2 m", [])])
def test_a_constant_outside_of_the_range_of_its_target_is_reported(
    tmp_path: Path, value: str, expected: list[str]
) -> None:
    text = HEAD.format(first="when: x > 1 m", second="when: x > 2 m")
    text = text.replace(
        "initial: a", "discrete: {last: {unit: m, initial: 0 m, range: [-3, 3]}}\ninitial: a"
    )
    text = text.replace("b: {transitions", f"b: {{entry: {{last: {value}}}, transitions")
    text = text.replace("outputs: [mode]", "outputs: [mode, last]")
    found = kinds(tmp_path, text.replace("x > 2 m, priority: 2", "x < -2 m, priority: 2"))
    assert found == expected


EVENTS = """language: 1
automaton: machine
period: 10 ms
numbers: float32
inputs: {{u: {{unit: 1, range: [0, 2]}}, stop: {{type: bool}}}}
events: {{{events}}}
initial: low
modes:
  low: {{transitions: {{high: {{when: u > 1, priority: 2{first}}}}}}}
  high: {{transitions: {{low: {{when: u < 1, priority: 1{second}}}}}}}
outputs: [mode]
"""


@pytest.mark.parametrize(
    ("events", "first", "second", "expected"),
    [
        ("hot: {}", ", raise: hot", ", event: hot", []),
        ("hot: {}", ", raise: hot", "", ["event `hot` is raised, but no transition has"]),
        ("hot: {}", "", ", event: hot", ["this never fires: nothing raises `hot`"]),
        ("hot: {}", "", "", ["event `hot` is never raised, and no transition has"]),
        ("stop: {from: input}", "", ", event: stop", []),
        ("stop: {from: input}", "", "", ["input `stop` is read nowhere"]),
        (
            "hot: {}, cold: {}",
            ", raise: [hot, cold]",
            ", event: [hot]",
            ["event `cold` is raised, but no transition has"],
        ),
        (
            "hot: {}, cold: {}",
            ", raise: hot",
            ", event: [hot, cold]",
            ["event `cold` is never raised"],
        ),
    ],
)
def test_events_that_nothing_raises_or_reacts_to(
    tmp_path: Path, events: str, first: str, second: str, expected: list[str]
) -> None:
    text = EVENTS.format(events=events, first=first, second=second)
    if "stop" not in events:
        text = text.replace(", stop: {type: bool}", "")
    path = tmp_path / "machine.yaml"
    path.write_text(text)
    found = [problem for problem in mw.check(str(path)) if problem.kind != "stuck"]
    labels = [problem.label for problem in found]
    assert [label[: len(start)] for label, start in zip(labels, expected, strict=True)] == expected
