"""Random specs through the whole front end: interpreter and compiled C agree on every bit."""

from __future__ import annotations

from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from hypothesis import HealthCheck, given, note, settings, strategies as st

from language.ir.number_type import NUMBER_TYPES, NumberType
from lockstep.comparison import compare
from tests.lockstep.conftest import TICKS
from tests.lockstep.random_specs.combined_executable import FLAGS
from tests.lockstep.random_specs.coverage_requirements import Quality, measure_quality
from tests.lockstep.random_specs.engine_run import record_ticks
from tests.lockstep.random_specs.reference_runs import ReferenceRun
from tests.lockstep.random_specs.spec import program
from tests.lockstep.random_specs.spec_kinds import random_spec

SHARE = 25
"""An example costs two compilations."""


def test_random_specs_are_in_lockstep(random_specs: list[ReferenceRun]) -> None:
    for one in random_specs:
        assert one.verdict.is_equal, f"{one.verdict.first}\n{one.spec.text}"
        assert one.verdict.ticks == TICKS


@settings(
    max_examples=max(1, settings().max_examples // SHARE),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(st.randoms(use_true_random=False), st.sampled_from(NUMBER_TYPES))
def test_a_random_spec_is_in_lockstep(draw: Random, number: NumberType) -> None:
    """As above, one by one: hypothesis shrinks what it finds."""
    spec = random_spec(draw, "found")
    note(spec.text)
    with TemporaryDirectory() as folder:
        made = program(spec, number, Path(folder))
    verdict = compare(record_ticks(spec, made, 60), FLAGS)
    assert verdict.is_equal, str(verdict.first)


def test_random_specs_do_what_the_rules_are_about(random_specs: list[ReferenceRun]) -> None:
    """What they never do, their agreement says nothing about; `make verify` asks for 20 times."""
    quality = Quality()
    for one in random_specs:
        if one.program.number_type == "float64":
            tape, found = measure_quality(one.spec, one.program, TICKS)
            assert tape.values == one.tape.values, "what is counted changes what is done"
            quality.add(found)
    assert not quality.missing_coverage(least=1), quality.table()
