"""SIMD batch: steps of several variants at once, one in each SIMD lane.

An event-free step of a continuous automaton is arithmetic of reals, which is the same for all
variants in one mode. The module prints these blocks of a Program again over vectors. Each lane has
the bits of the scalar step. A lane in which an event occurs executes the scalar step.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from codegen.emit.c_expression import LIBM_FUNCTIONS, format_literal
from codegen.emit.c_names import CNames
from codegen.emit.c_statement import emit_wrapped_statement
from language.ir.expression_type import expression_type
from language.ir.ops import (
    Assign,
    Binary,
    Block,
    Branch,
    Call,
    Compare,
    Expr,
    Item,
    Op,
    Ref,
    RunBlock,
    Select,
    Switch,
    Unary,
    Value,
)
from language.ir.program import MODE_VARIABLE, Program, ValueType
from language.ir.traversal import subexpressions
from language.programs.system_program import range_event_variables

LANES = 4
"""Number of SIMD lanes: float64 values in a vector of 32 bytes."""
LaneKind = Literal["real", "truth"]
"""The kind of the values in the lanes of a vector."""
FULL_STEP_LIMIT = {"work.h": Ref("work.left"), "work.is_wait": Value(False)}
"""Assignments of the block `limit` in a step in which no wait ends."""
PAGE_PREFIXES = ("derived.", "calibration.")
"""Prefixes of names that are the same for all variants and constant during a run."""
READ_PREFIXES = ("state.", "discrete.", "before.", "memory.armed", "memory.time")
"""Prefixes of names that a step without an event may read from an instance."""
WRITTEN_PREFIXES = ("state.", "memory.time")
"""Prefixes of names that a step without an event may write to an instance."""


class NotVectorisable(Exception):
    """A block that is not arithmetic of reals and truth values."""


@dataclass
class VectorEmitter:
    """Prints blocks of a Program over vectors.

    `kinds` are the kinds of all reals and truth values, `fixed` the names that are equal in all
    lanes. `blocks` collects the printed lines, `accessed` the names that are read or written, and
    `called_functions` the functions with their number of arguments.
    """

    program: Program
    kinds: Mapping[str, LaneKind]
    fixed: frozenset[str]
    blocks: dict[str, list[str]] = field(default_factory=dict)
    accessed: dict[str, LaneKind] = field(default_factory=dict)
    called_functions: dict[str, int] = field(default_factory=dict)
    named_values: dict[str, tuple[str, LaneKind]] = field(default_factory=dict)
    """C names and kinds of local values, which replace names of the Program."""

    def emit_block(self, name: str, ops: Block) -> None:
        """Print a block and those that it runs into `blocks`, unless it is there already.

        Only assignments whose two sides have one kind, and calls of blocks, can be printed; raises
        NotVectorisable for others.
        """
        if name not in self.blocks:
            self.blocks[name] = [f"    {line}" for op in ops for line in self._emit_op(op)]

    def _emit_op(self, op: Op) -> Iterator[str]:
        """Yield the lines of an assignment or a call of a block.

        Raises NotVectorisable for others.
        """
        match op:
            case Assign(target, value, _) if self.kind_of(Ref(target)) == self.kind_of(value):
                yield from emit_wrapped_statement(
                    f"{self.vector_member(target)} = ", self.emit_expression(value), "", 96
                )
            case RunBlock(inner):
                self.emit_block(inner, self.program.blocks[inner])
                yield f"simd_{inner}(all);"
            case _:
                raise NotVectorisable

    def vector_member(self, name: str) -> str:
        """Return the C text of the vector of a name, `all-><flat name>`, and add it to `accessed`.

        Raises NotVectorisable if the name has no kind.
        """
        self.accessed.setdefault(name, self.kind_of(Ref(name)))
        return f"all->{flatten_name(name)}"

    def kind_of(self, expr: Expr) -> LaneKind:
        """Return the kind of an expression.

        It is the type of the expression (`expression_type`). Raises NotVectorisable for whole
        numbers, unknown names, elements of tables, the functions `real` and `whole`, and calls with
        a truth value.
        """
        parts = subexpressions(expr)
        types: dict[str, ValueType] = {
            part.name: self._kind_of_name(part.name) for part in parts if isinstance(part, Ref)
        }
        for part in parts:
            if isinstance(part, Item) or expression_type(part, types) == "whole":
                raise NotVectorisable
            if isinstance(part, Call) and (
                part.function == "real"
                or any(expression_type(argument, types) != "real" for argument in part.arguments)
            ):
                raise NotVectorisable
        return "truth" if expression_type(expr, types) == "truth" else "real"

    def _kind_of_name(self, name: str) -> LaneKind:
        """Return the kind of a name. Raises NotVectorisable for an unknown one."""
        if name in self.named_values:
            return self.named_values[name][1]
        if name in self.kinds:
            return self.kinds[name]
        raise NotVectorisable

    def emit_expression(self, expr: Expr) -> str:
        """Return the C text of an expression over vectors, and record its names and functions.

        Literals and names in `fixed` become vectors of equal lanes, choices the macros CHOSEN and
        CHOSEN_TRUTH, calls `each_<function>`. Raises NotVectorisable for whole numbers, elements of
        tables, and comparisons of truth values other than == and !=.
        """
        match expr:
            case Value(value) if isinstance(value, bool):
                return "EVERY_LANE" if value else "NO_LANE"
            case Value(value):
                return f"EACH({format_literal(value, 'float64')})"
            case Ref(name) if name in self.named_values:
                return self.named_values[name][0]
            case Ref(name) if name in self.fixed:
                return f"EACH({CNames(self.program)(name)})"
            case Ref(name):
                return self.vector_member(name)
            case Unary(operator, operand):
                return f"({'-' if operator == '-' else '~'}{self.emit_expression(operand)})"
            case Binary(operator, left, right):
                sign = {"and": "&", "or": "|"}.get(operator, operator)
                return f"({self.emit_expression(left)} {sign} {self.emit_expression(right)})"
            case Compare(operator, left, right):
                return self._emit_comparison(operator, left, right)
            case Select(condition, then, other):
                parts = ", ".join(self.emit_expression(part) for part in (condition, then, other))
                return f"CHOSEN{'_TRUTH' if self.kind_of(then) == 'truth' else ''}({parts})"
            case Call(function, arguments):
                parts = ", ".join(self.emit_expression(argument) for argument in arguments)
                self.called_functions[function] = len(arguments)
                return f"each_{function}({parts})"
        raise NotVectorisable

    def _emit_comparison(self, operator: str, left: Expr, right: Expr) -> str:
        """Return the C text of a comparison of two reals, or `==` or `!=` of two truth values."""
        kinds = self.kind_of(left), self.kind_of(right)
        if kinds == ("real", "real"):
            return (
                f"(Truths)({self.emit_expression(left)} {operator} {self.emit_expression(right)})"
            )
        if kinds != ("truth", "truth") or operator not in ("==", "!="):
            raise NotVectorisable
        differs = f"({self.emit_expression(left)} ^ {self.emit_expression(right)})"
        return differs if operator == "!=" else f"(~{differs})"


def flatten_name(name: str) -> str:
    """Return the member name of a variable: its full name with underscores for dots and blanks."""
    return name.replace(".", "_").replace(" ", "_")


def simd_batch_context(program: Program, row_slots: list[tuple[int, str]]) -> dict[str, Any] | None:
    """Return the template context of SIMD steps; None if a step cannot be vectorised.

    That is the case for float32, invariants, regions, delays, waits, monitored ranges of other
    variables than states and discrete ones, and blocks that are not arithmetic of reals and truth
    values. `row_slots` are pairs of a slot in a row and the variable that fills it.
    """
    try:
        return _BatchBuilder(program, row_slots).context()
    except (NotVectorisable, KeyError):
        return None


class _BatchBuilder:
    """Builds the template context of the SIMD steps of one Program.

    Raises NotVectorisable for float32, invariants, regions, delays, waits that are loaded, and
    ranges of other variables than states and discrete ones.
    """

    def __init__(self, program: Program, row_slots: list[tuple[int, str]]) -> None:
        if (
            program.number_type != "float64"
            or program.invariants
            or len(program.mode_variables()) != 1
        ):
            raise NotVectorisable
        if "record" in program.blocks or program.blocks["restart_waits"]:
            raise NotVectorisable
        if not all(
            one.name.startswith(("state.", "discrete.")) for one in range_event_variables(program)
        ):
            raise NotVectorisable
        self.program, self.row_slots = program, row_slots
        variables = {one.name: one.type for one in program.variables}
        constants = {one.name: one.type for one in program.constants if not one.items}
        kinds: dict[str, LaneKind] = {
            name: "real" if kind == "real" else "truth"
            for name, kind in {**variables, **constants}.items()
            if kind in ("real", "truth")
        }
        groups = ("constant", "solved")
        fixed = frozenset(name for name in kinds if name.partition(".")[0] in groups)
        self.emitter = VectorEmitter(program, kinds, fixed)

    def context(self) -> dict[str, Any]:
        """Return the template context. Raises NotVectorisable."""
        self._require_full_step()
        modes = [self._mode_context(number, block) for number, block in self._mode_blocks("flow")]
        equations = dict(self._mode_blocks("equations"))
        for mode in modes:
            name = mode["equations"] = equations[mode["number"]]
            self.emitter.emit_block(name, self.program.blocks[name])
        looks = [(k, self._row_value(name)) for k, name in self.row_slots]
        accessed = {**self.emitter.accessed, "work.h": "real", "memory.time": "real"}
        if not all(
            name.startswith(("work.", "equation.", *PAGE_PREFIXES, *READ_PREFIXES))
            for name in accessed
        ):
            raise NotVectorisable
        return {
            "lanes": LANES,
            "members": [(flatten_name(name), kind) for name, kind in accessed.items()],
            "page": self._select_members(accessed, PAGE_PREFIXES),
            "read": self._select_members(accessed, READ_PREFIXES),
            "written": self._select_members(accessed, WRITTEN_PREFIXES),
            "states": [flatten_name(name) for name in accessed if name.startswith("state.")],
            "blocks": [(name, lines) for name, lines in self.emitter.blocks.items()],
            "called": [
                (name, count, LIBM_FUNCTIONS.get(name, f"ha_{name}"))
                for name, count in self.emitter.called_functions.items()
            ],
            "modes": modes,
            "looks": looks,
        }

    def _select_members(
        self, accessed: Mapping[str, LaneKind], groups: tuple[str, ...]
    ) -> list[tuple[str, LaneKind, str]]:
        """Return the accessed members of some groups: name, kind and place in an instance."""
        c_names = CNames(self.program)
        return [
            (flatten_name(name), kind, c_names(name).replace("->", "."))
            for name, kind in accessed.items()
            if name.startswith(groups)
        ]

    def _require_full_step(self) -> None:
        """Raise NotVectorisable unless every step has its full length: no wait ends inside it."""
        values = {
            op.target: op.value for op in self.program.blocks["limit"] if isinstance(op, Assign)
        }
        if (
            any(values.get(name) != value for name, value in FULL_STEP_LIMIT.items())
            or len(values) != 3
        ):
            raise NotVectorisable

    def _mode_blocks(self, name: str) -> Iterator[tuple[int, str]]:
        """Yield the number of each mode and the block that a switch runs for it."""
        (chosen,) = self.program.blocks[name]
        if not isinstance(chosen, Switch) or chosen.selector != MODE_VARIABLE:
            raise NotVectorisable
        for number, (run,) in chosen.cases:
            if not isinstance(run, RunBlock):
                raise NotVectorisable
            yield number, run.block

    def _mode_context(self, number: int, name: str) -> dict[str, Any]:
        """Return the context of a step in a mode: the block up to the event branch, new states.

        Raises NotVectorisable if anything but assignments of states follows the branch.
        """
        ops = self.program.blocks[name]
        (place,) = [k for k, op in enumerate(ops) if isinstance(op, Branch)]
        event_branch, rest = ops[place], ops[place + 1 :]
        if not isinstance(event_branch, Branch) or event_branch.condition != Ref("work.crossed"):
            raise NotVectorisable
        self.emitter.emit_block(name, ops[:place])
        commits = []
        for op in rest:
            if not (isinstance(op, Assign) and op.target.startswith("state.")):
                raise NotVectorisable
            commits.append((flatten_name(op.target), self.emitter.emit_expression(op.value)))
        self.emitter.vector_member("work.crossed")
        return {"number": number, "block": name, "commits": commits}

    def _row_value(self, name: str) -> str:
        """Return the C text of the value that a lane writes to a row."""
        if name == MODE_VARIABLE:
            return "(double)all->mode[lane]"
        member = self.emitter.vector_member(name)
        return (
            f"{member}[lane]"
            if self.emitter.kind_of(Ref(name)) == "real"
            else f"({member}[lane] != 0 ? 1.0 : 0.0)"
        )
