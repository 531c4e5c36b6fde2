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

from codegen.abreast import LANES
from codegen.build import FLAGS, SECONDS, BuildError, compiler, compiler_version
from codegen.cache import cache_folder, key_of, stored
from codegen.objects import is_shared, object_of
from codegen.run_places import column_places, row_width
from codegen.run_source import run_files
from language.assembly import Assembly

Address = ctypes.c_void_p
Whole = ctypes.c_int64
SHARED = ("-fPIC", "-shared")


class FlowStruct(ctypes.Structure):
    """`FlowPlan` of templates/run.h.jinja."""

    _fields_ = [
        (name, Address)
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
        ("instants", Whole),
        ("rows", Whole),
        *(
            (name, Address)
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
        ("values", Address),
        ("tables", Whole),
        ("table_inputs", Address),
        ("table_pieces", Address),
        ("table_widths", Address),
        ("table_values", Address),
        ("noise_strides", Address),
        ("measures", Whole),
        ("measure_columns", Address),
        ("measure_kinds", Address),
        ("measure_firsts", Address),
        ("measure_behinds", Address),
        ("measured", Address),
        ("outputs", Whole),
        ("output_columns", Address),
        ("kept", Address),
        ("most_events", Whole),
        ("events", Address),
        ("counts", Address),
        ("is_left", Address),
        ("faults", Address),
        ("rows", Address),
        ("inputs_room", Address),
    ]


class Library:
    """The compiled runs of one assembly; `columns` are the places of its columns in a row.

    `lanes` is how many variants may be carried out side by side: of so many there is room for rows.
    """

    def __init__(self, assembly: Assembly, path: Path) -> None:
        """Load what was built."""
        self.assembly = assembly
        self.columns = tuple(column_places(assembly))
        self.width = row_width(assembly)
        self.lanes = LANES
        self._run = ctypes.CDLL(str(path)).run_variants
        self._run.argtypes = [Address, Address, Whole, Whole]
        self._run.restype = None

    def bound(self, plan: Any, variants: Mapping[str, Any]) -> Callable[[int, int], None]:
        """Return what carries variants out, from a first to one behind the last.

        `plan` is an engine's (engine/plan.py), `variants` are the members of `Variants` in C: whole
        numbers, arrays, lists of arrays; all arrays contiguous.
        """
        struct, kept = self._plan(plan)
        members = VariantsStruct()
        for name, value in variants.items():
            setattr(members, name, _member(value, kept))
        run, places = self._run, (ctypes.addressof(struct), ctypes.addressof(members))
        kept += [struct, members]

        def carry_out(first: int, behind: int, kept: list[Any] = kept) -> None:
            run(*places, first, behind)

        return carry_out

    def _plan(self, plan: Any) -> tuple[PlanStruct, list[Any]]:
        kept: list[Any] = []
        flows = (FlowStruct * max(1, len(plan.flows)))()
        for struct, name in zip(flows, self.assembly.flows, strict=False):
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
        early = (Whole * max(1, len(sensors)))(*(plan.early[name] for name in sensors))
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
            noise=_member(noise, kept),
            early=ctypes.addressof(early),
            row_high=plan.rows.high.ctypes.data,
            row_low=plan.rows.low.ctypes.data,
            pieces=plan.pieces.ctypes.data,
            courses=_member([plan.courses[c.name] for c in self.assembly.courses], kept),
        )
        return struct, [*kept, flows, early, plan]


@dataclass(frozen=True)
class _Wanted:
    """What a library is of: those of one process are loaded once."""

    digest: str
    command: tuple[str, ...]
    folder: Path
    side_by_side: bool
    assembly: Assembly = field(compare=False)


def library_of(
    assembly: Assembly,
    flags: Sequence[str] = FLAGS,
    named: str | None = None,
    side_by_side: bool = True,
) -> Library:
    """Return the compiled runs of an assembly, kept from an earlier time if there was one.

    A single run needs none `side_by_side`, and is compiled sooner without. Raises ToolMissing,
    BuildError.
    """
    parts = (*compiler(named), *flags)
    wanted = _Wanted(assembly.digest(), parts, cache_folder(), side_by_side, assembly)
    return _loaded(wanted, tuple(flags), named)


@lru_cache(maxsize=64)
def _loaded(wanted: _Wanted, flags: tuple[str, ...], named: str | None) -> Library:
    assembly = wanted.assembly
    with tempfile.TemporaryDirectory(prefix="modewright-") as name:
        folder = Path(name)
        for file, text in run_files(assembly, wanted.side_by_side).items():
            (folder / file).write_text(text)
        sources = sorted(folder.glob("*.c"))
        command = [*compiler(named), *flags, *SHARED]
        key = key_of(sources, command, compiler_version(named))
        path = stored(key, lambda target: build_library(sources, target, flags, named), folder)
        return Library(assembly, path)


def build_library(
    sources: Sequence[Path], target: Path, flags: Sequence[str], named: str | None
) -> None:
    """Compile the sources side by side, and link them."""
    command = compiler(named)
    words = [*command, *flags, "-fPIC"]
    version, room = compiler_version(named), sources[0].parent / "objects"
    shared = [object_of(s, words, version, room) for s in sources if is_shared(s)]
    objects = [source.with_suffix(".o") for source in sources if not is_shared(source)]
    running = [
        subprocess.Popen(
            [*words, "-c", str(made.with_suffix(".c")), "-o", str(made)],
            stderr=subprocess.PIPE,
            text=True,
        )
        for made in objects
    ]
    for process in running:
        _, told = process.communicate(timeout=SECONDS)
        if process.returncode != 0:
            raise BuildError(told.strip())
    link = [*command, "-shared", *map(str, objects + shared), "-lm", "-o", str(target)]
    done = subprocess.run(link, capture_output=True, text=True, timeout=SECONDS, check=False)
    if done.returncode != 0:
        raise BuildError(done.stderr.strip())


def _member(value: Any, kept: list[Any]) -> Any:
    """Return a member of a struct: a number, the address of an array, or of a list of addresses."""
    if value is None or isinstance(value, int):
        return value
    if isinstance(value, list):
        array = (Address * max(1, len(value)))(
            *(None if part is None else part.ctypes.data for part in value)
        )
        kept.extend([array, value])
        return ctypes.addressof(array)
    kept.append(value)
    return value.ctypes.data
