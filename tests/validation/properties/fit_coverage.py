"""Fit coverage: how often the intervals of a fit contain the parameters of simulated recordings.

A machine is simulated by the engine with parameters drawn within their ranges, and noise is added
to its outputs. The standard errors of `fit` are compared with the bound of Cramer and Rao, from
finite differences of the simulation without noise and with the noise as it is. The machines are
the random ones of `coverage_machines.yaml`, the specs of `spec/recorded` with the inputs of their
recordings, and the specs that are beside recordings.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import modewright as mw
from diagnosis.data.array_types import Reals
from diagnosis.data.sampled_recording import (
    Hold,
    SampledRecording,
    compared_outputs,
    share_period,
)
from diagnosis.estimation.innovations import KalmanGains, predict_at_points
from diagnosis.model.candidate import Candidate, compile_candidate
from diagnosis.model.parameter import FreeParameter, free_parameters_of, si_unit
from diagnosis.pipeline.diagnosis_case import Case, read_series
from language.loading.load import automaton_of
from language.loading.recording_map_reader import read_map
from language.model.automaton import Automaton
from language.overlays.expand_document import Project, expand_document, read_document
from language.overlays.name_types import format_si_unit
from tests.validation.evidence.evidence_store import ROOT

MACHINES = Path(__file__).with_name("coverage_machines.yaml")
RUNS, SAMPLES, LONGEST = 3, 1500, 4000
"""Recordings of a random machine, samples of each unless its template says otherwise, and most
samples of a real recording."""
STEPS = 40
"""Mean number of steps of an input in a recording."""
MOST_RUNS = 3
"""Most real recordings whose inputs are used."""
NOISE = (0.003, 0.03)
"""Noise of the outputs of a random machine, in standard deviations of their signals."""
RANGE = (0.5, 2.0)
"""Range of a parameter of a random machine, in declared values."""
STEP = 1e-6
"""Relative step of the differences of the Cramer-Rao bound."""
IDENTIFIABLE = 0.1
"""A parameter is identifiable if its Cramer-Rao bound is below this fraction of its range."""
Z_95 = 1.96
RECORDED = {
    "blind_driveline": (),
    "bmw_i3": ("bmw_i3/trip_a11.csv.gz",),
    "brfd_damper": (
        "brfd_damper/sine_0.5Hz_36lb_0.5in_1024Hz.csv.gz",
        "brfd_damper/sine_0.5Hz_80lb_1in_1024Hz.csv.gz",
    ),
    "emps": ("emps/emps.csv.gz",),
    "leaf_motor_side": ("nissan_leaf/drive_eco.csv", "nissan_leaf/drive_2.csv"),
    "leaf_vehicle": ("nissan_leaf/drive_eco.csv", "nissan_leaf/drive_2.csv"),
}
"""The recordings of each spec below `spec/recorded`; without one its inputs are drawn."""
DRIVELINE_INPUTS = {"T_em": (60.0, 60.0), "T_br": (0.0, 0.0)}
"""Mean and amplitude [N*m] of the drawn inputs of `blind_driveline`."""


@dataclass(frozen=True)
class Machine:
    """A spec with inputs: `inputs` (samples, inputs) of each run, held as `holds` say.

    `starts` are the values [SI] of states at the start of each run, `noise` (outputs,) the standard
    deviations [SI] of the noise, or None if they are drawn as fractions of the signals.
    """

    name: str
    text: str
    outputs: tuple[str, ...]
    period: Fraction
    inputs: tuple[Reals, ...]
    holds: tuple[Hold, ...]
    starts: tuple[dict[str, float], ...]
    noise: Reals | None


@dataclass(frozen=True)
class ParameterResult:
    """One parameter of one machine; `bound` is the standard error of Cramer and Rao [SI]."""

    machine: str
    parameter: str
    truth: float
    estimate: float
    std: float
    bound: float
    is_determined: bool
    is_identifiable: bool
    note: str
    error_before: float
    error_after: float

    @property
    def z(self) -> float:
        """The error of the estimate in standard errors."""
        return (self.estimate - self.truth) / self.std if self.std > 0.0 else np.inf


def random_machine(number: int, seed: int) -> Machine:
    """Return a random machine: the templates in turn, with random values, inputs and holds."""
    random = np.random.default_rng([seed, number])
    templates = yaml.safe_load(MACHINES.read_text("utf-8"))
    name, made = list(templates.items())[number % len(templates)]
    body = yaml.safe_load(made["body"])
    lines = {}
    for one, (value, unit) in made["parameters"].items():
        value = float(f"{value * 2.0 ** random.uniform(-1.0, 1.0):.3g}")
        limits = [float(f"{value * part:.3g}") for part in RANGE]
        lines[one] = {"value": f"{value:.6g} {unit}", "range": limits}
    spec = {
        "language": 1,
        "automaton": name,
        "step": f"{float(made['period'].split()[0]) / 2:.6g} s",
        "recording_map": f"{name}_columns",
        **body,
        "parameters": {**lines, **body.get("parameters", {})},
        "inputs": {one: {"unit": how["unit"]} for one, how in made["inputs"].items()},
    }
    samples = made.get("samples", SAMPLES)
    runs = tuple(
        np.column_stack([_draw_input(random, how, samples) for how in made["inputs"].values()])
        for _ in range(RUNS)
    )
    is_held = random.random() < 0.5
    holds: tuple[Hold, ...] = tuple("previous" if is_held else None for _ in made["inputs"])
    period = Fraction(made["period"].split()[0])
    text = yaml.safe_dump(spec, sort_keys=False, width=200)
    outputs = tuple(body["outputs"])
    return Machine(f"{name}_{number}", text, outputs, period, runs, holds, ({},) * RUNS, None)


def _draw_input(random: np.random.Generator, how: Mapping[str, Any], samples: int) -> Reals:
    """Return an input (samples,): random steps of random length, or random switching."""
    lengths = random.geometric(STEPS / samples, samples)
    places = np.repeat(np.arange(samples), lengths)[:samples]
    if "switched" in how:
        return np.asarray(random.choice(how["switched"], samples)[places], dtype=np.float64)
    mean, amplitude = float(how["mean"]), float(how["amplitude"])
    return np.asarray(mean + amplitude * random.uniform(-1.0, 1.0, samples)[places])


def recorded_machine(spec: Path, files: Sequence[Path], seed: int) -> Machine:
    """Return a spec with the inputs, the starts and the noise of its recordings."""
    with tempfile.TemporaryDirectory() as folder:
        # the map is beside the spec, where a project does not search
        copied = Path(folder) / "spec"
        shutil.copytree(spec.parent, copied, ignore=shutil.ignore_patterns("*.csv*", "truth"))
        return _recorded_machine(copied / spec.name, Project(Path(folder)), files, seed)


def _recorded_machine(spec: Path, project: Project, files: Sequence[Path], seed: int) -> Machine:
    """Return a spec of a project with the inputs, the starts and the noise of its recordings."""
    document = expand_document(read_document(spec), project)
    automaton = automaton_of(document, project)
    assert automaton.recording_map is not None
    mapping = read_map(read_document(project.path_of(automaton.recording_map.text)), project)
    outputs = compared_outputs(mapping, automaton)
    if files:
        case = Case(document, project, mapping, tuple(files))
        series = [one for path in files for one in read_series(path, case, automaton, outputs)]
        series = list(share_period(sorted(series, key=lambda one: -one.count)[:MOST_RUNS]))
    else:
        series = [_drawn_series(automaton, outputs, seed, k) for k in range(RUNS)]
    starts = tuple(
        {
            name: float(value)
            for name, value in zip(outputs, one.first_measured, strict=True)
            if name in automaton.states and files and np.isfinite(value)
        }
        for one in series
    )
    noise = np.median([one.noise[0] for one in series], axis=0) if files else np.array([0.3, 0.03])
    period = Fraction(f"{float(series[0].period):.6g}")
    return Machine(
        automaton.name,
        spec.read_text("utf-8"),
        outputs,
        period,
        tuple(one.inputs[:LONGEST] for one in series),
        series[0].holds,
        starts,
        noise,
    )


def _drawn_series(
    automaton: Automaton, outputs: Sequence[str], seed: int, run: int
) -> SampledRecording:
    """Return a recording of drawn inputs of the driveline, without measured values."""
    random = np.random.default_rng([seed, run])
    inputs = np.column_stack(
        [
            _draw_input(random, {"mean": mean, "amplitude": size}, SAMPLES)
            for mean, size in (DRIVELINE_INPUTS[name] for name in automaton.inputs)
        ]
    )
    blank = np.full((SAMPLES, len(outputs)), np.nan)
    return SampledRecording(
        "drawn", Fraction(1, 100), Fraction(0), inputs, blank, holds=(None,) * 2
    )


def draw_truth(free: Sequence[FreeParameter], random: np.random.Generator) -> dict[str, float]:
    """Return values [SI] drawn within the ranges, in the logarithm for positive ranges."""
    truth = {}
    for one in free:
        part = random.uniform(0.0, 1.0)
        if one.is_log and one.low > 1e-2 * one.start:
            truth[one.name] = one.low * (one.high / one.low) ** part
        else:
            truth[one.name] = one.low + part * (one.high - one.low)
    return truth


@dataclass(frozen=True)
class Experiment:
    """The files of a machine in a folder, its true parameters and their bounds [SI].

    `worst` is the largest deviation of the predictor without corrections from the engine, in
    standard deviations of the noise.
    """

    folder: Path
    spec: str
    files: tuple[str, ...]
    truth: dict[str, float]
    bound: dict[str, float]
    worst: float


def simulate_machine(machine: Machine, folder: Path, seed: int) -> Experiment:
    """Write the spec, the map and the noisy recordings of a machine, simulated by the engine."""
    random = np.random.default_rng([seed, 1])
    (folder / "spec").mkdir(parents=True)
    name = yaml.safe_load(machine.text)["automaton"]
    path = folder / "spec" / f"{name}.yaml"
    path.write_text(machine.text, "utf-8")
    map_name = yaml.safe_load(machine.text)["recording_map"]
    (folder / "spec" / "columns.yaml").write_text(f"language: 1\nmap: {map_name}\n", "utf-8")
    project = Project(folder)
    document = expand_document(read_document(path), project)
    automaton = automaton_of(document, project)
    free = free_parameters_of(automaton)
    truth = draw_truth(free, random)
    runs = [_simulate(machine, automaton, folder, truth, k) for k in range(len(machine.inputs))]
    units, clean = runs[0][0], [outputs for _, outputs in runs]
    _write_map(machine, automaton, folder, units)
    spread = np.std(np.concatenate(clean), axis=0)
    noise = machine.noise
    if noise is None:
        low, high = np.log(NOISE)
        noise = spread * np.exp(random.uniform(low, high, len(spread)))
    noise = np.maximum(noise, 1e-6 * spread)
    files = []
    for k, (inputs, outputs) in enumerate(zip(machine.inputs, clean, strict=True)):
        measured = outputs + noise * random.standard_normal(outputs.shape)
        _write_csv(folder / f"run_{k}.csv", machine, automaton, inputs, measured)
        files.append(f"run_{k}.csv")
    candidate = compile_candidate(document, project, (), (), machine.outputs, machine.period)
    bound, worst = cramer_rao(machine, candidate, truth, clean, noise)
    return Experiment(folder, name, tuple(files), truth, bound, worst)


def _write_map(machine: Machine, automaton: Automaton, folder: Path, units: dict[str, str]) -> None:
    """Write the map of the recordings, with all columns in SI units."""
    assert automaton.recording_map is not None
    columns: dict[str, dict[str, str]] = {}
    for (name, declared), hold in zip(automaton.inputs.items(), machine.holds, strict=True):
        columns[f"in_{name}"] = {"to": name, "unit": format_si_unit(declared.unit.dimension)}
        if hold is not None:
            columns[f"in_{name}"]["hold"] = hold
    for name in machine.outputs:
        columns[f"out_{name}"] = {"compare": name, "unit": units[name]}
    head = {"language": 1, "map": automaton.recording_map.text}
    table = {**head, "time": {"column": "t", "unit": "s"}, "columns": columns}
    text = yaml.safe_dump(table, sort_keys=False, width=200)
    (folder / "spec" / "columns.yaml").write_text(text, "utf-8")


def _write_csv(
    path: Path, machine: Machine, automaton: Automaton, inputs: Reals, outputs: Reals
) -> None:
    """Write a recording: times, inputs and outputs in SI units."""
    names = ["t", *(f"in_{one}" for one in automaton.inputs)]
    names += [f"out_{one}" for one in machine.outputs[: outputs.shape[1]]]
    period = float(machine.period)
    rows = (
        ",".join([f"{k * period:.9g}", *(f"{value:.12g}" for value in (*row, *seen))])
        for k, (row, seen) in enumerate(zip(inputs, outputs, strict=True))
    )
    path.write_text("\n".join([",".join(names), *rows, ""]), "utf-8")


def _simulate(
    machine: Machine, automaton: Automaton, folder: Path, truth: dict[str, float], run: int
) -> tuple[dict[str, str], Reals]:
    """Return the units and the outputs (samples, outputs) of a run without noise, by the engine."""
    inputs = machine.inputs[run]
    _write_csv(folder / "inputs.csv", machine, automaton, inputs, np.empty((len(inputs), 0)))
    columns = {
        f"in_{name}": {
            "to": name,
            "unit": format_si_unit(declared.unit.dimension),
            "hold": hold or "previous",
        }
        for (name, declared), hold in zip(automaton.inputs.items(), machine.holds, strict=True)
    }
    scenario: dict[str, object] = {
        "language": 1,
        "scenario": "run",
        "of": automaton.name,
        "horizon": "recording",
        "recording": {
            "file": str(folder / "inputs.csv"),
            "time": {"column": "t", "unit": "s"},
            "columns": columns,
        },
        "record": {"every": f"{float(machine.period):.9g} s"},
    }
    if machine.starts[run]:
        scenario["initial"] = {
            name: f"{value:.12g} {format_si_unit(automaton.states[name].unit.dimension)}"
            for name, value in machine.starts[run].items()
        }
    path = folder / "run.yaml"
    path.write_text(yaml.safe_dump(scenario, sort_keys=False, width=200), "utf-8")
    values = {
        one: f"{value:.15g} {si_unit(automaton.parameters[one])}".removesuffix(" 1")
        for one, value in truth.items()
    }
    result = mw.simulate(automaton.name, path, values, folder)
    if result.stopped:
        raise ValueError(f"{machine.name}: {result.stopped}")
    units = {name: result.units[f"{automaton.name}.{name}"] for name in machine.outputs}
    signals = [result.signals[f"{automaton.name}.{name}"] for name in machine.outputs]
    grid = float(machine.period) * np.arange(len(inputs))
    rows = np.minimum(np.searchsorted(result.times, grid - 1e-9), len(result.times) - 1)
    return units, np.column_stack(signals)[rows].astype(np.float64)


def cramer_rao(
    machine: Machine,
    candidate: Candidate,
    truth: dict[str, float],
    clean: Sequence[Reals],
    noise: Reals,
) -> tuple[dict[str, float], float]:
    """Return the standard errors [SI] of Cramer and Rao, and the largest deviation in noises.

    The deviation is that of the simulation without corrections from the engine. The initial states
    are known. The information of a uniform distribution over the ranges, 12 over the square of
    their width, is added, as otherwise a parameter without influence has no bound.
    """
    holds = tuple(hold or "previous" for hold in machine.holds)
    series = [
        SampledRecording(f"{k}", machine.period, Fraction(0), inputs, outputs, holds=holds)
        for k, (inputs, outputs) in enumerate(
            zip(machine.inputs, (np.ascontiguousarray(one) for one in clean), strict=True)
        )
    ]
    states, outputs = len(candidate.predictor.states), len(machine.outputs)
    gains = KalmanGains(
        np.zeros((0, states, outputs)), np.zeros((len(candidate.predictor.modes), states, outputs))
    )
    free = candidate.free_parameters
    points = [truth]
    for one in free:
        size = STEP * (abs(truth[one.name]) if one.is_log else one.high - one.low)
        points += [{**truth, one.name: truth[one.name] + sign * size} for sign in (1.0, -1.0)]
    values, limits = [[point] * len(series) for point in points], np.full(outputs, np.inf)
    found = predict_at_points(candidate, series, values, gains, limits)
    rows = []
    for k, one in enumerate(free):
        size = STEP * (abs(truth[one.name]) if one.is_log else one.high - one.low)
        change = (found[1 + 2 * k].values - found[2 + 2 * k].values) / (2.0 * size)
        rows.append((change / noise).ravel())
    fisher = np.array(rows) @ np.array(rows).T
    scale = np.array([one.high - one.low for one in free])
    scaled = fisher * np.outer(scale, scale) + 12.0 * np.eye(len(scale))
    bound = scale * np.sqrt(np.diag(np.linalg.inv(scaled)))
    worst = float(np.max(np.abs(found[0].values / noise)))
    return {one.name: float(b) for one, b in zip(free, bound, strict=True)}, worst


def fit_machine(machine: Machine, experiment: Experiment) -> Iterator[ParameterResult]:
    """Fit the recordings of a machine; yield its parameters."""
    files = [experiment.folder / one for one in experiment.files]
    found = mw.fit(experiment.spec, files, root=experiment.folder, anyway=True)
    ranges = {one.name: one for one in found.estimate.candidate.free_parameters}
    errors = [
        float(np.mean([getattr(one, name) for one in found.misfits.values()]))
        for name in ("nrmse_before", "nrmse_after")
    ]
    for one in found.parameters:
        bound, limits = experiment.bound[one.name], ranges[one.name]
        yield ParameterResult(
            machine.name,
            one.name,
            experiment.truth[one.name],
            one.quantity.value,
            one.quantity.std,
            bound,
            one.name not in found.undetermined,
            bound < IDENTIFIABLE * (limits.high - limits.low),
            one.note,
            *errors,
        )


def machines(cases: int, seed: int, recordings: Path | None) -> Iterator[Machine]:
    """Yield the random machines, then the shipped specs and those beside recordings."""
    for number in range(cases):
        yield random_machine(number, seed)
    for name, files in RECORDED.items():
        if recordings is not None or not files:
            paths = [recordings / one for one in files] if recordings is not None else []
            yield recorded_machine(ROOT / "spec" / "recorded" / f"{name}.yaml", paths, seed)
    for spec in sorted(recordings.glob("*/*.yaml")) if recordings is not None else ():
        if "automaton:" in spec.read_text("utf-8"):
            yield recorded_machine(spec, sorted(spec.parent.glob("*.csv.gz"))[:MOST_RUNS], seed)


def run_study(
    cases: int, seed: int, recordings: Path | None, out: Path, only: Sequence[str] = ()
) -> list[ParameterResult]:
    """Return the results of all machines; those in the file `out` are read and not fitted again."""
    known = [json.loads(line) for line in out.read_text().splitlines()] if out.exists() else []
    results = [ParameterResult(**one) for one in known]
    done = {one.machine for one in results}
    for number, machine in enumerate(machines(cases, seed, recordings)):
        if machine.name in done or (only and machine.name not in only):
            continue
        with tempfile.TemporaryDirectory() as folder:
            begun = time.monotonic()
            try:
                experiment = simulate_machine(machine, Path(folder) / "case", seed + number)
            except (mw.SpecError, ValueError) as error:
                print(f"# {machine.name} is left out: {error}")
                continue
            if experiment.worst > 1e-2:
                print(f"# {machine.name}: simulation differs by {experiment.worst:.2g} noises")
            found = list(fit_machine(machine, experiment))
        print(f"# {machine.name}: {time.monotonic() - begun:.1f} s", flush=True)
        print("\n".join(format_row(one) for one in found), flush=True)
        results += found
        with out.open("a") as lines:
            lines.writelines(json.dumps(asdict(one)) + "\n" for one in found)
    return results


def diagnose_machines(cases: int, seed: int) -> list[str]:
    """Print and return the outcome of the diagnosis of each random machine, as it is complete."""
    outcomes: list[str] = []
    for number in range(cases):
        machine = random_machine(number, seed)
        with tempfile.TemporaryDirectory() as folder:
            experiment = simulate_machine(machine, Path(folder) / "case", seed + number)
            files = [experiment.folder / one for one in experiment.files]
            begun = time.monotonic()
            report = mw.diagnose(experiment.spec, files, root=experiment.folder, anyway=True)
        verdict = report.verdict
        named = ", ".join(one.id for one in verdict.effects)
        print(
            f"{machine.name:20} {verdict.verdict} {named} {time.monotonic() - begun:.1f} s",
            flush=True,
        )
        outcomes.append(verdict.verdict)
    return outcomes


def format_row(one: ParameterResult) -> str:
    """Return a line of the table."""
    return (
        f"{one.machine:20} {one.parameter:8} {one.truth:11.5g} {one.estimate:11.5g} {one.std:10.3g}"
        f" {one.z:8.2f} {one.bound:10.3g} {one.std / one.bound:7.2f}"
        f"  {'' if one.is_determined else 'undetermined '}{one.note}"
    )


def summary(results: Sequence[ParameterResult]) -> list[str]:
    """Return the lines of coverage, half-width, share of determined parameters and error."""
    covered = [abs(one.z) <= Z_95 for one in results]
    ratios = [one.std / one.bound for one in results if one.is_identifiable]
    known = [one.is_determined for one in results if one.is_identifiable]
    worse = {one.machine for one in results if one.error_after > one.error_before}
    return [
        f"coverage of 95 % intervals: {np.mean(covered):.1%} of {len(covered)} parameters",
        f"median half-width over the bound: {np.median(ratios):.2f}",
        f"identifiable parameters that are determined: {np.mean(known):.1%} of {len(known)}",
        f"models that became worse: {', '.join(sorted(worse)) or 'none'}",
    ]


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and print its table; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=20, help="number of random machines")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--recordings", type=Path, help="folder of the real recordings")
    parser.add_argument("--out", type=Path, default=Path("build/fit_coverage.jsonl"))
    parser.add_argument("--only", nargs="*", default=(), help="names of machines")
    parser.add_argument("--diagnose", action="store_true", help="diagnose the random machines")
    asked = parser.parse_args(arguments)
    if asked.diagnose:
        outcomes = diagnose_machines(asked.cases, asked.seed)
        print(f"nothing is missing: {outcomes.count('nothing_missing')} of {len(outcomes)}")
        return 0
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    print("machine, parameter, truth, estimate, std, z, Cramer-Rao, std / Cramer-Rao")
    results = run_study(asked.cases, asked.seed, asked.recordings, asked.out, asked.only)
    print("\n".join(summary(results)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
