"""The checker of Programs: all properties that a Program has before and after each pass."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Literal

from language.ir.ops import Assign
from language.ir.program import Program
from language.ir.traversal import block_reads, names_used
from language.ircheck.check_assignment import check_assignment
from language.ircheck.check_declarations import check_declarations
from language.ircheck.check_operations import check_operations
from language.ircheck.violation import Violation, operation_place

Property = Literal["no-unread-results", "no-unused-parameters"]
"""A property that holds after the pass that establishes it, but not before."""


class InvalidProgram(Exception):
    """A Program violates rules of the intermediate representation: a fault of the product."""

    def __init__(self, stage: str, violations: tuple[Violation, ...]) -> None:
        self.stage = stage
        self.violations = violations
        lines = "".join(f"\n  {violation}" for violation in violations)
        super().__init__(f"the Program after `{stage}` is invalid:{lines}")


def check_program(program: Program, properties: Iterable[Property] = ()) -> tuple[Violation, ...]:
    """Return the violations of a Program, each once; empty for a valid one.

    `properties` are those that earlier passes have established. Paths are followed only if all
    names and blocks exist.
    """
    found = [*check_declarations(program), *check_operations(program)]
    if all(violation.rule != "reference" for violation in found):
        found += check_assignment(program)
    for one in properties:
        found += PROPERTY_CHECKS[one](program)
    return tuple(dict.fromkeys(found))


def require_valid(program: Program, stage: str, properties: Iterable[Property] = ()) -> None:
    """Raise InvalidProgram if a Program has violations; `stage` names the pass that made it."""
    violations = check_program(program, properties)
    if violations:
        raise InvalidProgram(stage, violations)


def _check_unread_results(program: Program) -> Iterator[Violation]:
    """Yield the assignments, outside of inner blocks, to work variables that nothing reads."""
    read = {name for block in program.blocks.values() for name in block_reads(block)}
    read |= {wire.source for wire in program.outputs}
    for name, block in program.blocks.items():
        for op in block:
            if isinstance(op, Assign) and op.target.startswith("work.") and op.target not in read:
                message = f"nothing reads `{op.target}`"
                yield Violation("dead-store", operation_place(name, op), message)


def _check_unused_parameters(program: Program) -> Iterator[Violation]:
    """Yield the fixed parameters that no block reads."""
    used = names_used(program.blocks.values())
    for constant in program.constants:
        if constant.name.startswith("constant.") and constant.name not in used:
            message = f"nothing reads `{constant.name}`"
            yield Violation("dead-store", "constants", message)


PROPERTY_CHECKS: Mapping[Property, Callable[[Program], Iterator[Violation]]] = {
    "no-unread-results": _check_unread_results,
    "no-unused-parameters": _check_unused_parameters,
}
