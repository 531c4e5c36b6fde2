"""With sismic: a statechart whose event is the tick."""

from __future__ import annotations

from sismic.interpreter import Interpreter
from sismic.io import import_from_yaml

from tests.benchmark.chart_guards import Contact
from tests.benchmark.chart_runs import Run

CHART = """\
statechart:
  name: mode_switch
  root state:
    name: root
    initial: gap
    states:
      - name: gap
        transitions:
          - {target: drive, event: tick, guard: c.is_driven(), action: c.switch(), priority: 1}
          - {target: coast, event: tick, guard: c.is_coasted(), action: c.switch()}
      - name: drive
        transitions: [{target: gap, event: tick, guard: c.pulls_back(), action: c.switch()}]
      - name: coast
        transitions: [{target: gap, event: tick, guard: c.pushes(), action: c.switch()}]
"""


def prepared(fed: list[tuple[float, float]]) -> Run:
    """Return what makes the chart and feeds it tick by tick."""
    chart = import_from_yaml(CHART)

    def run() -> int:
        contact = Contact()
        interpreter = Interpreter(chart, initial_context={"c": contact})
        interpreter.execute()
        for contact.theta, contact.torque in fed:
            interpreter.queue("tick")
            interpreter.execute()
        return contact.fired

    return run
