"""Cases: true signals, their visibility after a refit of the naive model, and the files."""

import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from .effects import Effect, Plant, build, choices, coarse_step
from .kernel import OVEN, Array, simulate
from .machines import MACHINES, Case, Column, draw

FAMILIES = (("oven_relay", "oven_thermostat"), ("bridge",), ("tank_valve", "tank_level_switch"))
GRID, COARSE = 10, 1  # grid intervals per sample: of the truth, of the refitted naive model
VISIBLE = (3.0, 60.0)
ATTEMPTS = 60


@dataclass
class Drawn:
    """A case with its effects and their sizes at strength 1."""

    case: Case
    effects: list[Effect]
    sizes: list[float]
    seed: tuple[int, int]


def grid(program: Array, per_sample: int) -> tuple[Array, Array]:
    """Inputs at both ends of the grid intervals, held or interpolated as the map says."""
    n = len(program) - 1
    left = np.zeros((n * per_sample, 5))
    right = np.zeros_like(left)
    left[:, :3] = right[:, :3] = np.repeat(program[:-1], per_sample, axis=0)
    s = np.tile(np.arange(per_sample) / per_sample, n)
    slope = np.repeat(np.diff(program[:, 1]), per_sample)
    left[:, 1] += slope * s
    right[:, 1] += slope * (s + 1 / per_sample)
    return left, right


def true_signals(drawn: Drawn, k: int, strength: float) -> tuple[Array, Array]:
    """Outputs (samples x 2) of recording k, neither noisy nor rounded; modes on the grid."""
    case, program = drawn.case, drawn.case.programs[k]
    left, right = grid(program, GRID)
    step = 1 / (case.rate * GRID)
    t = np.arange(len(left) + 1) * step
    plant = Plant(k, t, step, left, right, case.kernel(case.base))
    if strength > 0:
        for effect, size in zip(drawn.effects, drawn.sizes, strict=True):
            effect.act(plant, strength * size)
    start = case.start(plant.left[0, 0], plant.left[0, 1])
    start[2] = start[int(plant.parameters.get("PLACE", 0))]
    states, modes = simulate(plant.parameters, step, plant.left, plant.right, start)
    columns = []
    for j in range(2):
        y = states[:, j]
        for sensor in plant.sensors.get(j, []):
            y = sensor(t, y)
        columns.append(y[::GRID])
    return np.column_stack(columns), modes[:-1].astype(float)


def naive_signals(case: Case, inputs: tuple[Array, Array], base: dict[str, float],
                  forced: bool = False) -> Array:  # fmt: skip
    """Outputs of the naive model on a grid of COARSE steps; `forced`: its switch stays closed."""
    left, right = inputs
    start = case.start(left[0, 0], left[0, 1])
    parameters = case.kernel(base) | ({"HYST": 0.0} if forced else {})
    states, _ = simulate(parameters, 1 / (case.rate * COARSE), left, right, start)
    return states[::COARSE, :2]


def _switched(case: Case, inputs: tuple[Array, Array], modes: Array) -> tuple[Array, Array]:
    """Inputs whose main channel is interrupted as the true switch was."""
    share = modes.reshape(len(inputs[0]), -1).mean(axis=1)
    share = np.sqrt(share) if case.kind == OVEN else share  # the power goes with the square
    left, right = (side.copy() for side in inputs)
    left[:, 0] *= share
    right[:, 0] *= share
    return left, right


def _rounded(signals: Array, drawn: Drawn, strength: float) -> Array:
    steps = [strength * coarse_step(drawn.case, drawn.effects, drawn.sizes, j) for j in range(2)]
    out = signals.copy()
    for j, step in enumerate(steps):
        if step > 0:
            zero = drawn.case.outputs[j].offset
            out[:, j] = zero + step * np.round((out[:, j] - zero) / step)
    return out


def _refitted(drawn: Drawn, strength: float, starts: list[Array] | None = None
              ) -> tuple[Array, Array, Array]:  # fmt: skip
    """Differences over noise before and after a refit; logarithms of the fitted over the true."""
    case = drawn.case
    sd = np.array([column.sd for column in case.outputs])
    truths = [true_signals(drawn, k, strength) for k in range(case.trains)]
    wanted = [_rounded(signals, drawn, strength) for signals, _ in truths]
    inputs = [grid(program, COARSE) for program in case.programs[: case.trains]]
    names, values = list(case.base), np.array(list(case.base.values()))

    thin = max(1, sum(map(len, wanted)) // 4000)  # samples between those that are fitted

    def difference(x: Array, given: list[tuple[Array, Array]], forced: bool = False) -> Array:
        base = dict(zip(names, (values * np.exp(x)).tolist(), strict=True))
        parts = [(naive_signals(case, one, base, forced) - target) / sd
                 for one, target in zip(given, wanted, strict=True)]  # fmt: skip
        out: Array = np.nan_to_num(np.concatenate(parts), nan=1e6, posinf=1e6, neginf=-1e6)
        return out

    def fit(start: Array, given: list[tuple[Array, Array]], forced: bool = False) -> Array:
        found: Array = least_squares(
            lambda x: difference(x, given, forced)[::thin].ravel(), np.clip(start, -1.19, 1.19),
            bounds=(-1.2, 1.2), diff_step=1e-4, x_scale=0.05,
            ftol=1e-3, xtol=1e-5, gtol=1e-12, max_nfev=12,
        ).x  # fmt: skip
        return found

    if starts is None:
        starts = [np.zeros(len(names))]
        if case.switch_inside:  # minima at other switching instants: start with the true ones
            held = [_switched(case, one, modes)
                    for one, (_, modes) in zip(inputs, truths, strict=True)]  # fmt: skip
            starts.append(fit(starts[0], held, forced=True))
    fits = [fit(start, inputs) for start in starts]
    best = min(fits, key=lambda x: _rms(difference(x, inputs)))
    return difference(np.zeros(len(names)), inputs), difference(best, inputs), best


def visibility(drawn: Drawn, strength: float = 1.0) -> dict[str, dict[str, float]]:
    """Root mean square difference over noise, to the clean twin and after a refit."""
    raw, refit, _ = _refitted(drawn, strength)
    return {
        column.name: {"raw": _rms(raw[:, j]), "refit": _rms(refit[:, j])}
        for j, column in enumerate(drawn.case.outputs)
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _size(case: Case, effect: Effect, target: float) -> float | None:
    """Size at which the refit leaves about `target`, by bisection in logarithms; None: none."""
    low, high = np.log(effect.low), np.log(effect.high)
    at, starts, size = low + 0.4 * (high - low), None, 0.0
    for _ in range(10):
        size = float(np.exp(at))
        _, left, fitted = _refitted(Drawn(case, [effect], [size], (0, 0)), 1.0, starts)
        seen = max(_rms(left[:, j]) for j in range(2))
        if 0.85 * target < seen < 1.18 * target:
            break
        if seen < target:
            low = at
        else:
            high = at
        if high - low < 0.03:
            break
        guess = at + np.log(target / max(seen, 1e-3))  # about proportional
        margin = 0.1 * (high - low)
        at = float(np.clip(guess, low + margin, high - margin))
        starts = [fitted * min(np.exp(at) / size, 1.5)]
    seen = max(v["refit"] for v in visibility(Drawn(case, [effect], [size], (0, 0))).values())
    return size if VISIBLE[0] < seen < VISIBLE[1] else None


def draw_case(ids: tuple[str, ...], seed: tuple[int, int]) -> Drawn:
    """Draw a machine that can have these effects, and their sizes at strength 1."""
    rng = np.random.default_rng(seed)
    family: tuple[str, ...] = ()
    for attempt in range(ATTEMPTS):
        if attempt % 3 == 0:
            family = FAMILIES[int(rng.integers(len(FAMILIES)))]
        case = draw(family[int(rng.integers(len(family)))], rng)
        effects: list[Effect] = []
        sizes: list[float] = []
        possible = choices(case)
        for id_ in ids:
            places = [place for name, place in possible if name == id_]
            if not places:
                break
            effect = build(case, id_, places[int(rng.integers(len(places)))], rng)
            low, high = (3.6, 14.0) if rng.random() < 0.6 else (14.0, 48.0)
            if id_ == "sensor_quantisation":  # no converter is coarser
                low, high = 3.3, 8.0
            size = _size(case, effect, float(np.exp(rng.uniform(np.log(low), np.log(high)))))
            if size is None:
                break
            effects.append(effect)
            sizes.append(size)
        else:
            return Drawn(case, effects, sizes, seed)
    raise ValueError(f"no machine shows {'+'.join(ids)}")


def known_effects() -> list[str]:
    """Names of all effects of at least one machine."""
    rng = np.random.default_rng(0)
    return sorted({id_ for machine in MACHINES for id_, _ in choices(draw(machine, rng))})


def _read(column: Column, signal: Array, noise: Array, step: float) -> Array:
    """A column of the recording: noise, then rounding, in the unit of the column."""
    value = (signal - column.offset + column.sd * noise) / column.scale
    width = max(step, column.step) / column.scale
    return np.round(value / width) * width if width > 0 else value


def recording(drawn: Drawn, k: int, strength: float) -> str:
    """CSV text of recording k."""
    case, program = drawn.case, drawn.case.programs[k]
    signals, _ = true_signals(drawn, k, strength)
    rng = np.random.default_rng([*drawn.seed, zlib.crc32(b"noise"), k])
    channels = {"U_s": 0 if case.kind == OVEN else 1, "p_s": 1, "T_amb": 1, "T_set": 2, "h_set": 2}
    values = [np.arange(len(program)) / case.rate]
    for column in case.inputs:
        signal = program[:, channels.get(column.name, 0)]
        values.append(_read(column, signal, rng.standard_normal(len(program)), 0.0))
    for j, column in enumerate(case.outputs):
        step = strength * coarse_step(case, drawn.effects, drawn.sizes, j)
        values.append(_read(column, signals[:, j], rng.standard_normal(len(program)), step))
    header = ",".join(["t_s", *(c.header for c in [*case.inputs, *case.outputs])])
    rows = [",".join([f"{row[0]:.7f}", *(f"{v:.7g}" for v in row[1:])])
            for row in np.column_stack(values).tolist()]  # fmt: skip
    return "\n".join([header, *rows]) + "\n"


def write_case(folder: Path, ids: tuple[str, ...], seed: tuple[int, int], strength: float
               ) -> dict[str, object]:  # fmt: skip
    """Write the files of a case; return its entry in the labels."""
    drawn = draw_case(ids, seed)
    case = drawn.case
    for name in ("train", "held_out"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    (folder / "spec.yaml").write_text(case.spec())
    (folder / "map.yaml").write_text(case.map())
    for k in range(len(case.programs)):
        name = f"train/run_{k}.csv" if k < case.trains else f"held_out/run_{k - case.trains}.csv"
        (folder / name).write_text(recording(drawn, k, strength))
    present = zip(drawn.effects, drawn.sizes, strict=True) if strength > 0 else ()
    return {
        "effects": [
            {"id": e.id, "place": e.place, "parameters": e.label(strength * size)}
            for e, size in present
        ],
        "machine": case.machine,
        "strength": strength,
        "rate_hz": case.rate,
        "base": case.base,
        "visibility": visibility(drawn, strength),
    }
