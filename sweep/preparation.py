"""Preparation: a study made ready to run - recordings read, rows chosen, its digest."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from fractions import Fraction

from engine.starting import programs_of
from engine.stimulus import resolved
from language.experiment import Scenario
from language.printing import digest as program_digest
from sweep.sampling_reader import LARGEST_SEED, MOST_POINTS
from sweep.study import Course, Kind, Study, points_each
from sweep.study_reader import signals_of

FORMAT = 2
"""Form of the results: those of another one are not continued."""


def prepared(study: Study) -> Study:
    """Return a study that needs its files no longer, with the digest of every Program.

    Raises SpecError: for what is wrong with a recording, or a Program that cannot be made.
    """
    sampling = study.sampling
    identity = dict(study.identity)
    identity["sampling"] = " ".join(str(value) for value in vars(sampling).values())
    kinds = []
    for kind in study.kinds:
        courses = {}
        for name, course in kind.courses.items():
            scenario = _rows(study, resolved(kind.system, course.scenario))
            courses[name] = Course(scenario, course.document)
            identity |= _recording_digest(name, scenario)
        kinds.append(Kind(kind.name, kind.system, courses))
    made = dataclasses.replace(study, kinds=tuple(kinds))
    return dataclasses.replace(made, identity={**identity, **program_digests(made)})


def program_digests(study: Study) -> dict[str, str]:
    """Return the digest of every Program of a prepared study, by what it is of."""
    found = {}
    for kind in study.kinds:
        for name, course in kind.courses.items():
            for instance, program in programs_of(kind.system, course.scenario).items():
                key = f"Program of `{instance}` in variant `{kind.name}`, scenario `{name}`"
                found[key] = program_digest(program)
    return found


def resampled(study: Study, samples: int | None = None, seed: int | None = None) -> Study:
    """Return a study with another number of drawn points, or another seed.

    Raises ValueError for what the file of a study could not say either.
    """
    old = study.sampling
    if (samples is not None or seed is not None) and not old.count:
        raise ValueError(f"`{study.name}` draws nothing: it has no samples and no seed")
    if samples is not None and not 1 <= samples <= MOST_POINTS:
        raise ValueError(f"{samples} samples are not from 1 to {MOST_POINTS}")
    if seed is not None and not 0 <= seed <= LARGEST_SEED:
        raise ValueError(f"the seed {seed} is not from 0 to {LARGEST_SEED}")
    each = points_each(old.method, len(study.drawn))
    count = old.count if samples is None else samples * each
    new = dataclasses.replace(old, count=count, seed=old.seed if seed is None else seed)
    made = dataclasses.replace(study, sampling=new)
    if made.count > MOST_POINTS:
        raise ValueError(f"the study would have {made.count} variants; at most {MOST_POINTS}")
    return made


def digest_of(identity: Mapping[str, str]) -> str:
    """Return the SHA-256 of all that results depend on."""
    return hashlib.sha256(json.dumps([FORMAT, dict(sorted(identity.items()))]).encode()).hexdigest()


def _rows(study: Study, scenario: Scenario) -> Scenario:
    """Return the scenario with the rows that the study asks for; two where it reads no signal."""
    assert scenario.horizon is not None
    every = study.every or scenario.every
    if not signals_of(study.measures):
        every = scenario.horizon
    return dataclasses.replace(scenario, every=Fraction(every))


def _recording_digest(name: str, scenario: Scenario) -> dict[str, str]:
    if not any(stimulus.column for stimulus in scenario.inputs.values()):
        return {}
    inputs = repr(sorted(scenario.inputs.items())).encode()
    return {f"recording of scenario `{name}`": hashlib.sha256(inputs).hexdigest()}
