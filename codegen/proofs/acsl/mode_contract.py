"""Mode contracts: properties of the mode logic, proven for the C by Frama-C's WP and SMT solvers.

For `jump_<mode>` of a sampled automaton they state: either no transition fires and the mode stays,
or one of its transitions fires and its target is the new mode. A transition with a wait fires in
the tick in which its counter is full, and a full counter fires or restarts. No counter exceeds its
limit. Whole numbers stay in their ranges. Nothing is written but what actions set. There is no
undefined access, shift or sum.

Two assumptions are made: functions of ha_math write nothing, and whole numbers begin in their
ranges. Range checks are two comparisons here, as in `eva.py`. The functions that a transition runs
have contracts too (`assigns_contract.py`). Choices that set no mode are moved into functions of
their own (`function_outlining.py`). Properties that `eva.py` proves are not proven again. Nested
modes have the contracts of `chart_contract.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from codegen.emit.c_module import emit_c_files
from codegen.emit.c_names import SOLVED_PREFIX_ON_PAGE, CNames, mode_constant
from codegen.passes.block_usage import locals_of
from codegen.passes.pass_list import run_c_passes
from codegen.proofs.acsl.assigns_contract import (
    add_effect_contracts,
    add_loop_assigns,
    assigned,
    called_by,
    contract_text,
    is_inside,
    places_of,
    required,
    seen_of,
)
from codegen.proofs.acsl.chart_contract import (
    MODEL,
    ChartContract,
    prove_chart_contracts,
    write_chart_contracts,
)
from codegen.proofs.acsl.function_outlining import Function, function_of, outline_except
from codegen.proofs.acsl.wp import Asked, asked, detected, pure
from codegen.toolchain.tool_verdict import ToolVerdict, tool_version
from language.ir.ops import Count
from language.ir.program import ModeInfo, Program, TransitionInfo
from language.ir.traversal import block_reads, block_writes, walk_ops
from language.lowering.fault_mode import add_fault_transitions
from language.model.automaton import Automaton
from language.programs.name_bindings import chart_context_of

PARTS = (("-wp-rte", "-wp-prop=@ensures", "-wp-split"), ("-wp-rte", "-wp-prop=-@ensures"))
"""Options of the two runs of WP for a mode: postconditions are proven path by path, all other goals
are not."""
OF_CALLED = MODEL
"""Options for functions that transitions run: reals have no rounding."""
OF_CALLING = (*MODEL, "-wp-split")
"""Options for modes whose transitions run functions."""
MODE, FIRED = "self->mode", "self->fired"
Wholes: TypeAlias = Mapping[str, tuple[int, int]]
NOTHING_KEPT: Wholes = {}
Asking: TypeAlias = tuple[list[str], tuple[str, ...]]
"""Names of functions, and the options of WP for their contracts."""


def check_contracts(automaton: Automaton, program: Program, folder: Path) -> ToolVerdict:
    """Prove the contracts of the modes of a Program and return the verdict.

    The check does not apply to a continuous automaton or to one with regions but no chart. Raises
    MissingToolError, BuildError.
    """
    made = run_c_passes(program, by_magnitude=False)
    tool = f"Frama-C {tool_version('frama-c', folder)} WP"
    modes = modes_with_contract(program, made)
    files = emit_c_files(program, by_magnitude=False)
    charting = None
    if automaton.is_sampled:
        charting = chart_context_of(add_fault_transitions(automaton), program.transitions)
    if charting:
        chart = ChartContract(charting, made)
        names = write_chart_contracts(chart, files, folder)
        what = f"{len(names)} functions"
        what += f", of {', '.join(chart.unsaid)} lemmas alone" if chart.unsaid else ""
        return _contract_verdict(tool, prove_chart_contracts(program.name, names, folder), what)
    if program.period is None or program.regions or not modes:
        about = "one region of a sampled automaton with transitions, and a chart, have contracts"
        return ToolVerdict("contract", tool, about, is_asked=False)
    asking = write_contracts(program, files, folder, wholes_of(automaton))
    run = sum(len(names) for names, options in asking if options == OF_CALLED)
    also = f", {run} functions that they run" if run else ""
    found = prove_contracts(folder, f"{program.name}.c", asking)
    return _contract_verdict(tool, found, f"{len(modes)} modes{also}")


def modes_with_contract(program: Program, made: Program) -> list[ModeInfo]:
    """Return the modes whose function does something; `made` is the Program that C is printed of.

    The function of a mode without transitions has no operations, and no argument in C.
    """
    return [mode for mode in program.modes if made.blocks.get(f"jump_{mode.name}")]


def wholes_of(automaton: Automaton) -> Wholes:
    """Return the ranges of discrete whole numbers of an automaton, by their names in a Program."""
    return {
        f"discrete.{name}": (int(one.range[0]), int(one.range[1]))
        for name, one in automaton.discrete.items()
        if one.type == "int" and one.range
    }


def write_contracts(
    program: Program, files: Mapping[str, str], folder: Path, wholes: Wholes = NOTHING_KEPT
) -> list[Asking]:
    """Write the C with its contracts into a folder.

    Return the functions to prove with their options. These are modes with their parts, and the
    functions that they run. `wholes` gives the ranges of whole numbers that are preserved.
    """
    made, file = run_c_passes(program, by_magnitude=False), f"{program.name}.c"
    modes = modes_with_contract(program, made)
    called = called_by(made, [f"jump_{mode.name}" for mode in modes])
    text, functions = add_effect_contracts(made, files[file], called), []
    for mode in modes:
        text, names = _Mode(program, made, mode, wholes).annotated(text, in_parts=bool(called))
        functions += names
    for name, own in {**files, file: text}.items():
        (folder / name).write_text(pure(own))
    if called:
        return [(called, OF_CALLED), (functions, OF_CALLING)]
    return [(functions, options) for options in PARTS]


def _contract_verdict(tool: str, found: Asked, what: str) -> ToolVerdict:
    """Return the verdict on the goals of contracts; `what` says which contracts were asked."""
    about = f"{found.proven} of {found.asked} goals; {what}" if found.asked else "no result"
    return ToolVerdict("contract", tool, about, found.open)


def prove_contracts(folder: Path, file: str, asking: Sequence[Asking]) -> Asked:
    """Prove the contracts of functions and return the sum of their goals.

    Raises MissingToolError, BuildError.
    """
    detected(folder)
    found = [asked(folder, file, own, options) for own, options in asking if own]
    return sum(found, start=Asked(0, 0, ()))


@dataclass(frozen=True)
class _Mode:
    """The contract of one mode; `made` is the Program that the C is printed of."""

    program: Program
    made: Program
    mode: ModeInfo
    wholes: Wholes

    @property
    def block(self) -> str:
        """What it does in a tick."""
        return f"jump_{self.mode.name}"

    @cached_property
    def place(self) -> CNames:
        """Where names are in C."""
        return CNames(self.made, locals_of(self.made)[self.block], SOLVED_PREFIX_ON_PAGE)

    @property
    def transitions(self) -> list[TransitionInfo]:
        """Its transitions."""
        return [info for info in self.program.transitions if info.source == self.mode.number]

    def annotated(self, text: str, in_parts: bool) -> tuple[str, list[str]]:
        """Return C with contracts before its function and its parts, and the names of these."""
        function = function_of(text, self.block)
        *parts, whole = outline_except(function, (MODE, FIRED)) if in_parts else [function]
        pointers = list(required(function.parameters, is_inside(text)))
        texts = [self._part(part, pointers) for part in parts]
        seen = assigned(seen_of(function, self._places))
        lines = [*pointers, *self._required(), seen, *self._ensured()]
        texts.append(contract_text(lines) + add_loop_assigns(whole, self._places))
        text = text[: function.start] + "\n".join(texts) + text[function.end :]
        return text, [part.name for part in (*parts, whole)]

    def _part(self, part: Function, pointers: Sequence[str]) -> str:
        """Return a part with its contract: it leaves the mode, and counts that are none of its own;
        one that it counts goes one on or starts anew.
        """
        counts = {self.place(count.timer): count.limit - 1 for count in self._counts()}
        own = [timer for timer in counts if f"{timer}++;" in part.body]
        others = {MODE, FIRED, *counts} - set(own)
        places = [place for place in self._places if place not in others]
        lines = [*pointers, *(f"requires {timer} <= {counts[timer]};" for timer in own)]
        lines.append(assigned(places))
        lines += [f"ensures {timer} == 0 || {timer} == \\old({timer}) + 1;" for timer in own]
        return contract_text([*lines, "exits \\false;"]) + add_loop_assigns(part, places)

    def _required(self) -> Iterator[str]:
        mode = mode_constant(self.program, self.mode.number)
        yield f"requires {MODE} == {mode} && {FIRED} == 0;"
        for count in self._counts():
            yield f"requires {self.place(count.timer)} <= {count.limit - 1};"
        yield from (f"requires {said};" for said in self._preserved_ranges())

    def _preserved_ranges(self) -> Iterator[str]:
        """Yield the ranges of the whole numbers that it reads or writes."""
        block = self.made.blocks[self.block]
        for name in sorted(self.wholes.keys() & {*block_reads(block), *block_writes(block)}):
            low, high = self.wholes[name]
            yield f"{low} <= {self.place(name)} <= {high}"

    def _counts(self) -> list[Count]:
        return [op for op in walk_ops(self.made.blocks[self.block]) if isinstance(op, Count)]

    @cached_property
    def _places(self) -> list[str]:
        return places_of(self.made, self.block)

    def _ensured(self) -> Iterator[str]:
        stays = f"{MODE} == {mode_constant(self.program, self.mode.number)}"
        outcomes = [f"({FIRED} == 0 && {stays})"]
        for info in self.transitions:
            target = mode_constant(self.program, info.target)
            outcomes.append(f"({FIRED} == {info.number} && {MODE} == {target})")
        yield f"ensures {' || '.join(outcomes)};"
        yield from (f"ensures {said};" for said in self._preserved_ranges())
        for count in self._counts():
            timer, most = self.place(count.timer), count.limit - 1
            yield f"ensures {timer} <= {most};"
            for info in self.transitions:
                if info.timer == count.timer and not info.tunable_wait:
                    full = f"\\old({timer}) == {most}"
                    yield f"ensures {FIRED} == {info.number} ==> {full};"
                    yield f"ensures {FIRED} == 0 && {full} ==> {timer} == 0;"
