"""Simulator library: compiles the C of a system's simulation, loads it and runs variants.

The call of C releases Python's global lock, so several threads may each run a part of the variants.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from codegen.simulator.signal_names import column_positions, row_width
from codegen.simulator.simd_batch import LANES
from codegen.simulator.simulator_source import emit_simulator_files
from codegen.toolchain.build_cache import cache_folder, get_or_build, key_of
from codegen.toolchain.compiler import (
    FLAGS,
    compiler_version,
    find_compiler,
    load_shared_library,
    run_compiler,
    run_compilers,
)
from codegen.toolchain.object_cache import is_shared, object_of
from language.programs.system_program import SimulationAssembly
from language.text.temporary_files import temporary_folder

Pointer = ctypes.c_void_p
Int64 = ctypes.c_int64
SHARED_LIBRARY_FLAGS = ("-fPIC", "-shared")
"""Compiler flags of a shared library."""


class FlowStruct(ctypes.Structure):
    """The structure `FlowPlan` of templates/simulator/run.h.jinja."""

    _fields_ = [
        (name, Pointer)
        for name in (
            "first",
            "left",
            "high",
            "low",
            "row_steps",
            "row_high",
            "row_low",
            "row_ends",
            "boundaries",
        )
    ]


class PlanStruct(ctypes.Structure):
    """The structure `Plan` of templates/simulator/run.h.jinja."""

    _fields_ = [
        ("instants", Int64),
        ("rows", Int64),
        *(
            (name, Pointer)
            for name in (
                "high",
                "low",
                "inputs",
                "happens",
                "row_at",
                "row_gaps",
                "flows",
                "noise",
                "early",
                "row_high",
                "row_low",
                "pieces",
                "courses",
            )
        ),
    ]


class VariantsStruct(ctypes.Structure):
    """The structure `Variants` of templates/simulator/run_driver.c.jinja."""

    _fields_ = [
        ("values", Pointer),
        ("tables", Int64),
        ("table_inputs", Pointer),
        ("table_pieces", Pointer),
        ("table_widths", Pointer),
        ("table_values", Pointer),
        ("noise_strides", Pointer),
        ("measures", Int64),
        ("measure_columns", Pointer),
        ("measure_kinds", Pointer),
        ("measure_firsts", Pointer),
        ("measure_behinds", Pointer),
        ("measured", Pointer),
        ("outputs", Int64),
        ("output_columns", Pointer),
        ("kept", Pointer),
        ("most_events", Int64),
        ("events", Pointer),
        ("counts", Pointer),
        ("is_left", Pointer),
        ("faults", Pointer),
        ("rows", Pointer),
        ("inputs_room", Pointer),
    ]


class SimulatorLibrary:
    """The compiled simulation of an assembly.

    `columns` are the positions of the recorded columns in a row of `width` values. `lanes` is the
    number of variants that may run at once; the caller provides rows for as many.
    """

    def __init__(self, assembly: SimulationAssembly, path: Path) -> None:
        """Load a compiled library."""
        self.assembly = assembly
        self.columns = tuple(column_positions(assembly))
        self.width = row_width(assembly)
        self.lanes = LANES
        self._run = load_shared_library(path).run_variants
        self._run.argtypes = [Pointer, Pointer, Int64, Int64]
        self._run.restype = None

    def bind_plan(self, plan: Any, variants: Mapping[str, Any]) -> Callable[[int, int], None]:
        """Return a function that runs the variants from a first index up to a last one, exclusive.

        `plan` is a plan of the engine (engine/batch/run_plan.py). `variants` gives the members of
        the C structure `Variants`: whole numbers, contiguous arrays, or lists of arrays and None.
        Results are written into these arrays, which the function keeps alive.
        """
        struct, keep_alive = self._pack_plan(plan)
        members = VariantsStruct()
        for name, value in variants.items():
            setattr(members, name, _struct_member(value, keep_alive))
        run, addresses = self._run, (ctypes.addressof(struct), ctypes.addressof(members))
        keep_alive += [struct, members]

        def run_part(first: int, end: int, _keep_alive: list[Any] = keep_alive) -> None:
            run(*addresses, first, end)

        return run_part

    def _pack_plan(self, plan: Any) -> tuple[PlanStruct, list[Any]]:
        """Return a plan as a C structure, and the objects that must stay alive while it is used."""
        keep_alive: list[Any] = []
        flows = (FlowStruct * max(1, len(plan.flows)))()
        for struct, name in zip(flows, self.assembly.continuous_instances, strict=False):
            flow = plan.flows[name]
            for member, array in (
                ("first", flow.first),
                ("left", flow.left),
                ("high", flow.starts.high),
                ("low", flow.starts.low),
                ("row_steps", flow.row_steps),
                ("row_high", flow.row_times.high),
                ("row_low", flow.row_times.low),
                ("row_ends", flow.row_ends),
                ("boundaries", flow.boundaries),
            ):
                setattr(struct, member, array.ctypes.data)
        sensors = list(self.assembly.sensors)
        noise = [plan.noise.get(name) for name in sensors]
        early = (Int64 * max(1, len(sensors)))(*(plan.early[name] for name in sensors))
        struct = PlanStruct(
            instants=len(plan.instants.high),
            rows=len(plan.rows.high),
            high=plan.instants.high.ctypes.data,
            low=plan.instants.low.ctypes.data,
            inputs=plan.inputs.ctypes.data,
            happens=plan.happens.ctypes.data,
            row_at=plan.row_at.ctypes.data,
            row_gaps=plan.row_gaps.ctypes.data,
            flows=ctypes.addressof(flows),
            noise=_struct_member(noise, keep_alive),
            early=ctypes.addressof(early),
            row_high=plan.rows.high.ctypes.data,
            row_low=plan.rows.low.ctypes.data,
            pieces=plan.pieces.ctypes.data,
            courses=_struct_member(
                [plan.courses[c.name] for c in self.assembly.input_trajectories], keep_alive
            ),
        )
        return struct, [*keep_alive, flows, early, plan]


@dataclass(frozen=True)
class _LibraryKey:
    """The key of a loaded library; libraries with equal keys are loaded once in a process."""

    digest: str
    command: tuple[str, ...]
    folder: Path
    simd_batch: bool
    assembly: SimulationAssembly = field(compare=False)


def load_library(
    assembly: SimulationAssembly,
    flags: Sequence[str] = FLAGS,
    compiler_name: str | None = None,
    simd_batch: bool = True,
) -> SimulatorLibrary:
    """Return the loaded simulation of an assembly, compiled if it is not in the cache.

    In a process, equal arguments (an assembly by its digest) give the same object, up to 64 of
    them. Without `simd_batch` it has no SIMD steps over variants and compiles faster; a single run
    needs none. Raises MissingToolError, BuildError.
    """
    parts = (*find_compiler(compiler_name), *flags)
    library_key = _LibraryKey(assembly.digest(), parts, cache_folder(), simd_batch, assembly)
    return _load_cached(library_key, tuple(flags), compiler_name)


@lru_cache(maxsize=64)
def _load_cached(
    library_key: _LibraryKey, flags: tuple[str, ...], compiler_name: str | None
) -> SimulatorLibrary:
    """Return the library of a key, from the cache of compiled programs if it was built before."""
    assembly = library_key.assembly
    with temporary_folder() as folder:
        for file, text in emit_simulator_files(assembly, library_key.simd_batch).items():
            (folder / file).write_text(text)
        sources = sorted(folder.glob("*.c"))
        command = [*find_compiler(compiler_name), *flags, *SHARED_LIBRARY_FLAGS]
        key = key_of(sources, command, compiler_version(compiler_name))
        path = get_or_build(
            key, lambda target: build_library(sources, target, flags, compiler_name), folder
        )
        return SimulatorLibrary(assembly, path)


def build_library(
    sources: Sequence[Path], target: Path, flags: Sequence[str], compiler_name: str | None
) -> None:
    """Compile the sources in parallel and link them to the shared library `target`.

    Objects are written beside the sources; those of shared sources (`is_shared`) come from the
    cache. Raises MissingToolError, and BuildError like `run_compilers`.
    """
    command = find_compiler(compiler_name)
    compile_command = [*command, *flags, "-fPIC"]
    version, room = compiler_version(compiler_name), sources[0].parent / "objects"
    shared = [object_of(s, compile_command, version, room) for s in sources if is_shared(s)]
    own = {source.with_suffix(".o"): source for source in sources if not is_shared(source)}
    run_compilers([([*compile_command, "-c", str(source)], made) for made, source in own.items()])
    run_compiler([*command, "-shared", *map(str, [*own, *shared]), "-lm"], target)


def _struct_member(value: Any, keep_alive: list[Any]) -> Any:
    """Return a member of a C structure: a number, an address, or an array of addresses.

    Objects whose memory it refers to are appended to `keep_alive`.
    """
    if value is None or isinstance(value, int):
        return value
    if isinstance(value, list):
        array = (Pointer * max(1, len(value)))(
            *(None if part is None else part.ctypes.data for part in value)
        )
        keep_alive.extend([array, value])
        return ctypes.addressof(array)
    keep_alive.append(value)
    return value.ctypes.data
