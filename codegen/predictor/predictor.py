"""Predictor: a continuous automaton in C that follows recorded signals, corrected by a gain."""

from __future__ import annotations

import ctypes
import re
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.emit.c_module import emit_c_files, restrict_to_step
from codegen.emit.c_names import c_member, c_type
from codegen.harness.harness import tunable_constants
from codegen.passes.dead_stores import remove_dead_stores
from codegen.predictor.kalman_gains import MAX_SAMPLES, compute_kalman_gains
from codegen.predictor.predictions import Prediction, StackedPrediction, StackedRecordings
from codegen.predictor.simd_recordings import simd_recordings_context
from codegen.toolchain.build_cache import get_or_build, key_of
from codegen.toolchain.compiler import (
    compile_program,
    compiler_version,
    find_compiler,
    flags_at_level,
    has_gcc_vectors,
)
from codegen.toolchain.templates import render
from language.ir.program import Program, unqualified_name

REMOVABLE_GROUPS = ("equation.", "work.")
"""What is set for those who look at an instance or at a step: beyond that nothing happens."""


def slice_to_outputs(program: Program) -> Program:
    """Return what C runs of a Program, less the equations that neither it nor an output reads.

    Its tunable parameters and inputs stay the same, or the Program does.
    """
    step_program = restrict_to_step(program)
    sliced = remove_dead_stores(step_program, REMOVABLE_GROUPS)
    return (
        sliced
        if _external_interface(sliced, restrict_to_step(sliced))
        == _external_interface(step_program, step_program)
        else step_program
    )


def _external_interface(program: Program, step_program: Program) -> tuple[object, ...]:
    """What a caller sets from outside: tunable parameters, and inputs as they are held in what is
    `step_program` of it.
    """
    held_inputs = (v.name for v in step_program.variables if v.name.startswith("before."))
    return *tunable_constants(program), *held_inputs


def load_predictor_library(path: Path) -> Any:
    """Return the library of a predictor (codegen/templates/predictor/predictor.c.jinja)."""
    library = ctypes.CDLL(str(path))
    pointer, whole = ctypes.c_void_p, ctypes.c_long
    library.modewright_differences.argtypes = [
        *(pointer, pointer, ctypes.c_int, whole),
        *(pointer, pointer, pointer, pointer, pointer, pointer),
    ]
    library.modewright_differences.restype = None
    library.modewright_predict.argtypes = [
        *(pointer, pointer, pointer, pointer, whole, pointer),
        *(whole, whole, ctypes.c_int, pointer, pointer, pointer, pointer, pointer),
    ]
    library.modewright_predict.restype = whole
    library.modewright_predict_all.argtypes = [
        *(pointer, pointer, pointer, pointer, whole, pointer, ctypes.c_int),
        *(whole, whole, pointer, pointer, whole),
        *(pointer, pointer, pointer, pointer, pointer),
    ]
    library.modewright_predict_all.restype = None
    library.modewright_squares.argtypes = [
        *(pointer, whole, pointer, pointer),
        *(pointer, pointer, pointer),
    ]
    library.modewright_squares.restype = None
    return library


Reals = NDArray[np.float64]

LIBRARY_FLAGS = (
    *flags_at_level("O1"),
    *("-fno-semantic-interposition", "-shared", "-fPIC", "-w", "-Dvolatile="),
)
"""One file, so that all is inlined. Recordings are followed as soon as with -O2, which compiles for
a tenth longer. No calibration tool writes into the page of a predictor: not volatile, a step takes
0.7 of the time."""

STEADY_GAIN_DIMENSIONS = 3
"""Dimensions of steady gains that all points have in common: (modes, states, seen)."""

MATH_SOURCE = re.compile(r"ha_mathf?\.c")

FUNCTION_START = re.compile(r"^(?=\w+ ha_\w+\()", re.MULTILINE)


@dataclass(frozen=True)
class PredictorColumns:
    """What the arrays of a predictor hold, in their order: names, and `page` with its defaults."""

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    input_types: tuple[str, ...]
    outputs: tuple[str, ...]
    modes: tuple[int, ...]
    page: Mapping[str, float]


def columns_of(program: Program, outputs: Sequence[str]) -> PredictorColumns:
    """Return the columns of a Program whose outputs `outputs` are compared with recordings."""
    return PredictorColumns(
        program.name,
        tuple(unqualified_name(v.name) for v in program.variables if v.name.startswith("state.")),
        tuple(unqualified_name(v.name) for v in program.inputs),
        tuple(c_type(v, program.number_type) for v in program.inputs),
        tuple(outputs),
        tuple(mode.number for mode in program.modes),
        {unqualified_name(c.name): c.value for c in tunable_constants(program)},
    )


class Predictor:
    """A loaded library with the names of its arrays' columns."""

    def __init__(self, columns: PredictorColumns, library: Path) -> None:
        """Load a library that `built` made."""
        self.columns = columns
        self.states = columns.states
        self.outputs = columns.outputs
        self.inputs = columns.inputs
        self.modes = columns.modes
        self.page = columns.page
        self._library = load_predictor_library(library)

    def compute_jacobians(
        self,
        page: Reals,
        inputs: Reals,
        mode: int,
        substeps: int,
        states: Reals,
        state_steps: Reals,
        input_steps: Reals,
    ) -> tuple[Reals, Reals, Reals]:
        """Return how the states `substeps` major steps later (states, states) and what is then
        seen (seen, states) change with the states, and these states with the inputs held until
        then (states, inputs): by central differences of `state_steps` (states,) and `input_steps` (inputs,).
        """
        count = len(self.states)
        next_states, outputs = np.empty((count, count)), np.empty((count, len(self.outputs)))
        input_response = np.empty((len(self.inputs), count))
        arrays = [
            np.ascontiguousarray(a, dtype=np.float64) for a in (states, state_steps, input_steps)
        ]
        self._library.modewright_differences(
            _address(page), _address(inputs), mode, substeps, *(_address(a) for a in arrays),
            _address(next_states), _address(outputs), _address(input_response),
        )  # fmt: skip
        return next_states.T, outputs.T, input_response.T

    def compute_gains(
        self,
        phi: Reals,
        c: Reals,
        q: Reals,
        r: Reals,
        initial_covariance: Reals,
        transient_samples: int,
        max_samples: int = MAX_SAMPLES,
    ) -> tuple[Reals, Reals, Reals] | None:
        """Return the gains of a linear model of its states and signals (see `kalman_gains`)."""
        return compute_kalman_gains(
            phi, c, q, r, initial_covariance, transient_samples, max_samples
        )

    def predict(
        self,
        page: Reals,
        inputs: Reals,
        measured: Reals,
        first_gains: Reals,
        gains: Reals,
        substeps: int,
        is_first_order_hold: bool,
        state_increments: Reals | None = None,
    ) -> Prediction:
        """Follow a recording; arrays are C-contiguous; inputs are held, or `is_first_order_hold` in between.

        `page` (tunables,), `inputs` (samples, inputs), `measured` (samples, seen) with NaN where
        nothing is known, `first_gains` (first, states, seen), `gains` (modes, states, seen).
        `state_increments` (samples, states) are added to the states once they are corrected.
        """
        samples = len(inputs)
        innovations = np.full((samples, len(self.outputs)), np.nan)
        outputs = np.full((samples, len(self.outputs)), np.nan)
        states = np.empty((samples, len(self.states)))
        modes = np.zeros(samples, dtype=np.int16)
        completed = self._library.modewright_predict(
            _address(page),
            _address(inputs),
            _address(measured),
            _address(first_gains),
            len(first_gains),
            _address(gains),
            samples,
            substeps,
            int(is_first_order_hold),
            None if state_increments is None else _address(state_increments),
            _address(innovations),
            _address(outputs),
            _address(states),
            modes.ctypes.data,
        )
        return Prediction(innovations, outputs, states, modes, int(completed))

    def predict_recordings(
        self,
        pages: Reals,
        recordings: StackedRecordings,
        first_gains: Reals,
        gains: Reals,
        substeps: int,
        limits: Reals,
    ) -> StackedPrediction:
        """Follow several recordings, each with its row of `pages` (recordings, tunables).

        Innovations beyond `limits` (seen,) count in proportion. The other arrays are those of
        `predict`.
        """
        samples = len(recordings.inputs)
        stacked = Prediction(
            np.empty((samples, len(self.outputs))),
            np.empty((samples, len(self.outputs))),
            np.empty((samples, len(self.states))),
            np.zeros(samples, dtype=np.int16),
            samples,
        )
        completed = np.empty(len(pages), dtype=np.int64)
        results = (stacked.innovations, stacked.outputs, stacked.states, stacked.modes, completed)
        self._call_library(pages, 1, recordings, (first_gains, gains), substeps, results)
        for part in _samples_after_divergence(recordings.starts, completed):
            stacked.innovations[part] = stacked.outputs[part] = np.nan
        squares, counts = self.sum_squares(stacked.innovations, recordings, limits)
        return StackedPrediction(stacked, recordings.starts, completed, squares, counts)

    def predict_points(
        self,
        pages: Reals,
        recordings: StackedRecordings,
        first_gains: Reals,
        gains: Reals,
        substeps: int,
    ) -> tuple[Reals, NDArray[np.int64]]:
        """Follow several recordings at several points, with `pages` (points, recordings, tunables).

        Return the innovations (points, samples, seen), and how many samples were done (points,
        recordings). The other arrays are those of `predict`; gains may be by points as well.
        """
        points = len(pages)
        innovations = np.empty((points, len(recordings.inputs), len(self.outputs)))
        completed = np.empty(pages.shape[:2], dtype=np.int64)
        results = (innovations, None, None, None, completed)
        self._call_library(pages, points, recordings, (first_gains, gains), substeps, results)
        for one, here in zip(innovations, completed, strict=True):
            for part in _samples_after_divergence(recordings.starts, here):
                one[part] = np.nan
        return innovations, completed

    def sum_squares(
        self, innovations: Reals, recordings: StackedRecordings, limits: Reals
    ) -> tuple[Reals, Reals]:
        """Return the sums of the squares of innovations (samples, seen) that count, and how many
        they are (recordings, seen); those beyond `limits` (seen,) count in proportion.
        """
        shape = (len(recordings.is_first_order_hold), len(self.outputs))
        squares, counts = np.empty(shape), np.empty(shape)
        self._library.modewright_squares(
            *(
                _address(innovations),
                shape[0],
                _address(recordings.starts),
                _address(recordings.burn_in),
            ),
            *(_address(np.ascontiguousarray(limits)), _address(squares), _address(counts)),
        )
        return squares, counts

    def _call_library(
        self,
        pages: Reals,
        points: int,
        recordings: StackedRecordings,
        gains: tuple[Reals, Reals],
        substeps: int,
        results: Sequence[NDArray[Any] | None],
    ) -> None:
        first, steady = gains
        starts, linear = recordings.starts, recordings.is_first_order_hold
        is_per_point = int(steady.ndim > STEADY_GAIN_DIMENSIONS)
        self._library.modewright_predict_all(
            *(_address(a) for a in (pages, recordings.inputs, recordings.measured, first)),
            *(first.shape[is_per_point], _address(steady), is_per_point, points, len(linear)),
            *(_address(starts), _address(linear), substeps),
            *(None if a is None else _address(a) for a in results),
        )


def _samples_after_divergence(
    starts: NDArray[np.int64], completed: NDArray[np.int64]
) -> list[slice]:
    """Return the samples behind the one in which each run that was not done left all bounds."""
    ends = zip(starts[:-1].tolist(), starts[1:].tolist(), completed.tolist(), strict=True)
    return [slice(low + count + 1, high) for low, high, count in ends if low + count < high]


def _address(values: NDArray[Any]) -> int:
    return int(values.ctypes.data)


@contextmanager
def build_predictor(program: Program, columns: PredictorColumns) -> Iterator[Path]:
    """Give the library of a Program, kept from an earlier run if there was one.

    Raises ToolMissing, BuildError.
    """
    program = slice_to_outputs(program)
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        simd_context = (
            simd_recordings_context(program, columns.states, columns.outputs)
            if has_gcc_vectors()
            else None
        )
        files = emit_c_files(
            program, fast_path="off" if simd_context and not simd_context["record"] else "anew"
        )
        context = {
            **_template_context(columns),
            "tracks": simd_context,
            "mathematics": next((f for f in files if MATH_SOURCE.match(f)), ""),
        }
        files["predictor.c"] = render("predictor/predictor.c.jinja", context)
        for file, text in files.items():
            source_text = (
                FUNCTION_START.sub("static ", text) if file.startswith("ha_math") else text
            )
            (folder / file).write_text(source_text)
        sources = [folder / file for file in files]
        command = [*find_compiler(), *LIBRARY_FLAGS]
        key = key_of(sources, command, compiler_version())
        main = [folder / "predictor.c"]
        yield get_or_build(key, lambda made: compile_program(main, made, LIBRARY_FLAGS), folder)


def _template_context(columns: PredictorColumns) -> dict[str, object]:
    return {
        "name": columns.name,
        "states": columns.states,
        "seen": columns.outputs,
        "modes": columns.modes,
        "page": [c_member(f"calibration.{name}") for name in columns.page],
        "inputs": [
            {"member": name, "type": kind}
            for name, kind in zip(columns.inputs, columns.input_types, strict=True)
        ],
    }
