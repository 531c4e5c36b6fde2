"""Chart contracts: contracts of the functions of a micro-step, inserted before each of them in C.

The contracts of `select_transitions`, `resolve_conflicts`, `commit`, and of the functions that
count and choose in a mode, follow from the chart. All other functions, and the parts into which
these are split, have lemmas from the Program (`symbolic_summary.py`): the values that they leave,
and that they write nothing else.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from codegen.emit.c_names import c_member
from codegen.passes.block_usage import locals_of
from codegen.proofs.acsl.acsl_expression import Unsaid
from codegen.proofs.acsl.assigns_contract import (
    add_loop_assigns,
    assigned,
    contract_text,
    is_inside,
    required,
)
from codegen.proofs.acsl.chart_commit_contract import Commit
from codegen.proofs.acsl.chart_conflict_contract import ConflictResolution
from codegen.proofs.acsl.chart_predicates import Configuration
from codegen.proofs.acsl.chart_selection_contract import Choice
from codegen.proofs.acsl.chart_step_contract import Jump, Step
from codegen.proofs.acsl.function_outlining import (
    Function,
    function_of,
    move_scratch_to_parameter,
    outline_calls,
    outline_choices,
    part_name,
)
from codegen.proofs.acsl.symbolic_summary import Summary
from codegen.proofs.acsl.wp import Asked, asked, detected, pure
from language.charts.chart_context import ChartContext, request_variable, to_identifier
from language.ir.ops import (
    Assign,
    Block,
    Branch,
    Count,
    Loop,
    Op,
    Ref,
    RunBlock,
    Select,
    Store,
    Switch,
)
from language.ir.program import Program
from language.ir.traversal import block_writes, reachable_blocks, walk_ops
from language.model.statechart import ChartNode

SELECT, RESOLVE, COMMIT = "select_transitions", "resolve_conflicts", "commit"
STEP, JUMP = "micro_step", "jump"
MODEL = ("-wp-model", "Typed+real")
"""Options of WP: reals have no rounding, which suffices because guards only compare them. Accesses
and overflows are checked by the value analysis (eva.py)."""
OF_PARTS = (*MODEL, "-wp-split")
OF_CHART = MODEL
"""Options for functions that run others one after the other."""
ONE_BY_ONE = (
    SELECT,
    RESOLVE,
    COMMIT,
    JUMP,
    *(f"{name}_{k}" for name in (STEP, JUMP) for k in (1, 2)),
)
OWN_TYPE = r"\b(u?)int(?:16|32)_t (?={}\[)"


def write_chart_contracts(made: ChartContract, files: Mapping[str, str], folder: Path) -> list[str]:
    """Write the C with its contracts into a folder; return the functions that have a contract."""
    name = made.made.name
    text, names = made.annotated(files[f"{name}.c"])
    head = made.with_apart(files[f"{name}.h"])
    for file, own in {**files, f"{name}.c": text, f"{name}.h": head}.items():
        (folder / file).write_text(pure(own))
    return names


def prove_chart_contracts(name: str, functions: Sequence[str], folder: Path) -> Asked:
    """Prove the contracts of functions of a module and return the goals.

    Raises MissingToolError, BuildError.
    """
    detected(folder)
    chart = [one for one in functions if one in ONE_BY_ONE]
    parts = [one for one in functions if one not in chart]
    found = Asked(0, 0, ())
    for own, options in ((parts, OF_PARTS), (chart, OF_CHART)):
        found += asked(folder, f"{name}.c", own, options) if own else Asked(0, 0, ())
    return found


@dataclass(frozen=True)
class ChartContract:
    """The contracts of a chart; `made` is the Program after the passes of the C generator."""

    charting: ChartContext
    made: Program

    @cached_property
    def words(self) -> Configuration:
        """The predicates of the contracts."""
        return Configuration(self.charting, self.made)

    @property
    def functions(self) -> list[str]:
        """The functions of a micro-step."""
        found = reachable_blocks(JUMP, self.made.blocks)
        return [name for name in self.made.blocks if name in found]

    @property
    def unsaid(self) -> tuple[str, ...]:
        """The functions with a lemma only: their contract has no translation to ACSL."""
        places = [(name, name) for name in self.functions]
        places += [(SELECT, part) for part in self._selected]
        return tuple(part for block, part in places if self._said(block, part) is None)

    def annotated(self, text: str) -> tuple[str, list[str]]:
        """Return the C with contracts before its functions, and the names of these."""
        proven: list[str] = []
        work_is_inside = is_inside(text)
        text = move_scratch_to_parameter(text, JUMP)
        for name in self.functions:
            function = function_of(text, name)
            parts = self._parts(function)
            proven += [part.name for part in parts]
            made = "\n".join(self._contract(name, part, work_is_inside) for part in parts)
            text = text[: function.start] + made + text[function.end :]
        return text, proven

    def _parts(self, function: Function) -> list[Function]:
        """Return the functions that a function is in the copy that is proven, itself at last."""
        if function.name == self._stepping:
            return outline_calls(function, (SELECT, COMMIT))
        return [function] if function.name == JUMP else outline_choices(function)

    def with_apart(self, text: str) -> str:
        """Return a header in which arrays of whole numbers have 64-bit elements.

        A store into an array then cannot alias a variable, and every number fits.
        """
        for variable in self.made.variables:
            if variable.size and variable.type == "whole":
                text = re.sub(OWN_TYPE.format(c_member(variable.name)), r"\1int64_t ", text)
        return text

    def _contract(self, block: str, part: Function, work_is_inside: bool) -> str:
        own = self._own(block, part.name)
        lines = [*required(part.parameters, work_is_inside), *self._required(block, part.name, own)]
        places = self._assigned(block, own)
        lines += [assigned(places), *self._ensured(block, part.name, own), "exits \\false;"]
        held = Jump(self.words).turns() if block == JUMP else ()
        return contract_text(lines) + add_loop_assigns(part, places, held)

    def _own(self, block: str, part: str) -> Block:
        """Return the operations of a part of a function, or of all of it."""
        if part in self._steps:
            return self._steps[part][0]
        op = self._ops(block).get(part)
        return (op,) if op else self.made.blocks[block]

    @property
    def _stepping(self) -> str:
        """The function that does one micro-step."""
        return STEP if STEP in self.made.blocks else JUMP

    @cached_property
    def _steps(self) -> dict[str, tuple[Block, Sequence[str], Sequence[str]]]:
        """The parts of that function: operations, what is asked before, and what they leave."""
        step, blocks = Step(self.words), self.made.blocks
        names = [part_name(self._stepping, number) for number in range(3)]
        choosing = tuple(RunBlock(name) for name in (SELECT, RESOLVE) if name in blocks)
        valid = list(self.words.valid(self.words.now))
        found: dict[str, tuple[Block, Sequence[str], Sequence[str]]] = {
            names[0]: (choosing, valid, list(step.chosen())),
            names[1]: (
                (RunBlock(COMMIT),),
                list(Commit(self.words).required()),
                list(step.committed()),
            ),
        }
        if STEP in blocks:
            done = next(op.then for op in blocks[STEP] if isinstance(op, Branch))
            found[names[2]] = (done, list(step.taking()), list(step.moved()))
        return found

    def _ops(self, block: str) -> dict[str, Op]:
        """Return the operations of a block that are choices, by the part that they are in C."""
        found = [op for op in self.made.blocks[block] if _is_choice(op)]
        return {part_name(block, number): op for number, op in enumerate(found)}

    def _required(self, block: str, part: str, own: Block) -> Iterator[str]:
        said: Iterable[str] = ()
        words = self.words
        if block == COMMIT and part == block:
            said = Commit(words).required()
        elif part in self._steps:
            said = self._steps[part][1]
        elif block == STEP:
            said = Step(words).required()
        elif block == JUMP:
            said = Jump(words).required()
        elif block == SELECT and (region := self._selected.get(part)):
            said = (f"{words.now(request_variable(region.region))} == 0",)
        yield from (f"requires {one};" for one in said)
        yield from (f"requires {one}" for one in self._places(own))

    def _ensured(self, block: str, part: str, own: Block) -> Iterator[str]:
        yield from self._said(block, part) or self._lemmas(block, own)
        yield from (f"ensures {one}" for one in self._places(own))

    def _said(self, block: str, part: str) -> list[str] | None:
        """Return what the chart asks of a function; None where that is not said in ACSL."""
        try:
            return list(self._asked(block, part))
        except Unsaid:
            return None

    def _asked(self, block: str, part: str) -> Iterator[str]:
        """Yield what the chart asks of a function. Raises Unsaid."""
        words = self.words
        if block in self._counting:
            yield from Choice(words).counted(self._counting[block])
        elif block in self._choosing:
            yield from Choice(words).of_mode(self._choosing[block])
        elif block == SELECT:
            own = self._selected.get(part)
            for region in self.charting.chart.regions if part == block else [own] if own else []:
                yield from Choice(words).of_region(region)
        elif part != block and part not in self._steps:
            return
        elif block == RESOLVE:
            yield from ConflictResolution(words).ensured()
        elif block == COMMIT:
            yield from Commit(words).ensured()
        elif part in self._steps:
            yield from (f"ensures {said};" for said in self._steps[part][2])
        elif block in (STEP, JUMP):
            made = Step(words) if block == STEP else Jump(words)
            yield from (f"ensures {said};" for said in made.ensured())

    def _lemmas(self, block: str, own: Block) -> Iterator[str]:
        silent = {v.name for v in self.made.variables if v.size}
        silent |= self._locals[block]
        words = self.words
        made = Summary(self.made.blocks, words.speech, words.before, words.now)
        return made.ensured(own, frozenset(silent))

    @cached_property
    def _locals(self) -> Mapping[str, frozenset[str]]:
        return locals_of(self.made)

    def _assigned(self, block: str, own: Block) -> list[str]:
        blocks = {**self.made.blocks, "": own}
        names: set[str] = set()
        for name in reachable_blocks("", blocks):
            local = self._locals[name or block]
            written = set(block_writes(blocks[name]))
            names |= written - local
        sizes = {v.name: f"[0 .. {v.size - 1}]" for v in self.made.variables if v.size}
        return sorted(self.words.place(name) + sizes.get(name, "") for name in names)

    def _places(self, own: Block) -> Iterator[str]:
        """Yield that places at which a part of a function stores something are none before 0."""
        stores = [op for op in walk_ops(own) if isinstance(op, Store)] if len(own) == 1 else []
        names = {op.index.name for op in stores if isinstance(op.index, Ref)}
        yield from (f"0 <= {self.words.now(name)};" for name in sorted(names))

    @cached_property
    def _counting(self) -> dict[str, ChartNode]:
        return {f"count_{to_identifier(node.path)}": node for node in self._moving}

    @cached_property
    def _choosing(self) -> dict[str, ChartNode]:
        return {f"choose_{to_identifier(node.path)}": node for node in self._moving}

    @property
    def _moving(self) -> list[ChartNode]:
        return [node for node in self.charting.chart.nodes if self.charting.transitions_of(node)]

    @cached_property
    def _selected(self) -> dict[str, ChartNode]:
        """The region that a part of `select_transitions` chooses in."""
        regions = {self.words.mode(r.region): r for r in self.charting.chart.regions}
        found = {name: _inner(op) for name, op in self._ops(SELECT).items()}
        return {name: regions[op.selector] for name, op in found.items() if isinstance(op, Switch)}


def _inner(op: Op) -> Op:
    """Return the choice of a region, also where it is made only if no fault happened."""
    return op.other[0] if isinstance(op, Branch) and not op.then and op.other else op


def _is_choice(op: Op) -> bool:
    """Tell whether an operation is a choice or a loop in C."""
    if isinstance(op, Assign):
        value = op.value
        parts = (value.then, value.other) if isinstance(value, Select) else ()
        return any(isinstance(part, Select) for part in parts)
    return isinstance(op, Branch | Switch | Count | Loop)
