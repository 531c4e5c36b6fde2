"""Contract: what the mode logic may do, proven of the C by Frama-C's WP and SMT solvers.

`jump_<mode>` of a sampled automaton: nothing fires and the mode stays, or one of its transitions
fires and the mode is that transition's target; one that waits fires in the tick in which its
counter is full, and a full counter fires or starts anew; no counter passes its end; nothing else
is written than what its actions set; no access, shift or sum is undefined. Taken for granted:
functions of ha_math write nothing. Ranges are two comparisons here, as in `values.py`. Where modes
stand inside modes the contracts are those of `chart_contract.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from codegen.names import SOLVED_ON_PAGE, CNames, mode_constant
from codegen.proofs.chart_contract import ChartContract, proven_of, written
from codegen.proofs.pointers import is_inside, required
from codegen.proofs.proof import Proof, version_of
from codegen.proofs.wp import Asked, asked, detected, pure
from codegen.source import STATIC, c_files, c_program
from codegen.usage import locals_of
from language.model import Automaton
from language.operation import Count
from language.program import ModeInfo, Program, TransitionInfo
from language.situation import charting_of
from language.traversal import block_writes, reached, walk

PARTS = (("-wp-prop=@ensures", "-wp-split"), ("-wp-prop=-@ensures",))
"""Outcomes of a mode with many ranges are proven way by way only."""


def contract(automaton: Automaton, program: Program, folder: Path) -> Proof:
    """Prove the contracts of the modes of a Program. Raises ToolMissing, BuildError."""
    made = c_program(program, by_amount=False)
    tool = f"Frama-C {version_of('frama-c', folder)} WP"
    modes = [mode for mode in program.modes if f"jump_{mode.name}" in made.blocks]
    files = c_files(program, by_amount=False)
    charting = charting_of(automaton, program.transitions) if automaton.is_sampled else None
    if charting and automaton.fault_mode is None:
        chart = ChartContract(charting, made)
        names = written(chart, files, folder)
        what = f"{len(names)} functions"
        what += f", of {', '.join(chart.unsaid)} lemmas alone" if chart.unsaid else ""
        return _told(tool, proven_of(program.name, names, folder), what)
    if program.period is None or program.regions or not modes:
        about = (
            "one region of a sampled automaton, and a chart without a fault mode, have contracts"
        )
        return Proof("contract", tool, about, is_asked=False)
    text, file = files[f"{program.name}.c"], f"{program.name}.c"
    for mode in modes:
        text = _Mode(program, made, mode).annotated(text)
    for name, own in {**files, file: text}.items():
        (folder / name).write_text(pure(own))
    found = _proven(folder, file, [f"jump_{mode.name}" for mode in modes])
    return _told(tool, found, f"{len(modes)} modes")


def _told(tool: str, found: Asked, what: str) -> Proof:
    about = f"{found.proven} of {found.asked} goals; {what}" if found.asked else "no result"
    return Proof("contract", tool, about, found.open)


def _proven(folder: Path, file: str, functions: Sequence[str]) -> Asked:
    """Prove outcomes way by way, and everything else at once."""
    detected(folder)
    found = [asked(folder, file, functions, ("-wp-rte", *part)) for part in PARTS]
    return sum(found, start=Asked(0, 0, ()))


@dataclass(frozen=True)
class _Mode:
    """The contract of one mode; `made` is the Program that the C is printed of."""

    program: Program
    made: Program
    mode: ModeInfo

    @property
    def place(self) -> CNames:
        """Where names are in C."""
        block = f"jump_{self.mode.name}"
        return CNames(self.made, locals_of(self.made)[block], SOLVED_ON_PAGE)

    @property
    def transitions(self) -> list[TransitionInfo]:
        """Its transitions."""
        return [info for info in self.program.transitions if info.source == self.mode.number]

    def annotated(self, text: str) -> str:
        """Return C with the contract before its function."""
        head = re.compile(rf"^{STATIC}void jump_{self.mode.name}\(([^)]*)\)", re.M)
        found = head.search(text)
        assert found, self.mode.name
        lines = [*required(found[1], is_inside(text)), *self._required()]
        lines.append(f"assigns {', '.join(self._written(found[1]))};")
        lines += self._ensured()
        contract = "\n  ".join(["/*@", *lines]) + "\n*/\n"
        return text[: found.start()] + contract + text[found.start() :]

    def _required(self) -> Iterator[str]:
        mode = mode_constant(self.program, self.mode.number)
        yield f"requires self->mode == {mode} && self->fired == 0;"
        for count in self._counts():
            yield f"requires {self.place(count.timer)} <= {count.limit - 1};"

    def _counts(self) -> list[Count]:
        block = self.made.blocks[f"jump_{self.mode.name}"]
        return [op for op in walk(block) if isinstance(op, Count)]

    def _written(self, parameters: str) -> list[str]:
        names: set[str] = set()
        for block in reached(f"jump_{self.mode.name}", self.made.blocks):
            names |= set(block_writes(self.made.blocks[block]))
        local = locals_of(self.made)[f"jump_{self.mode.name}"]
        inside = sorted(self.place(name) for name in names - local if not name.startswith("work."))
        return [*inside, *(["*work"] if "*work" in parameters else [])] or ["\\nothing"]

    def _ensured(self) -> Iterator[str]:
        stays = f"self->mode == {mode_constant(self.program, self.mode.number)}"
        outcomes = [f"(self->fired == 0 && {stays})"]
        for info in self.transitions:
            target = mode_constant(self.program, info.target)
            outcomes.append(f"(self->fired == {info.number} && self->mode == {target})")
        yield f"ensures {' || '.join(outcomes)};"
        for count in self._counts():
            timer, most = self.place(count.timer), count.limit - 1
            yield f"ensures {timer} <= {most};"
            for info in self.transitions:
                if info.timer == count.timer and not info.tunable:
                    full = f"\\old({timer}) == {most}"
                    yield f"ensures self->fired == {info.number} ==> {full};"
                    yield f"ensures self->fired == 0 && {full} ==> {timer} == 0;"
