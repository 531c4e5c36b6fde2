"""With transitions: a Machine whose trigger is the tick."""

from __future__ import annotations

from typing import Any

from transitions import Machine

from tests.benchmark.chart_guards import Contact
from tests.benchmark.chart_runs import Run


def prepared(fed: list[tuple[float, float]]) -> Run:
    """Return what makes the chart and feeds it tick by tick."""

    def run() -> int:
        contact: Any = Contact()
        machine = Machine(contact, ["gap", "drive", "coast"], initial="gap", auto_transitions=False)
        for source, target, guard in (
            ("gap", "drive", "is_driven"),
            ("gap", "coast", "is_coasted"),
            ("drive", "gap", "pulls_back"),
            ("coast", "gap", "pushes"),
        ):
            machine.add_transition("tick", source, target, conditions=guard, after="switch")
        for contact.theta, contact.torque in fed:
            contact.tick()
        return int(contact.fired)

    return run
