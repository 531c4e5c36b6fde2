"""What can be ordered, what is refused, and how the rates are shared out."""

from collections import Counter
from pathlib import Path

import pytest

from tests.generators.blind_cases.__main__ import main
from tests.generators.blind_cases.case_specification import RATES_HZ, OrderError, parse_order

NONSENSE = [
    ["--effects", "tyre_slop:1"],
    ["--effects", "tyre_slip"],
    ["--effects", "tyre_slip:0"],
    ["--effects", "tyre_slip:x"],
    ["--effects", "tyre_slip+tyre_slip:1"],
    ["--effects", "unequal_half_shafts+second_gap:1"],
    ["--effects", ""],
    ["--effects", "none:1", "--strength", "-0.3"],
    ["--effects", "none:1", "--strength", "0.01"],
    ["--effects", "none:1", "--strength", "nan"],
    ["--effects", "none:1", "--rate", "250"],
    ["--effects", "none:1", "--seed", "-1"],
    ["--effects", "none:1", "--jobs", "0"],
    ["--effects", "none:99999"],
    ["--effects", "none:1", "--seed", "one"],
]


@pytest.mark.parametrize("words", NONSENSE)
def test_nonsense_is_refused(words: list[str], tmp_path: Path) -> None:
    """Exit code 2 and nothing written."""
    out, labels = tmp_path / "cases", tmp_path / "labels.json"
    with pytest.raises(SystemExit) as caught:
        main(["--out", str(out), "--labels", str(labels), "--seed", "1", *words])
    assert caught.value.code == 2
    assert list(tmp_path.iterdir()) == []


def test_places_are_refused(tmp_path: Path) -> None:
    """Labels within the cases, a folder that is not empty, labels that are there."""
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").write_text("x")
    for out, labels in [("cases", "cases/labels.json"), ("full", "new.json"), ("new", "full/file")]:
        words = ["--out", str(tmp_path / out), "--labels", str(tmp_path / labels)]
        with pytest.raises(SystemExit) as caught:
            main([*words, "--seed", "1", "--effects", "none:1"])
        assert caught.value.code == 2


def test_every_effect_gets_all_rates_equally() -> None:
    """Three cases at each rate of twelve; `none` too."""
    cases = parse_order("all:12,none:8", 3, 1.0, None)
    shared = Counter((case.effects, case.rate) for case in cases)
    assert len(shared) == 27 * len(RATES_HZ)
    assert all(count == (3 if names else 2) for (names, _), count in shared.items())


def test_the_seed_permutes() -> None:
    """Numbers are consecutive, the order of effects another one with each seed."""
    one, two = (parse_order("all:2,none:5", seed, 1.0, None) for seed in (1, 2))
    assert [case.number for case in one] == list(range(57))
    assert [case.effects for case in one] != [case.effects for case in two]
    assert Counter(case.effects for case in one) == Counter(case.effects for case in two)


def test_one_rate_for_all() -> None:
    """`--rate` overrules the sharing."""
    assert {case.rate for case in parse_order("all:1", 1, 1.0, 500)} == {500}
    with pytest.raises(OrderError):
        parse_order("all:1", 1, 1.0, 0)
