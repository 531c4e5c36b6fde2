"""Examine: what is not wrong but hardly meant - warnings of a checked automaton.

It runs where a spec is checked, not where it is only used: what has errors never gets here.
"""

from __future__ import annotations

from language.check_cycle import check_cycles
from language.check_end import check_ends
from language.check_endless import check_endless
from language.check_past import check_past
from language.check_reached import check_behind
from language.check_transition import check_stuck, check_transitions, check_waits
from language.check_zeno import check_zeno
from language.inquiry import Inquiry
from language.model import Automaton
from language.problem import Problems


def examine(automaton: Automaton, problems: Problems) -> None:
    """Warn of what never fires or is never left, and of modes that change for ever."""
    inquiry = Inquiry(automaton)
    silent = check_transitions(automaton, inquiry, problems)
    check_behind(automaton, silent, problems)
    check_stuck(automaton, silent, problems)
    check_ends(automaton, problems)
    check_waits(automaton, inquiry, problems)
    check_cycles(automaton, problems)
    check_endless(automaton, inquiry, problems)
    check_zeno(automaton, inquiry, problems)
    check_past(automaton, inquiry, problems)
