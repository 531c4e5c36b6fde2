"""Invariants: assertions about modes that the engine checks and C leaves out (rule 11b).

The block `invariants` sets `check.<mode>_<name>` for each invariant of the active modes. No other
block reads these variables.
"""

from __future__ import annotations

from language.ir.ops import Assign, Block, Switch
from language.ir.program import InvariantInfo, Variable, mode_variable
from language.lowering.expressions import NameBindings, equation_bindings, lower_expression
from language.model.automaton import Automaton

INVARIANTS = "invariants"
"""The name of the block; generated C does not contain it."""
INVARIANT_PREFIX = "check."


def invariant_infos(automaton: Automaton) -> tuple[InvariantInfo, ...]:
    """Return the invariants of all modes, in the order of the file.

    The variable of each is `check.<mode>_<name>`, where the label of the mode contains its region.
    """
    return tuple(
        InvariantInfo(
            name,
            mode.number,
            mode.region,
            f"{INVARIANT_PREFIX}{mode.label}_{name}",
            invariant.message,
        )
        for mode in automaton.all_modes
        for name, invariant in mode.invariants.items()
    )


def invariant_variables(automaton: Automaton) -> list[Variable]:
    """Return the variable `check.<mode>_<name>` of the truth value of each invariant."""
    return [
        Variable(info.variable, "truth", about=info.name) for info in invariant_infos(automaton)
    ]


def invariant_blocks(automaton: Automaton, known: NameBindings) -> dict[str, Block]:
    """Return the block `invariants`, which evaluates those of the active modes, by its name.

    The dict is empty without any. Equations are read as `equation.<name>`, other names as in
    `known`. Invariants of inactive modes keep their value.
    """
    if not invariant_infos(automaton):
        return {}
    here = {**known, **equation_bindings(automaton, "equation.")}
    switches: list[Switch] = []
    for region in automaton.all_regions:
        cases: list[tuple[int, Block]] = []
        for mode in region.modes.values():
            ops = tuple(
                Assign(
                    f"{INVARIANT_PREFIX}{mode.label}_{name}",
                    lower_expression(invariant.condition.tree, here),
                    f"{automaton.name} {invariant.condition.key}",
                )
                for name, invariant in mode.invariants.items()
            )
            if ops:
                cases.append((mode.number, ops))
        if cases:
            switches.append(Switch(mode_variable("memory.mode", region.name), tuple(cases)))
    return {INVARIANTS: tuple(switches)}
