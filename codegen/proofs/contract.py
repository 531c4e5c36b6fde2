"""Contract: what the mode logic may do, proven of the C by Frama-C's WP and SMT solvers.

`jump_<mode>` of a sampled automaton: nothing fires and the mode stays, or one of its transitions
fires and the mode is that transition's target; one that waits fires in the tick in which its
counter is full, and a full counter fires or starts anew; no counter passes its end; whole numbers
stay in their ranges; nothing else is written than what its actions set; no access, shift or sum is
undefined. Taken for granted: functions of ha_math write nothing, whole numbers begin in their
ranges. Ranges are two comparisons here, as in `values.py`. Where a transition runs functions they
have contracts too (`effect.py`), choices that set no mode stand in functions of their own
(`outline.py`), and what `values.py` asks is not asked again. Where modes stand inside modes the
contracts are those of `chart_contract.py`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TypeAlias

from codegen.names import SOLVED_ON_PAGE, CNames, mode_constant
from codegen.proofs.chart_contract import MODEL, ChartContract, proven_of, written
from codegen.proofs.effect import (
    assigned,
    called_by,
    contract_text,
    places_of,
    seen_of,
    with_effects,
    with_turns,
)
from codegen.proofs.outline import Function, function_of, outlined_but
from codegen.proofs.pointers import is_inside, required
from codegen.proofs.proof import Proof, version_of
from codegen.proofs.wp import Asked, asked, detected, pure
from codegen.source import c_files, c_program
from codegen.usage import locals_of
from language.fault import with_fault_transitions
from language.model import Automaton
from language.operation import Count
from language.program import ModeInfo, Program, TransitionInfo
from language.situation import charting_of
from language.traversal import block_reads, block_writes, walk

PARTS = (("-wp-rte", "-wp-prop=@ensures", "-wp-split"), ("-wp-rte", "-wp-prop=-@ensures"))
"""Outcomes of a mode with many ranges are proven way by way only."""
OF_CALLED = MODEL
"""Functions that transitions run: reals are numbers without rounding, nothing is asked of them."""
OF_CALLING = (*MODEL, "-wp-split")
"""Modes whose transitions run functions."""
MODE, FIRED = "self->mode", "self->fired"
Wholes: TypeAlias = Mapping[str, tuple[int, int]]
NOTHING_KEPT: Wholes = {}
Asking: TypeAlias = tuple[list[str], tuple[str, ...]]
"""Functions, and how WP is asked for their contracts."""


def contract(automaton: Automaton, program: Program, folder: Path) -> Proof:
    """Prove the contracts of the modes of a Program. Raises ToolMissing, BuildError."""
    made = c_program(program, by_amount=False)
    tool = f"Frama-C {version_of('frama-c', folder)} WP"
    modes = [mode for mode in program.modes if f"jump_{mode.name}" in made.blocks]
    files = c_files(program, by_amount=False)
    charting = None
    if automaton.is_sampled:
        charting = charting_of(with_fault_transitions(automaton), program.transitions)
    if charting:
        chart = ChartContract(charting, made)
        names = written(chart, files, folder)
        what = f"{len(names)} functions"
        what += f", of {', '.join(chart.unsaid)} lemmas alone" if chart.unsaid else ""
        return _told(tool, proven_of(program.name, names, folder), what)
    if program.period is None or program.regions or not modes:
        about = "one region of a sampled automaton, and a chart, have contracts"
        return Proof("contract", tool, about, is_asked=False)
    asking = written_of(program, files, folder, wholes_of(automaton))
    run = sum(len(names) for names, options in asking if options == OF_CALLED)
    also = f", {run} functions that they run" if run else ""
    found = proven_with(folder, f"{program.name}.c", asking)
    return _told(tool, found, f"{len(modes)} modes{also}")


def wholes_of(automaton: Automaton) -> Wholes:
    """Return the ranges of whole numbers that an automaton keeps, by their names in a Program."""
    return {
        f"discrete.{name}": (int(one.range[0]), int(one.range[1]))
        for name, one in automaton.discrete.items()
        if one.type == "int" and one.range
    }


def written_of(
    program: Program, files: Mapping[str, str], folder: Path, wholes: Wholes = NOTHING_KEPT
) -> list[Asking]:
    """Write C with its contracts into a folder; return what is to be proven: of modes and their
    parts, and of the functions that these run. `wholes` are ranges of whole numbers that are kept.
    """
    made, file = c_program(program, by_amount=False), f"{program.name}.c"
    modes = [mode for mode in program.modes if f"jump_{mode.name}" in made.blocks]
    called = called_by(made, [f"jump_{mode.name}" for mode in modes])
    text, functions = with_effects(made, files[file], called), []
    for mode in modes:
        text, names = _Mode(program, made, mode, wholes).annotated(text, in_parts=bool(called))
        functions += names
    for name, own in {**files, file: text}.items():
        (folder / name).write_text(pure(own))
    if called:
        return [(called, OF_CALLED), (functions, OF_CALLING)]
    return [(functions, options) for options in PARTS]


def _told(tool: str, found: Asked, what: str) -> Proof:
    about = f"{found.proven} of {found.asked} goals; {what}" if found.asked else "no result"
    return Proof("contract", tool, about, found.open)


def proven_with(folder: Path, file: str, asking: Sequence[Asking]) -> Asked:
    """Prove the contracts of functions of modes, and of what these run."""
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
        return CNames(self.made, locals_of(self.made)[self.block], SOLVED_ON_PAGE)

    @property
    def transitions(self) -> list[TransitionInfo]:
        """Its transitions."""
        return [info for info in self.program.transitions if info.source == self.mode.number]

    def annotated(self, text: str, in_parts: bool) -> tuple[str, list[str]]:
        """Return C with contracts before its function and its parts, and the names of these."""
        function = function_of(text, self.block)
        *parts, whole = outlined_but(function, (MODE, FIRED)) if in_parts else [function]
        pointers = list(required(function.parameters, is_inside(text)))
        told = [self._part(part, pointers) for part in parts]
        seen = assigned(seen_of(function, self._places))
        lines = [*pointers, *self._required(), seen, *self._ensured()]
        told.append(contract_text(lines) + with_turns(whole, self._places))
        text = text[: function.start] + "\n".join(told) + text[function.end :]
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
        return contract_text([*lines, "exits \\false;"]) + with_turns(part, places)

    def _required(self) -> Iterator[str]:
        mode = mode_constant(self.program, self.mode.number)
        yield f"requires {MODE} == {mode} && {FIRED} == 0;"
        for count in self._counts():
            yield f"requires {self.place(count.timer)} <= {count.limit - 1};"
        yield from (f"requires {said};" for said in self._kept())

    def _kept(self) -> Iterator[str]:
        """Yield the ranges of the whole numbers that it reads or writes."""
        block = self.made.blocks[self.block]
        for name in sorted(self.wholes.keys() & {*block_reads(block), *block_writes(block)}):
            low, high = self.wholes[name]
            yield f"{low} <= {self.place(name)} <= {high}"

    def _counts(self) -> list[Count]:
        return [op for op in walk(self.made.blocks[self.block]) if isinstance(op, Count)]

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
        yield from (f"ensures {said};" for said in self._kept())
        for count in self._counts():
            timer, most = self.place(count.timer), count.limit - 1
            yield f"ensures {timer} <= {most};"
            for info in self.transitions:
                if info.timer == count.timer and not info.tunable:
                    full = f"\\old({timer}) == {most}"
                    yield f"ensures {FIRED} == {info.number} ==> {full};"
                    yield f"ensures {FIRED} == 0 && {full} ==> {timer} == 0;"
