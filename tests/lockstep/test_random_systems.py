"""Random specs through the public API: a system of two sampled automata, in lock-step with C."""

from __future__ import annotations

import tempfile
from pathlib import Path

from hypothesis import HealthCheck, given, note, settings

import modewright as mw
from tests.lockstep.spec_strategies import TICKS, Specs, specs

SHARE = 10
"""An example costs two compilations."""


@settings(
    max_examples=max(1, settings().max_examples // SHARE),
    suppress_health_check=[HealthCheck.too_slow],
)
@given(specs())
def test_a_random_system_is_in_lockstep(texts: Specs) -> None:
    note(texts.automaton + texts.system + texts.scenario)
    with tempfile.TemporaryDirectory() as folder:
        spec = Path(folder) / "spec"
        spec.mkdir()
        for name in ("automaton", "system", "scenario"):
            (spec / f"{name}.yaml").write_text(getattr(texts, name))
        found = mw.check("chance", Path(folder))
        problems = [problem for problem in found if problem.severity == "error"]
        assert not problems, mw.render_all(problems)
        trajectory, verdicts = mw.lockstep("pair", "chances", root=Path(folder))
    assert trajectory.stopped is None
    assert [verdict.name for verdict in verdicts] == ["first", "second"]
    assert all(verdict.is_equal for verdict in verdicts), [str(v.first) for v in verdicts]
    assert {verdict.ticks for verdict in verdicts} <= {TICKS, TICKS - 1, TICKS - 2}
