"""Predictor: compiled one-step prediction of recordings by a continuous automaton, with gains.

At each sample the state is corrected: x += K (y - h(x)). `build_predictor` compiles the library of
a Program, `Predictor` loads it.
"""

from __future__ import annotations

import ctypes
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import c_member, c_type
from codegen.harness.harness import tunable_constants
from codegen.passes.dead_stores import remove_dead_stores
from codegen.passes.step_restriction import restrict_to_step
from codegen.predictor.kalman_gains import MAX_SAMPLES, compute_kalman_gains
from codegen.predictor.predictor_arrays import (
    Prediction,
    Reals,
    StackedPrediction,
    StackedRecordings,
)
from codegen.predictor.simd_predictor import simd_recordings_context
from codegen.toolchain.build_cache import get_or_build, key_of
from codegen.toolchain.compiler import (
    compile_program,
    compiler_version,
    find_compiler,
    flags_at_level,
    has_gcc_vectors,
    load_shared_library,
)
from codegen.toolchain.templates import render
from language.ir.program import Program, unqualified_name
from language.text.temporary_files import temporary_folder

REMOVABLE_GROUPS = ("equation.", "work.")
"""Prefixes of variables that may be removed if nothing reads them; they have no other effect."""


def slice_to_outputs(program: Program) -> Program:
    """Return the Program that C executes, without equations that neither it nor an output reads.

    It is `restrict_to_step`, then `remove_dead_stores` for REMOVABLE_GROUPS. If that would change
    the tunable parameters or the retained inputs (`before.`), nothing is removed.
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
    """Return what a caller sets: tunable parameters, and inputs that `step_program` retains."""
    held_inputs = (v.name for v in step_program.variables if v.name.startswith("before."))
    return *tunable_constants(program), *held_inputs


def load_predictor_library(path: Path) -> Any:
    """Load the shared library of a predictor and declare the types of its four functions.

    They are those of codegen/templates/predictor/predictor.c.jinja. Raises
    BrokenToolError if it cannot be loaded.
    """
    library = load_shared_library(path)
    pointer, whole = ctypes.c_void_p, ctypes.c_long
    library.modewright_differences.argtypes = [
        *(pointer, pointer, ctypes.c_int, whole),
        *(pointer, pointer, pointer, pointer, pointer, pointer),
    ]
    library.modewright_differences.restype = None
    library.modewright_predict.argtypes = [
        *(pointer, pointer, pointer, pointer, whole, pointer),
        *(whole, whole, pointer, pointer, pointer, pointer, pointer, pointer),
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


LIBRARY_FLAGS = (
    *flags_at_level("O1"),
    *("-fno-semantic-interposition", "-shared", "-fPIC", "-w", "-Dvolatile="),
)
"""Compiler flags of a predictor. All code is in one file, so that it can be inlined. -O1 gives the
same speed as -O2 and compiles 10 % faster. No calibration tool writes to the page of a predictor,
so `volatile` is removed: a step then takes 70 % of the time."""

STEADY_GAIN_DIMENSIONS = 3
"""Number of dimensions of steady-state gains that all points share: (modes, states, outputs)."""

MATH_SOURCE = re.compile(r"ha_mathf?\.c")
"""The source file of ha_math."""

FUNCTION_START = re.compile(r"^(?=\w+ ha_\w+\()", re.MULTILINE)
"""The begin of a function of ha_math."""


@dataclass(frozen=True)
class PredictorColumns:
    """The names of the columns of a predictor's arrays in their order.

    `input_types` are the C types of the inputs, `modes` the numbers of the modes. `page` gives the
    tunable parameters with their defaults.
    """

    name: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    input_types: tuple[str, ...]
    outputs: tuple[str, ...]
    modes: tuple[int, ...]
    page: Mapping[str, float]


def columns_of(program: Program, outputs: Sequence[str]) -> PredictorColumns:
    """Return the columns of a Program, without the groups of the names, in Program order.

    `outputs` are the names of the outputs that are compared with recordings; their order is kept.
    """
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
    """A loaded predictor library with the names of the columns of its arrays."""

    def __init__(self, columns: PredictorColumns, library: Path) -> None:
        """Load a library of `build_predictor`."""
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
        """Return the Jacobians of a prediction over `substeps` major steps, by central differences.

        They are d states / d states (states, states), d outputs / d states (outputs, states), and d
        states / d inputs (states, inputs), at `states` (states,) in the mode with the number
        `mode`, with `inputs` (inputs,) held constant and the parameters `page` (tunables,).
        `state_steps` (states,) and `input_steps` (inputs,) are the step sizes of the differences.
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
        """Return transient gains, the steady-state gain and the last covariance of a linear model.

        Returns None if a gain exceeds all bounds. Arguments and shapes are those of
        `compute_kalman_gains`, which it calls; the library of the predictor is not used.
        """
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
        linear_inputs: NDArray[np.int64],
        state_increments: Reals | None = None,
    ) -> Prediction:
        """Return the prediction of one recording; all arrays are C-contiguous float64.

        `page` (tunables,), `inputs` (samples, inputs), `measured` (samples, outputs) with NaN where
        nothing was measured, which corrects nothing. `first_gains` (first, states, outputs) apply
        to the first samples, `gains` (modes, states, outputs) to all others. `substeps` is the
        number of major steps from sample to sample. An input is linear between samples where
        `linear_inputs` (inputs,) is not 0, else constant. `state_increments` (samples, states) are
        added to the corrected states. After a divergence `completed` is smaller than the number of
        samples.
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
            _address(linear_inputs),
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
        """Return the predictions of several recordings, each with its own parameters.

        `pages` (recordings, tunables) holds a row of parameters for each recording. Innovations
        beyond `limits` (outputs,) count linearly in the sums of squares, as in `sum_squares`. The
        other arguments are those of `predict`. Innovations and outputs are NaN in the samples of a
        recording that follow the one in which a state diverged.
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
        """Return the innovations of several recordings at several points of the parameter space.

        `pages` (points, recordings, tunables) holds the parameters of each recording at each point.
        Returns innovations (points, samples, outputs), with NaN after the sample in which a state
        diverged, and the number of completed samples (points, recordings). Both gains may have
        points as an additional first axis; the other arguments are those of `predict`.
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
        """Return sums of squared innovations, and their numbers, (recordings, outputs) each.

        `innovations` has the shape (samples, outputs). An innovation e beyond its limit L in
        `limits` (outputs,) counts as L (2 |e| - L) (Huber 1964). Samples of the burn-in and NaN are
        left out of both.
        """
        shape = (len(recordings.burn_in), len(self.outputs))
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
        """Run the library on all recordings at all points; the arrays in `results` are filled.

        `results` holds innovations, outputs, states, modes and completed samples; None for an array
        that is not wanted.
        """
        first, steady = gains
        starts, linear = recordings.starts, recordings.linear_inputs
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
    """Return for each recording that diverged the samples after the one in which it did."""
    ends = zip(starts[:-1].tolist(), starts[1:].tolist(), completed.tolist(), strict=True)
    return [slice(low + count + 1, high) for low, high, count in ends if low + count < high]


def _address(values: NDArray[Any]) -> int:
    """Return the address of an array."""
    return int(values.ctypes.data)


@contextmanager
def build_predictor(program: Program, columns: PredictorColumns) -> Iterator[Path]:
    """Yield the path of the compiled library of a Program, from the cache if it was built before.

    The library is that of `slice_to_outputs`; it follows several recordings at once (SIMD) if the
    compiler has GCC's vectors and the Program can be vectorised. If the cache cannot be used, the
    path is in a temporary folder that is removed at the end. Raises MissingToolError, BuildError.
    """
    program = slice_to_outputs(program)
    with temporary_folder() as folder:
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
            "simd": simd_context,
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
    """Return the context of the template of a predictor."""
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
