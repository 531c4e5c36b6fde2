"""Preparation of a study: read recordings, set the rows to record, compute digests of Programs."""

from __future__ import annotations

import dataclasses
import hashlib
from fractions import Fraction

from engine.simulation.instance_programs import programs_of
from engine.simulation.stimuli import resolve_recording
from language.ir.printer import digest as program_digest
from language.model.system import Scenario
from sweep.definition.sampling_reader import MAX_POINTS, MAX_SEED
from sweep.definition.study import ScenarioBinding, Study, SystemVariant, design_group_size
from sweep.definition.study_reader import signals_of


def prepare_study(study: Study) -> Study:
    """Return a study that needs no files any more.

    Recordings are read, rows have the distance of the study (start and end only if no measure needs
    a signal), and `identity` has the sampling and the digests of recordings and Programs. Raises
    SpecError for an invalid recording or a Program that cannot be built.
    """
    sampling = study.sampling
    identity = dict(study.identity)
    identity["sampling"] = " ".join(str(value) for value in vars(sampling).values())
    kinds = []
    for kind in study.system_variants:
        courses = {}
        for name, course in kind.scenario_bindings.items():
            scenario = _with_row_period(study, resolve_recording(course.scenario))
            courses[name] = ScenarioBinding(scenario, course.document)
            identity |= _recording_digest(name, scenario)
        kinds.append(SystemVariant(kind.name, kind.system, courses))
    made = dataclasses.replace(study, system_variants=tuple(kinds))
    return dataclasses.replace(made, identity={**identity, **program_digests(made)})


def program_digests(study: Study) -> dict[str, str]:
    """Return the digest of each Program of a prepared study by instance, variant and scenario.

    A key is "Program of `instance` in variant `variant`, scenario `scenario`".
    """
    found = {}
    for kind in study.system_variants:
        for name, course in kind.scenario_bindings.items():
            for instance, program in programs_of(kind.system, course.scenario).items():
                key = f"Program of `{instance}` in variant `{kind.name}`, scenario `{name}`"
                found[key] = program_digest(program)
    return found


def resample_study(study: Study, samples: int | None = None, seed: int | None = None) -> Study:
    """Return the study with another number of samples or another seed; None keeps the old one.

    For designs `samples` is the number of blocks or paths. Raises ValueError for samples outside 1
    to MAX_POINTS, a seed outside 0 to MAX_SEED, more than MAX_POINTS variants, and a study without
    random variables unless both are None.
    """
    old = study.sampling
    if (samples is not None or seed is not None) and not old.count:
        raise ValueError(f"`{study.name}` draws nothing: it has no samples and no seed")
    if samples is not None and not 1 <= samples <= MAX_POINTS:
        raise ValueError(f"{samples} samples are not from 1 to {MAX_POINTS}")
    if seed is not None and not 0 <= seed <= MAX_SEED:
        raise ValueError(f"the seed {seed} is not from 0 to {MAX_SEED}")
    each = design_group_size(old.method, len(study.random_variables))
    count = old.count if samples is None else samples * each
    new = dataclasses.replace(old, count=count, seed=old.seed if seed is None else seed)
    made = dataclasses.replace(study, sampling=new)
    if made.count > MAX_POINTS:
        raise ValueError(f"the study would have {made.count} variants; at most {MAX_POINTS}")
    return made


def _with_row_period(study: Study, scenario: Scenario) -> Scenario:
    """Return the scenario with the study's distance of rows.

    If no measure needs a signal, there are two rows: start and end.
    """
    assert scenario.horizon is not None
    every = study.every or scenario.every
    if not signals_of(study.measures):
        every = scenario.horizon
    return dataclasses.replace(scenario, every=Fraction(every))


def _recording_digest(name: str, scenario: Scenario) -> dict[str, str]:
    """Return the digest of a scenario's inputs if a recording is among them; else an empty dict."""
    if not any(stimulus.column for stimulus in scenario.inputs.values()):
        return {}
    inputs = repr(sorted(scenario.inputs.items())).encode()
    return {f"recording of scenario `{name}`": hashlib.sha256(inputs).hexdigest()}
