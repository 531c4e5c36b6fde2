"""With python-statemachine: a StateChart whose event is the tick."""

from __future__ import annotations

from statemachine import State, StateMachine

from tests.benchmark.chart_guards import Contact
from tests.benchmark.chart_runs import Run


class Chart(StateMachine):
    """The three modes; guards and actions are those of the model."""

    allow_event_without_transition = True
    gap = State(initial=True)
    drive = State()
    coast = State()
    tick = (
        gap.to(drive, cond="is_driven", on="switch")
        | gap.to(coast, cond="is_coasted", on="switch")
        | drive.to(gap, cond="pulls_back", on="switch")
        | coast.to(gap, cond="pushes", on="switch")
    )


def prepared(fed: list[tuple[float, float]]) -> Run:
    """Return what makes the chart and feeds it tick by tick."""

    def run() -> int:
        contact = Contact()
        chart = Chart(contact)
        for contact.theta, contact.torque in fed:
            chart.tick()
        return contact.fired

    return run
