"""Contract: what the guards of a mode may do, proven of the C by Frama-C's WP and SMT solvers.

`jump_<mode>` of a sampled automaton: nothing fires and the mode stays, or one of its transitions
fires and the mode is that transition's target; one that waits fires in the tick in which its
counter is full, and a full counter fires or starts anew; no counter passes its end; nothing else
is written than what its actions set; no access, shift or sum is undefined. Taken for granted:
functions of ha_math write nothing. Ranges are two comparisons here, as in `values.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from codegen.names import SOLVED_ON_PAGE, CNames, mode_constant
from codegen.proofs.proof import Proof, version_of
from codegen.source import STATIC, c_files, c_program
from codegen.tool import needed, told
from codegen.usage import locals_of
from language.operation import Count
from language.program import ModeInfo, Program, TransitionInfo
from language.traversal import block_writes, reached, walk

PROVER = "z3"
PARTS = (("-wp-prop=@ensures", "-wp-split"), ("-wp-prop=-@ensures",))
"""Outcomes of a mode with many ranges are proven way by way only."""
SECONDS = 20
"""Of a prover for one goal."""
PURE = re.compile(r"^(?=(?:static inline )?(?:double|float|bool|int32_t) ha_\w+\()", re.M)
NOTHING = "/*@ assigns \\nothing; */\n"
"""Functions of ha_math write nothing."""
KERNEL = (
    "-machdep",
    "gcc_x86_32",
    "-cpp-extra-args=-I. -Dvolatile=",
    "-warn-special-float",
    "none",
)
"""Whether reals stay finite is asked by the value analysis (values.py)."""
OPTIONS = ("-wp", "-wp-rte", "-wp-prover", PROVER, "-wp-timeout", str(SECONDS))
PROVED = re.compile(r"Proved goals: +(\d+) / (\d+)")
OPEN = re.compile(r"^\[wp\] \[[^]]*\] Goal (\S+)(?! : Valid)(?: : |$)", re.M)


def contract(program: Program, folder: Path) -> Proof:
    """Prove the contracts of the modes of a Program. Raises ToolMissing, BuildError."""
    made = c_program(program, by_amount=False)
    modes = [mode for mode in program.modes if f"jump_{mode.name}" in made.blocks]
    files = c_files(program, by_amount=False)
    tool = f"Frama-C {version_of('frama-c', folder)} WP"
    if program.period is None or program.regions or not modes:
        about = "one region of a sampled automaton has contracts"
        return Proof("contract", tool, about, is_asked=False)
    text, file = files[f"{program.name}.c"], f"{program.name}.c"
    for mode in modes:
        text = _Mode(program, made, mode).annotated(text)
    for name, own in {**files, file: text}.items():
        (folder / name).write_text(PURE.sub(lambda found: NOTHING, own))
    return _proven(folder, file, tool, [f"jump_{mode.name}" for mode in modes])


def _proven(folder: Path, file: str, tool: str, functions: list[str]) -> Proof:
    """Prove outcomes way by way, and everything else at once."""
    home, proven, asked = {"HOME": str(folder)}, 0, 0
    needed(PROVER)
    told(["why3", "config", "detect"], folder, home)
    found: list[str] = []
    for part in PARTS:
        words = [*KERNEL, *OPTIONS, *part, "-wp-fct", ",".join(functions), file]
        done = told(["frama-c", *words], folder, home)
        counts = PROVED.search(done.stdout)
        if done.returncode or counts is None:
            last = (done.stdout + done.stderr).strip().splitlines()[-1:]
            return Proof("contract", tool, "no result", tuple(last) or ("no result",))
        proven, asked = proven + int(counts[1]), asked + int(counts[2])
        found += OPEN.findall(done.stdout)
    if proven < asked and not found:
        found = [f"{asked - proven} goals were not proven"]
    about = f"{proven} of {asked} goals; {len(functions)} modes"
    return Proof("contract", tool, about, tuple(found))


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
        pointers = re.findall(r"(const [^,*]*)?\*(\w+)", found[1])
        lines = [*self._required(pointers), f"assigns {', '.join(self._written(found[1]))};"]
        lines += self._ensured()
        contract = "\n  ".join(["/*@", *lines]) + "\n*/\n"
        return text[: found.start()] + contract + text[found.start() :]

    def _required(self, pointers: list[tuple[str, str]]) -> Iterator[str]:
        for constant, name in pointers:
            yield f"requires \\valid{'_read' if constant else ''}({name});"
        if len(pointers) > 1:
            yield f"requires \\separated({', '.join(name for _, name in pointers)});"
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
