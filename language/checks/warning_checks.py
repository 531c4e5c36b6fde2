"""Warning checks: reports constructs that are valid and probably not intended.

They are computed by `check` and not when a spec is only loaded. An automaton with errors has no
warnings.
"""

from __future__ import annotations

from language.checks.check_chart_cycles import check_chart_cycles
from language.checks.check_dead_transitions import (
    check_close_waits,
    check_dead_transitions,
    check_stuck_modes,
)
from language.checks.check_instant_cycles import check_long_cycles
from language.checks.check_range_violation import check_range_violations
from language.checks.check_reachability import check_blocked_modes, check_final_modes
from language.checks.check_temperatures import check_temperatures
from language.checks.check_zeno import check_zeno
from language.model.automaton import Automaton
from language.smt.query_engine import QueryEngine
from language.text.diagnostic import Problems


def check_warnings(automaton: Automaton, problems: Problems) -> None:
    """Report the warnings of a checked automaton.

    They are dead transitions, blocked and stuck modes, final modes without effect, close waits,
    cycles, Zeno behaviour, assignments past a range and sums of temperatures in degC. Unused names
    and unreachable modes are reported by `check_automaton`. The model is not examined.
    """
    query_engine = QueryEngine(automaton)
    dead_transitions = check_dead_transitions(automaton, query_engine, problems)
    check_blocked_modes(automaton, dead_transitions, problems)
    check_stuck_modes(automaton, dead_transitions, problems)
    check_final_modes(automaton, problems)
    check_close_waits(automaton, query_engine, problems)
    check_long_cycles(automaton, problems)
    check_chart_cycles(automaton, query_engine, problems)
    check_zeno(automaton, query_engine, problems)
    check_range_violations(automaton, query_engine, problems)
    check_temperatures(automaton, problems)
