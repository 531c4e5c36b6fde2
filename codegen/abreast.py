"""Abreast: steps of several variants side by side, in the vectors of the processor.

Where nothing happens in a step of a continuous automaton, it is arithmetic of reals alone, the same
for all variants in one mode: that part of the Program's blocks is printed once more, over vectors.
Each lane has the bits of the step of one variant; a lane in which something happens takes that.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from codegen.expression import LIBRARY, literal
from codegen.names import CNames
from codegen.statement import wrapped
from language.assembly import ranged
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Choose,
    Compare,
    Expr,
    Op,
    Ref,
    Run,
    Select,
    Unary,
    Value,
)
from language.program import MODE, Program

LANES = 4
"""Variants side by side: reals in a vector of 32 bytes."""
Kind = Literal["real", "truth"]
LIMIT = {"work.h": Ref("work.left"), "work.is_wait": Value(False)}
"""What the limit of a step is where no wait ends inside it."""
PAGE = ("derived.", "calibration.")
READ = ("state.", "discrete.", "before.", "memory.armed", "memory.time")
WRITTEN = ("state.", "memory.time")
"""What a step without an event may read of an instance, and write; the page is the same for all."""


class NotAbreast(Exception):
    """A block that is not arithmetic of reals."""


@dataclass
class Lanes:
    """The blocks of a Program over vectors; `touched` are the names that they read and write."""

    program: Program
    kinds: Mapping[str, Kind]
    fixed: frozenset[str]
    blocks: dict[str, list[str]] = field(default_factory=dict)
    touched: dict[str, Kind] = field(default_factory=dict)
    called: dict[str, int] = field(default_factory=dict)
    named: dict[str, tuple[str, Kind]] = field(default_factory=dict)
    """What stands for values that have been made, with their kinds."""

    def block(self, name: str, ops: Block) -> None:
        """Print a block, after those that it runs."""
        if name not in self.blocks:
            self.blocks[name] = [f"    {line}" for op in ops for line in self._op(op)]

    def _op(self, op: Op) -> Iterator[str]:
        match op:
            case Assign(target, value, _) if self.kind(Ref(target)) == self.kind(value):
                yield from wrapped(f"{self.member(target)} = ", self.text(value), "", 96)
            case Run(inner):
                self.block(inner, self.program.blocks[inner])
                yield f"abreast_{inner}(all);"
            case _:
                raise NotAbreast

    def member(self, name: str) -> str:
        """Return where a vector of a name is."""
        self.touched.setdefault(name, self.kind(Ref(name)))
        return f"all->{flat(name)}"

    def kind(self, expr: Expr) -> Kind:
        """Return what an expression is. Raises NotAbreast for whole numbers and tables."""
        match expr:
            case Value(value) if isinstance(value, bool):
                return "truth"
            case Value(value) if isinstance(value, float):
                return "real"
            case Ref(name) if name in self.named:
                return self.named[name][1]
            case Ref(name) if name in self.kinds:
                return self.kinds[name]
            case Unary("not", _) | Binary("and" | "or", _, _) | Compare():
                return "truth"
            case Unary("-", operand) | Binary(_, operand, _) | Select(_, operand, _):
                return self.kind(operand)
            case Call(function, arguments) if function not in ("real", "whole"):
                if all(self.kind(argument) == "real" for argument in arguments):
                    return "real"
        raise NotAbreast

    def text(self, expr: Expr) -> str:
        """Return the C text of an expression over vectors."""
        match expr:
            case Value(value) if isinstance(value, bool):
                return "EVERY_LANE" if value else "NO_LANE"
            case Value(value):
                return f"EACH({literal(value, 'float64')})"
            case Ref(name) if name in self.named:
                return self.named[name][0]
            case Ref(name) if name in self.fixed:
                return f"EACH({CNames(self.program)(name)})"
            case Ref(name):
                return self.member(name)
            case Unary(operator, operand):
                return f"({'-' if operator == '-' else '~'}{self.text(operand)})"
            case Binary(operator, left, right):
                sign = {"and": "&", "or": "|"}.get(operator, operator)
                return f"({self.text(left)} {sign} {self.text(right)})"
            case Compare(operator, left, right):
                return self._compared(operator, left, right)
            case Select(condition, then, other):
                parts = ", ".join(self.text(part) for part in (condition, then, other))
                return f"CHOSEN{'_TRUTH' if self.kind(then) == 'truth' else ''}({parts})"
            case Call(function, arguments):
                self.called[function] = len(arguments)
                parts = ", ".join(self.text(argument) for argument in arguments)
                return f"each_{function}({parts})"
        raise NotAbreast

    def _compared(self, operator: str, left: Expr, right: Expr) -> str:
        kinds = self.kind(left), self.kind(right)
        if kinds == ("real", "real"):
            return f"(Truths)({self.text(left)} {operator} {self.text(right)})"
        if kinds != ("truth", "truth") or operator not in ("==", "!="):
            raise NotAbreast
        differs = f"({self.text(left)} ^ {self.text(right)})"
        return differs if operator == "!=" else f"(~{differs})"


def flat(name: str) -> str:
    """Return the member of a name: its group and itself."""
    return name.replace(".", "_").replace(" ", "_")


def abreast(program: Program, looks: list[tuple[int, str]]) -> dict[str, Any] | None:
    """Return what the template of steps side by side reads; None where a step is not arithmetic.

    `looks` are the slots of a row with the variables that they show.
    """
    try:
        return _Made(program, looks).context()
    except (NotAbreast, KeyError):
        return None


class _Made:
    """Steps side by side of one Program."""

    def __init__(self, program: Program, looks: list[tuple[int, str]]) -> None:
        if program.number != "float64" or program.invariants or len(program.mode_variables()) != 1:
            raise NotAbreast
        if "record" in program.blocks or program.blocks["load"]:
            raise NotAbreast
        if not all(one.name.startswith(("state.", "discrete.")) for one in ranged(program)):
            raise NotAbreast
        self.program, self.looks = program, looks
        variables = {one.name: one.type for one in program.variables}
        constants = {one.name: one.type for one in program.constants if not one.items}
        kinds: dict[str, Kind] = {
            name: "real" if kind == "real" else "truth"
            for name, kind in {**variables, **constants}.items()
            if kind in ("real", "truth")
        }
        groups = ("constant", "solved")
        fixed = frozenset(name for name in kinds if name.partition(".")[0] in groups)
        self.lanes = Lanes(program, kinds, fixed)

    def context(self) -> dict[str, Any]:
        self._require_plain_limit()
        modes = [self._mode(number, block) for number, block in self._by_mode("flow")]
        equations = dict(self._by_mode("equations"))
        for mode in modes:
            name = mode["equations"] = equations[mode["number"]]
            self.lanes.block(name, self.program.blocks[name])
        looks = [(k, self._looked_at(name)) for k, name in self.looks]
        touched = {**self.lanes.touched, "work.h": "real", "memory.time": "real"}
        if not all(name.startswith(("work.", "equation.", *PAGE, *READ)) for name in touched):
            raise NotAbreast
        return {
            "lanes": LANES,
            "members": [(flat(name), kind) for name, kind in touched.items()],
            "page": self._taken(touched, PAGE),
            "read": self._taken(touched, READ),
            "written": self._taken(touched, WRITTEN),
            "states": [flat(name) for name in touched if name.startswith("state.")],
            "blocks": [(name, lines) for name, lines in self.lanes.blocks.items()],
            "called": [
                (name, count, LIBRARY.get(name, f"ha_{name}"))
                for name, count in self.lanes.called.items()
            ],
            "modes": modes,
            "looks": looks,
        }

    def _taken(
        self, touched: Mapping[str, Kind], groups: tuple[str, ...]
    ) -> list[tuple[str, Kind, str]]:
        """Return the members of some groups, with what they are and their places in an instance."""
        place = CNames(self.program)
        return [
            (flat(name), kind, place(name).replace("->", "."))
            for name, kind in touched.items()
            if name.startswith(groups)
        ]

    def _require_plain_limit(self) -> None:
        """A step goes to its end: no wait ends inside it, and nothing counts its time."""
        found = {
            op.target: op.value for op in self.program.blocks["limit"] if isinstance(op, Assign)
        }
        if any(found.get(name) != value for name, value in LIMIT.items()) or len(found) != 3:
            raise NotAbreast

    def _by_mode(self, name: str) -> Iterator[tuple[int, str]]:
        (chosen,) = self.program.blocks[name]
        if not isinstance(chosen, Choose) or chosen.selector != MODE:
            raise NotAbreast
        for number, (run,) in chosen.cases:
            if not isinstance(run, Run):
                raise NotAbreast
            yield number, run.block

    def _mode(self, number: int, name: str) -> dict[str, Any]:
        """Return a step of a mode up to where something may happen, and what it then commits."""
        ops = self.program.blocks[name]
        (place,) = [k for k, op in enumerate(ops) if isinstance(op, Branch)]
        happens, behind = ops[place], ops[place + 1 :]
        if not isinstance(happens, Branch) or happens.condition != Ref("work.crossed"):
            raise NotAbreast
        self.lanes.block(name, ops[:place])
        commits = []
        for op in behind:
            if not (isinstance(op, Assign) and op.target.startswith("state.")):
                raise NotAbreast
            commits.append((flat(op.target), self.lanes.text(op.value)))
        self.lanes.member("work.crossed")
        return {"number": number, "block": name, "commits": commits}

    def _looked_at(self, name: str) -> str:
        """Return what is written to a row of a lane."""
        if name == MODE:
            return "(double)all->mode[lane]"
        member = self.lanes.member(name)
        return (
            f"{member}[lane]"
            if self.lanes.kind(Ref(name)) == "real"
            else f"({member}[lane] != 0 ? 1.0 : 0.0)"
        )
