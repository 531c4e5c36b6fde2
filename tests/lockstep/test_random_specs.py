"""Random specs through the whole front end: interpreter and compiled C agree on every bit."""

from __future__ import annotations

from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory

from hypothesis import HealthCheck, given, note, settings, strategies as st

from language.number import NUMBERS, NumberType
from lockstep.compare import compare, judged
from tests.lockstep.chance.batch import FLAGS, Batch
from tests.lockstep.chance.kinds import chance, random_spec
from tests.lockstep.chance.running import taped
from tests.lockstep.chance.spec import program

COUNT = 14
TICKS = 200
SHARE = 25
"""An example costs two compilations."""


def test_a_batch_of_random_specs_is_in_lockstep(tmp_path: Path) -> None:
    pairs = [(s, program(s, n, tmp_path)) for s in map(chance, range(COUNT)) for n in NUMBERS]
    batch = Batch([made for _, made in pairs], tmp_path / "batch")
    for spec, made in pairs:
        tape = taped(spec, made, TICKS)
        verdict = judged(tape, batch.run(made, b"".join(tape.inputs)))
        assert verdict.is_equal, f"{verdict.first}\n{spec.text}"
        assert verdict.ticks == TICKS


@settings(
    max_examples=max(1, settings().max_examples // SHARE),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
@given(st.randoms(use_true_random=False), st.sampled_from(NUMBERS))
def test_a_random_spec_is_in_lockstep(draw: Random, number: NumberType) -> None:
    """As above, one by one: hypothesis shrinks what it finds."""
    spec = random_spec(draw, "found")
    note(spec.text)
    with TemporaryDirectory() as folder:
        made = program(spec, number, Path(folder))
    verdict = compare(taped(spec, made, 60), FLAGS)
    assert verdict.is_equal, str(verdict.first)
