"""Compiled stepper: a Program compiled for this machine whose blocks are run through ctypes.

It has the interface and the bits of the interpreter (engine/interpreter/interpreter.py). For whole
runs in one call see codegen/simulator/simulator_library.py.
"""

from __future__ import annotations

import ctypes
import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any

from codegen.emit.c_math import emit_math_files
from codegen.emit.c_module import module_context
from codegen.emit.c_names import CNames, c_type
from codegen.passes.block_usage import block_usages, locals_of
from codegen.passes.inline_policy import mark_inlining
from codegen.passes.range_violation_flags import (
    RANGE_VIOLATION_FLAG,
    add_range_violation_flags as marked_program,
    ranged_signals,
)
from codegen.simulator.simulator_library import SHARED_LIBRARY_FLAGS, build_library
from codegen.toolchain.build_cache import get_or_build, key_of
from codegen.toolchain.compiler import (
    FLAGS,
    compiler_version,
    find_compiler,
    load_shared_library,
)
from codegen.toolchain.templates import render
from language.ir.printer import digest
from language.ir.program import Program
from language.text.temporary_files import temporary_folder

MODULE_NAME = "stepper"
"""The name of the module in C."""
CTYPES: Mapping[str, Any] = {
    "double": ctypes.c_double,
    "float": ctypes.c_float,
    "bool": ctypes.c_bool,
    "uint8_t": ctypes.c_uint8,
    "int16_t": ctypes.c_int16,
    "uint16_t": ctypes.c_uint16,
    "int32_t": ctypes.c_int32,
    "uint32_t": ctypes.c_uint32,
}
"""The ctypes type of a C type."""
INLINED_ENTRIES = ("init", "step")
"""Blocks that are not functions of their own in generated C."""


class CompiledStepper:
    """A compiled Program with its values.

    All variables begin at 0 or false; then the blocks for the default page, `derive` and `init`
    run.
    """

    def __init__(self, program: Program, flags: Sequence[str] = FLAGS) -> None:
        """Compile the Program, or load it from the cache. Raises MissingToolError, BuildError."""
        self.program = program
        marked = marked_program(program)
        library, self._blocks, places = _load_stepper(
            _StepperKey(digest(marked), marked), tuple(flags)
        )
        self._run = library.stepper_run
        self._buffer = ctypes.create_string_buffer(int(library.stepper_size()))
        self._address = ctypes.addressof(self._buffer)
        sizes = {v.name: v.size for v in program.variables if v.size}
        self._values = {
            name: CTYPES[kind].from_buffer(self._buffer, offset)
            for name, (kind, offset) in places.items()
            if name not in sizes
        }
        self._arrays_and_constants: dict[str, Any] = {
            c.name: c.items or c.value for c in program.constants
        }
        for name, size in sizes.items():
            kind, offset = places[name]
            self._arrays_and_constants[name] = (CTYPES[kind] * size).from_buffer(
                self._buffer, offset
            )
        self._range_marks = {
            signal: RANGE_VIOLATION_FLAG.format(k)
            for k, signal in enumerate(ranged_signals(program))
        }
        for entry in ("default_page", "derive", "init"):
            self.run(entry)

    def get(self, name: str) -> Any:
        """Return the value of a variable or constant by its full name, like `state.w_em`.

        A sequence for an array or table. Raises KeyError for an unknown name and for a local
        variable of one function.
        """
        value = self._values.get(name)
        return self._arrays_and_constants[name] if value is None else value.value

    def set(self, name: str, value: float | int | bool) -> None:
        """Set a scalar variable or tunable constant; a real is rounded to the number type.

        Raises KeyError for an array and an unknown name.
        """
        self._values[name].value = value

    def has(self, name: str) -> bool:
        """Tell whether `get` knows a name."""
        return name in self._values or name in self._arrays_and_constants

    def run(self, block: str) -> None:
        """Run a block by name.

        `default_page` is a block too: it sets the tunable constants to their defaults. Raises
        KeyError for an unknown block.
        """
        self._run(self._address, self._blocks[block])

    def snapshot(self) -> bytes:
        """Return all values, arrays included, as bytes for `restore`."""
        return self._buffer.raw

    def restore(self, values: bytes) -> None:
        """Set all values to those of a `snapshot` of a stepper of the same Program."""
        ctypes.memmove(self._address, values, len(values))

    def make_reader(self, names: tuple[str, ...]) -> Callable[[], tuple[Any, ...]]:
        """Return a function that returns the values that the named scalars have when it is called.

        Raises KeyError at once for an array and an unknown name.
        """
        values = [self._values[name] for name in names]
        return lambda: tuple([value.value for value in values])

    def pop_range_violations(self) -> tuple[str, ...]:
        """Return the signals that left their range since the last call, and clear their flags.

        They are in the order of `ranged_signals`.
        """
        violated = tuple(
            signal for signal, name in self._range_marks.items() if self._values[name].value
        )
        for signal in violated:
            self._values[self._range_marks[signal]].value = False
        return violated


@dataclasses.dataclass(frozen=True)
class _StepperKey:
    """The key of a compiled stepper: Programs with the same digest are equal."""

    digest: str
    program: Program = dataclasses.field(compare=False)


LoadedStepper = tuple[ctypes.CDLL, dict[str, int], dict[str, tuple[str, int]]]
"""A library, the numbers of its blocks, and C type and offset of its variables."""


@lru_cache(maxsize=64)
def _load_stepper(stepper_key: _StepperKey, flags: tuple[str, ...]) -> LoadedStepper:
    """Return the loaded library of a Program, compiled if it is not in the cache."""
    program = dataclasses.replace(stepper_key.program, name=MODULE_NAME)
    files, blocks, names = _emit_files(program)
    with temporary_folder() as folder:
        for file, text in files.items():
            (folder / file).write_text(text)
        sources = sorted(folder.glob("*.c"))
        key = key_of(sources, [*find_compiler(), *flags, *SHARED_LIBRARY_FLAGS], compiler_version())
        path = get_or_build(key, lambda target: build_library(sources, target, flags, None), folder)
        library = load_shared_library(path)
    library.stepper_run.argtypes = [ctypes.c_void_p, ctypes.c_int32]
    library.stepper_run.restype = None
    library.stepper_size.restype = ctypes.c_int64
    offsets = (ctypes.c_int64 * len(names)).in_dll(library, "stepper_places")
    places = {n: (kind, o) for (n, kind), o in zip(names.items(), offsets, strict=True)}
    return library, blocks, places


def _emit_files(program: Program) -> tuple[dict[str, str], dict[str, int], dict[str, str]]:
    """Return the C files of a Program, the numbers of blocks, and the C types of variables."""
    context = module_context(mark_inlining(program))
    local = locals_of(program)
    usage_by_block, c_names = block_usages(program, local), CNames(program)
    hidden = {name for names in local.values() for name in names}
    names = {
        v.name: c_type(v, program.number_type) for v in program.variables if v.name not in hidden
    }
    names |= {
        c.name: c_type(c, program.number_type)
        for c in program.constants
        if c.kind in ("tunable", "derived") and not c.items
    }
    own = [name for name in program.blocks if name not in (*INLINED_ENTRIES, "derive")]
    calls = [f"{name}({', '.join(usage_by_block[name].parameters)})" for name in own]
    entries = [name for name in INLINED_ENTRIES if name in program.blocks]
    inline = [(name, context["entries"][name]["lines"]) for name in entries]
    files = {
        f"{MODULE_NAME}.h": render("emit/module.h.jinja", {**context, "digest": ""}),
        f"{MODULE_NAME}_stepper.c": render(
            "simulator/stepper.c.jinja",
            {
                **context,
                "calls": calls,
                "inline": inline,
                "places": [c_names(name).replace("->", ".") for name in names],
            },
        ),
    }
    if context["uses_math"]:
        files.update(emit_math_files(program.number_type))
    numbered = [*own, "derive", "default_page", *entries]
    return files, {name: number for number, name in enumerate(numbered)}, names
