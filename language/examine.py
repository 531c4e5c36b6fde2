"""Examine: what is not wrong but hardly meant - warnings of a checked automaton.

It runs where a spec is checked, not where it is only used: what has errors never gets here.
"""

from __future__ import annotations

from language.check_cycle import check_cycles
from language.check_end import check_final_modes
from language.check_endless import check_chart_cycles
from language.check_past import check_range_violations
from language.check_reached import check_blocked_modes
from language.check_transition import check_close_waits, check_dead_transitions, check_stuck_modes
from language.check_zeno import check_zeno
from language.inquiry import QueryEngine
from language.model import Automaton
from language.problem import Problems


def check_warnings(automaton: Automaton, problems: Problems) -> None:
    """Warn of what never fires or is never left, and of modes that change for ever."""
    query_engine = QueryEngine(automaton)
    dead_transitions = check_dead_transitions(automaton, query_engine, problems)
    check_blocked_modes(automaton, dead_transitions, problems)
    check_stuck_modes(automaton, dead_transitions, problems)
    check_final_modes(automaton, problems)
    check_close_waits(automaton, query_engine, problems)
    check_cycles(automaton, problems)
    check_chart_cycles(automaton, query_engine, problems)
    check_zeno(automaton, query_engine, problems)
    check_range_violations(automaton, query_engine, problems)
