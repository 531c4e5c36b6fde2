"""Library: the C of a system's runs, compiled for this machine, loaded, and called.

`run_variants` holds no lock of Python: several threads may each carry out a part of the variants.
"""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

from codegen.simulator.signal_names import column_positions, row_width
from codegen.simulator.simd_variants import LANES
from codegen.simulator.simulator_source import emit_simulator_files
from codegen.toolchain.build_cache import cache_folder, get_or_build, key_of
from codegen.toolchain.compiler import FLAGS, TIMEOUT, BuildError, compiler_version, find_compiler
from codegen.toolchain.object_cache import is_shared, object_of
from language.programs.simulation_assembly import SimulationAssembly

Pointer = ctypes.c_void_p
Int64 = ctypes.c_int64
SHARED_LIBRARY_FLAGS = ("-fPIC", "-shared")


class FlowStruct(ctypes.Structure):
    """`FlowPlan` of templates/run.h.jinja."""

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
    """`Plan` of templates/run.h.jinja."""

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
    """`Variants` of templates/run_driver.c.jinja."""

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
    """The compiled runs of one assembly; `columns` are the places of its columns in a row.

    `lanes` is how many variants may be carried out side by side: of so many there is room for rows.
    """

    def __init__(self, assembly: SimulationAssembly, path: Path) -> None:
        """Load what was built."""
        self.assembly = assembly
        self.columns = tuple(column_positions(assembly))
        self.width = row_width(assembly)
        self.lanes = LANES
        self._run = ctypes.CDLL(str(path)).run_variants
        self._run.argtypes = [Pointer, Pointer, Int64, Int64]
        self._run.restype = None

    def bind(self, plan: Any, variants: Mapping[str, Any]) -> Callable[[int, int], None]:
        """Return what carries variants out, from a first to one behind the last.

        `plan` is an engine's (engine/batch/run_plan.py), `variants` are the members of `Variants` in C: whole
        numbers, arrays, lists of arrays; all arrays contiguous.
        """
        struct, kept = self._pack_plan(plan)
        members = VariantsStruct()
        for name, value in variants.items():
            setattr(members, name, _struct_member(value, kept))
        run, places = self._run, (ctypes.addressof(struct), ctypes.addressof(members))
        kept += [struct, members]

        def carry_out(first: int, behind: int, kept: list[Any] = kept) -> None:
            run(*places, first, behind)

        return carry_out

    def _pack_plan(self, plan: Any) -> tuple[PlanStruct, list[Any]]:
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
    """What a library is of: those of one process are loaded once."""

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
    """Return the compiled runs of an assembly, kept from an earlier time if there was one.

    A single run needs none `simd_batch`, and is compiled sooner without. Raises ToolMissing,
    BuildError.
    """
    parts = (*find_compiler(compiler_name), *flags)
    library_key = _LibraryKey(assembly.digest(), parts, cache_folder(), simd_batch, assembly)
    return _load_cached(library_key, tuple(flags), compiler_name)


@lru_cache(maxsize=64)
def _load_cached(
    library_key: _LibraryKey, flags: tuple[str, ...], compiler_name: str | None
) -> SimulatorLibrary:
    assembly = library_key.assembly
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
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
    """Compile the sources side by side, and link them."""
    command = find_compiler(compiler_name)
    compile_command = [*command, *flags, "-fPIC"]
    version, room = compiler_version(compiler_name), sources[0].parent / "objects"
    shared = [object_of(s, compile_command, version, room) for s in sources if is_shared(s)]
    objects = [source.with_suffix(".o") for source in sources if not is_shared(source)]
    running = [
        subprocess.Popen(
            [*compile_command, "-c", str(made.with_suffix(".c")), "-o", str(made)],
            stderr=subprocess.PIPE,
            text=True,
        )
        for made in objects
    ]
    for process in running:
        _, message = process.communicate(timeout=TIMEOUT)
        if process.returncode != 0:
            raise BuildError(message.strip())
    link = [*command, "-shared", *map(str, objects + shared), "-lm", "-o", str(target)]
    done = subprocess.run(link, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    if done.returncode != 0:
        raise BuildError(done.stderr.strip())


def _struct_member(value: Any, keep_alive: list[Any]) -> Any:
    """Return a member of a struct: a number, the address of an array, or of a list of addresses."""
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
