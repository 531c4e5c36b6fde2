"""Cases: a machine, its recordings, and effects of a chosen visibility."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from .effects import EFFECTS, Context, Draw
from .machines import Machine, columns, draw_machine, map_text, rounded, spec_text
from .manoeuvres import Plan, draw_plans
from .simulation import Array, Run, library
from .visibility import SizeNotFound, find_size, raw, refit, run_all, usable

LEAST, MOST, MODERATE = 3.1, 58.0, 14.9  # visibility after a refit
ATTEMPTS = 60


@dataclass(frozen=True)
class Case:
    """A case at one strength."""

    machine: Machine
    train: list[Run]
    held_out: list[Run]
    twins: list[Run]  # of the training, without effects
    label: dict[str, Any]


def combine(
    draws: Sequence[Draw], sizes: Sequence[float], n_plans: int
) -> tuple[dict[str, float], list[Array | None]]:
    """Slots and disturbances per plan of several effects together."""
    slots: dict[str, float] = {}
    loads: list[Array | None] = [None] * n_plans
    for draw, size in zip(draws, sizes, strict=True):
        slots |= draw.slots(size)
        if draw.shapes:
            for i, shape in enumerate(draw.shapes[:n_plans]):
                before = loads[i]
                loads[i] = size * shape if before is None else before + size * shape
    return slots, loads


def _context(
    rng: np.random.Generator, m: Machine, place: str, twins: list[Run], plans: list[Plan]
) -> Context:
    u = np.concatenate([run.command for run in twins])
    v = np.concatenate([run.clean[:, 0] for run in twins])
    peak = float(np.quantile(np.abs(u), 0.998))
    power = float(np.quantile(np.abs(u * v), 0.998))
    choice = str(rng.choice(place.split("|")))
    return Context(rng, m, choice, peak, float(np.sqrt(np.mean(u**2))), power, plans)


def _attempt(ids: Sequence[str], strength: float, rng: np.random.Generator) -> Case:
    kinds = [k for k in ("belt", "rotary") if all(k in EFFECTS[i].places for i in ids)]
    if not kinds:
        raise ValueError(f"no machine can have {' and '.join(ids)}")
    m = draw_machine(rng, str(rng.choice(kinds)))
    train, held_out = draw_plans(rng, m)
    n, plans = len(train), train + held_out
    twins = run_all(m, train, {}, [None] * n)
    if not usable(m, twins):
        raise SizeNotFound
    draws, sizes, effects = [], [], []
    for name in ids:
        c = _context(rng, m, EFFECTS[name].places[m.kind], twins, plans)
        draw = EFFECTS[name].draw(c)
        if rng.uniform() < 0.6:
            target, allowed = 3.6 * 4 ** rng.uniform(), (LEAST, MODERATE)
        else:
            target, allowed = 15 * 3.3 ** rng.uniform(), (LEAST, MOST)

        def run(size: float, draw: Draw = draw) -> list[Run]:
            return run_all(m, train, *combine([draw], [size], n))

        size = find_size(m, run, draw.typical, draw.largest, target, allowed)
        draws.append(draw)
        sizes.append(size)
        about = {"id": name, "place": c.place, "parameters": draw.label(strength * size)}
        effects.append(about)

    def record(factor: float) -> list[Run]:
        scaled = [factor * size for size in sizes]
        slots, loads = combine(draws, scaled, n + len(held_out))
        return run_all(m, plans, slots, loads)

    full = record(1.0)  # whatever the strength, so that twins are of the same draw
    if not usable(m, full):
        raise SizeNotFound
    if len(ids) > 1 and not LEAST <= refit(m, full[:n]).max() <= MOST:
        raise SizeNotFound  # together they hide each other, or are too much
    runs = record(strength)
    pairs = zip(m.signals, raw(m, runs[:n], twins), refit(m, runs[:n]), strict=True)
    label = {
        "effects": effects if strength else [],
        "machine": "belt_axis" if m.kind == "belt" else "rotary_table",
        "strength": strength,
        "rate_hz": m.rate,
        "base": m.base,
        "visibility": {s: {"raw": rounded(x, 4), "refit": rounded(y, 4)} for s, x, y in pairs},
    }
    return Case(m, runs[:n], runs[n:], twins, label)


def make_case(ids: Sequence[str], strength: float, seed: int, index: int) -> Case:
    """The case with this number of this seed: drawn again until its visibility is in range."""
    for attempt in range(ATTEMPTS):
        try:
            return _attempt(ids, strength, np.random.default_rng([seed, index, attempt]))
        except SizeNotFound:
            continue
    raise RuntimeError(f"{'+'.join(ids)}: not visible enough in {ATTEMPTS} draws")


def write_case(case: Case, folder: Path) -> None:
    """Spec, map and recordings."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "spec.yaml").write_text(spec_text(case.machine))
    (folder / "map.yaml").write_text(map_text(case.machine))
    for part, runs in (("train", case.train), ("held_out", case.held_out)):
        (folder / part).mkdir(exist_ok=True)
        for i, run in enumerate(runs):
            table = columns(case.machine, run.command, run.measured)
            row = ",".join(["%.9g", "%.9g", *["%.7g"] * (len(table) - 2)])
            lines = [row % values for values in zip(*table.values(), strict=True)]
            text = "\n".join([",".join(table), *lines, ""])
            (folder / part / f"run_{i:02d}.csv").write_text(text)


def parse_effects(text: str) -> list[tuple[str, ...]]:
    """The effects of each case, such as `all:4,none:20` or `a+b:1`."""
    result: list[tuple[str, ...]] = []
    for item in text.split(","):
        names, _, count = item.partition(":")
        if names.strip() == "all":
            groups: list[tuple[str, ...]] = [(name,) for name in EFFECTS]
        elif names.strip() == "none":
            groups = [()]
        else:
            groups = [tuple(name.strip() for name in names.split("+"))]
        for name in (name for group in groups for name in group):
            if name not in EFFECTS:
                raise ValueError(f"no effect {name!r}; there are {', '.join(EFFECTS)}")
        result += groups * int(count or 1)
    return result


def _job(job: tuple[tuple[str, ...], float, int, int, Path]) -> dict[str, Any]:
    ids, strength, seed, index, folder = job
    case = make_case(ids, strength, seed, index)
    write_case(case, folder)
    return case.label


def write_cases(
    out: Path, labels: Path, seed: int, effects: str, strength: float, jobs: int
) -> dict[str, Any]:
    """Write all cases and the labels; the order of the cases is drawn from the seed."""
    wanted = parse_effects(effects)
    order = np.random.default_rng([seed, 10**6]).permutation(len(wanted))
    names = [f"case_{place:03d}" for place in range(len(wanted))]
    work = [
        (wanted[i], strength, seed, int(i), out / name)
        for name, i in zip(names, order, strict=True)
    ]
    library()  # compiled before the processes fork
    if jobs > 1 and len(work) > 1:
        with get_context("fork").Pool(jobs) as pool:
            found = pool.map(_job, work, chunksize=1)
    else:
        found = [_job(item) for item in work]
    document = {"seed": seed, "cases": dict(zip(names, found, strict=True))}
    labels.parent.mkdir(parents=True, exist_ok=True)
    labels.write_text(json.dumps(document, indent=1) + "\n")
    return document
