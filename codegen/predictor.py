"""Predictor: a continuous automaton in C that follows recorded signals, corrected by a gain."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.build import compile_program, compiler, compiler_version, optimised
from codegen.cache import key_of, stored
from codegen.harness import tunable
from codegen.kalman_gains import MOST_SAMPLES, kalman_gains
from codegen.lean import lean
from codegen.loading import loaded
from codegen.names import c_member, c_type
from codegen.rendering import render
from codegen.runs import Prediction, Recorded, Runs
from codegen.source import c_files
from codegen.tracks import tracks
from codegen.vectors import has_vectors
from language.program import Program, short

Reals = NDArray[np.float64]
LIBRARY_FLAGS = (
    *optimised("O1"),
    *("-fno-semantic-interposition", "-shared", "-fPIC", "-w", "-Dvolatile="),
)
"""One file, so that all is inlined. Recordings are followed as soon as with -O2, which compiles for
a tenth longer. No calibration tool writes into the page of a predictor: not volatile, a step takes
0.7 of the time."""
SHARED = 3
"""Dimensions of steady gains that all points have in common: (modes, states, seen)."""
MATHEMATICS = re.compile(r"ha_mathf?\.c")
FUNCTION = re.compile(r"^(?=\w+ ha_\w+\()", re.MULTILINE)


@dataclass(frozen=True)
class Columns:
    """What the arrays of a predictor hold, in their order: names, and `page` with its defaults."""

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    input_types: tuple[str, ...]
    seen: tuple[str, ...]
    modes: tuple[int, ...]
    page: Mapping[str, float]


def columns_of(program: Program, seen: Sequence[str]) -> Columns:
    """Return the columns of a Program whose outputs `seen` are compared with recordings."""
    return Columns(
        program.name,
        tuple(short(v.name) for v in program.variables if v.name.startswith("state.")),
        tuple(short(v.name) for v in program.inputs),
        tuple(c_type(v, program.number) for v in program.inputs),
        tuple(seen),
        tuple(mode.number for mode in program.modes),
        {short(c.name): c.value for c in tunable(program)},
    )


class Predictor:
    """A loaded library with the names of its arrays' columns."""

    def __init__(self, columns: Columns, library: Path) -> None:
        """Load a library that `built` made."""
        self.columns = columns
        self.states = columns.states
        self.seen = columns.seen
        self.inputs = columns.inputs
        self.modes = columns.modes
        self.page = columns.page
        self._library = loaded(library)

    def differences(
        self,
        page: Reals,
        inputs: Reals,
        mode: int,
        substeps: int,
        states: Reals,
        sizes: Reals,
        pushes: Reals,
    ) -> tuple[Reals, Reals, Reals]:
        """Return how the states `substeps` major steps later (states, states) and what is then
        seen (seen, states) change with the states, and these states with the inputs held until
        then (states, inputs): by central differences of `sizes` (states,) and `pushes` (inputs,).
        """
        count = len(self.states)
        ahead, shown = np.empty((count, count)), np.empty((count, len(self.seen)))
        moved = np.empty((len(self.inputs), count))
        given = [np.ascontiguousarray(a, dtype=np.float64) for a in (states, sizes, pushes)]
        self._library.modewright_differences(
            _at(page), _at(inputs), mode, substeps, *(_at(a) for a in given),
            _at(ahead), _at(shown), _at(moved),
        )  # fmt: skip
        return ahead.T, shown.T, moved.T

    def gains(
        self,
        phi: Reals,
        c: Reals,
        q: Reals,
        r: Reals,
        start: Reals,
        first: int,
        most: int = MOST_SAMPLES,
    ) -> tuple[Reals, Reals, Reals] | None:
        """Return the gains of a linear model of its states and signals (see `kalman_gains`)."""
        return kalman_gains(phi, c, q, r, start, first, most)

    def predict(
        self,
        page: Reals,
        inputs: Reals,
        measured: Reals,
        first_gains: Reals,
        gains: Reals,
        substeps: int,
        linear: bool,
        pushes: Reals | None = None,
    ) -> Prediction:
        """Follow a recording; arrays are C-contiguous; inputs are held, or `linear` in between.

        `page` (tunables,), `inputs` (samples, inputs), `measured` (samples, seen) with NaN where
        nothing is known, `first_gains` (first, states, seen), `gains` (modes, states, seen).
        `pushes` (samples, states) are added to the states once they are corrected.
        """
        samples = len(inputs)
        innovations = np.full((samples, len(self.seen)), np.nan)
        seen = np.full((samples, len(self.seen)), np.nan)
        states = np.empty((samples, len(self.states)))
        modes = np.zeros(samples, dtype=np.int16)
        done = self._library.modewright_predict(
            _at(page),
            _at(inputs),
            _at(measured),
            _at(first_gains),
            len(first_gains),
            _at(gains),
            samples,
            substeps,
            int(linear),
            None if pushes is None else _at(pushes),
            _at(innovations),
            _at(seen),
            _at(states),
            modes.ctypes.data,
        )
        return Prediction(innovations, seen, states, modes, int(done))

    def predict_all(
        self,
        pages: Reals,
        recorded: Recorded,
        first_gains: Reals,
        gains: Reals,
        substeps: int,
        limits: Reals,
    ) -> Runs:
        """Follow several recordings, each with its row of `pages` (recordings, tunables).

        Innovations beyond `limits` (seen,) count in proportion. The other arrays are those of
        `predict`.
        """
        samples = len(recorded.inputs)
        whole = Prediction(
            np.empty((samples, len(self.seen))),
            np.empty((samples, len(self.seen))),
            np.empty((samples, len(self.states))),
            np.zeros(samples, dtype=np.int16),
            samples,
        )
        done = np.empty(len(pages), dtype=np.int64)
        told = (whole.innovations, whole.seen, whole.states, whole.modes, done)
        self._follow(pages, 1, recorded, (first_gains, gains), substeps, told)
        for part in _lost(recorded.starts, done):
            whole.innovations[part] = whole.seen[part] = np.nan
        squares, counts = self.squares(whole.innovations, recorded, limits)
        return Runs(whole, recorded.starts, done, squares, counts)

    def predict_points(
        self,
        pages: Reals,
        recorded: Recorded,
        first_gains: Reals,
        gains: Reals,
        substeps: int,
    ) -> tuple[Reals, NDArray[np.int64]]:
        """Follow several recordings at several points, with `pages` (points, recordings, tunables).

        Return the innovations (points, samples, seen), and how many samples were done (points,
        recordings). The other arrays are those of `predict`; gains may be by points as well.
        """
        points = len(pages)
        innovations = np.empty((points, len(recorded.inputs), len(self.seen)))
        done = np.empty(pages.shape[:2], dtype=np.int64)
        told = (innovations, None, None, None, done)
        self._follow(pages, points, recorded, (first_gains, gains), substeps, told)
        for one, here in zip(innovations, done, strict=True):
            for part in _lost(recorded.starts, here):
                one[part] = np.nan
        return innovations, done

    def squares(self, innovations: Reals, recorded: Recorded, limits: Reals) -> tuple[Reals, Reals]:
        """Return the sums of the squares of innovations (samples, seen) that count, and how many
        they are (recordings, seen); those beyond `limits` (seen,) count in proportion.
        """
        shape = (len(recorded.linear), len(self.seen))
        squares, counts = np.empty(shape), np.empty(shape)
        self._library.modewright_squares(
            *(_at(innovations), shape[0], _at(recorded.starts), _at(recorded.skips)),
            *(_at(np.ascontiguousarray(limits)), _at(squares), _at(counts)),
        )
        return squares, counts

    def _follow(
        self,
        pages: Reals,
        points: int,
        recorded: Recorded,
        gains: tuple[Reals, Reals],
        substeps: int,
        told: Sequence[NDArray[Any] | None],
    ) -> None:
        first, steady = gains
        starts, linear = recorded.starts, recorded.linear
        own = int(steady.ndim > SHARED)
        self._library.modewright_predict_all(
            *(_at(a) for a in (pages, recorded.inputs, recorded.measured, first)),
            *(first.shape[own], _at(steady), own, points, len(linear)),
            *(_at(starts), _at(linear), substeps),
            *(None if a is None else _at(a) for a in told),
        )


def _lost(starts: NDArray[np.int64], done: NDArray[np.int64]) -> list[slice]:
    """Return the samples behind the one in which each run that was not done left all bounds."""
    ends = zip(starts[:-1].tolist(), starts[1:].tolist(), done.tolist(), strict=True)
    return [slice(low + count + 1, high) for low, high, count in ends if low + count < high]


def _at(values: NDArray[Any]) -> int:
    return int(values.ctypes.data)


@contextmanager
def built(program: Program, columns: Columns) -> Iterator[Path]:
    """Give the library of a Program, kept from an earlier run if there was one.

    Raises ToolMissing, BuildError.
    """
    program = lean(program)
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        abreast = tracks(program, columns.states, columns.seen) if has_vectors() else None
        files = c_files(program, leaps="off" if abreast and not abreast["record"] else "anew")
        context = {
            **_context(columns),
            "tracks": abreast,
            "mathematics": next((f for f in files if MATHEMATICS.match(f)), ""),
        }
        files["predictor.c"] = render("predictor.c.jinja", context)
        for file, text in files.items():
            kept = FUNCTION.sub("static ", text) if file.startswith("ha_math") else text
            (folder / file).write_text(kept)
        sources = [folder / file for file in files]
        command = [*compiler(), *LIBRARY_FLAGS]
        key = key_of(sources, command, compiler_version())
        main = [folder / "predictor.c"]
        yield stored(key, lambda made: compile_program(main, made, LIBRARY_FLAGS), folder)


def _context(columns: Columns) -> dict[str, object]:
    return {
        "name": columns.name,
        "states": columns.states,
        "seen": columns.seen,
        "modes": columns.modes,
        "page": [c_member(f"calibration.{name}") for name in columns.page],
        "inputs": [
            {"member": name, "type": kind}
            for name, kind in zip(columns.inputs, columns.input_types, strict=True)
        ],
    }
