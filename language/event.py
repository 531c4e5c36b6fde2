"""Event: those of a chart - as inputs, in the queue of a macro-step, and in guards.

A tick puts the events whose input is true into the queue, in the order in which they are declared;
a transition that `raise`s one appends it. A micro-step has one event or none: the first one that
of the queue's head; after that transitions without an event go on until none is enabled, then the
next event is taken. What no transition takes is lost (rule 15c; SCXML: run to completion).
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from language.chart import Chart
from language.declaration import Input
from language.document import Node, Table
from language.limit import MICRO_STEP_LIMIT
from language.model import Transition
from language.operation import (
    Assign,
    Binary,
    Block,
    Branch,
    Compare,
    Expr,
    FaultBit,
    Item,
    Op,
    Ref,
    Store,
    add,
    whole,
)
from language.program import Variable
from language.units import NO_UNIT

QUEUE = "work.queue"
HEAD = Ref("work.head")
TAIL = Ref("work.tail")
EVENT = Ref("work.event")
WAITING = Compare("<", HEAD, TAIL)
"""Whether an event waits in the queue."""


def event_inputs(chart: Chart, section: Node | None) -> dict[str, Input]:
    """Return the events that come from outside as inputs: there in a tick where they are true."""
    found = {}
    for signal in chart.signals.values():
        if signal.is_input and isinstance(section, Table):
            entry = section.entries[signal.name]
            key = f"events.{signal.name}"
            place = (signal.name, NO_UNIT, "bool", Fraction(0), None, key, entry.span)
            found[signal.name] = Input(*place, about="event")  # type: ignore[arg-type]
    return found


def capacity(chart: Chart, transitions: Iterable[Transition]) -> int:
    """Return how many events the queue of a tick holds: more could not be taken anyway."""
    raised = any(way.raises for way in transitions)
    inputs = sum(signal.is_input for signal in chart.signals.values())
    return inputs + (chart.micro_steps if raised else 0)


def arrived(chart: Chart) -> Block:
    """Return what puts the events of a tick into the queue, and takes the first."""
    ops: list[Op] = [Assign(HEAD.name, whole(0)), Assign(TAIL.name, whole(0))]
    for signal in chart.signals.values():
        if signal.is_input:
            ops.append(Branch(Ref(f"input.{signal.name}"), _queued(signal.number)))
    return (*ops, Assign(EVENT.name, whole(0)), Branch(WAITING, taken()))


def put(chart: Chart, name: str, size: int) -> Block:
    """Return what appends an event to the queue; where that is full it is lost, with a fault."""
    fits = Compare("<", TAIL, whole(size))
    return (Branch(fits, _queued(chart.signals[name].number), (FaultBit(MICRO_STEP_LIMIT),)),)


def _queued(number: int) -> Block:
    return (Store(QUEUE, TAIL, whole(number)), Assign(TAIL.name, add(TAIL, whole(1))))


def taken() -> Block:
    """Return what takes the first event of the queue."""
    return (
        Assign(EVENT.name, Item(QUEUE, HEAD, True)),
        Assign(HEAD.name, add(HEAD, whole(1))),
    )


def happens(chart: Chart, transition: Transition) -> Expr | None:
    """Return whether the event of this micro-step is one of a transition's; None if it has none."""
    found: Expr | None = None
    for name in transition.events:
        here = Compare("==", EVENT, whole(chart.signals[name].number))
        found = here if found is None else Binary("or", found, here)
    return found


def event_variables(size: int) -> list[Variable]:
    """Return the queue of a tick."""
    found = [
        Variable(HEAD.name, "whole", about="place in the queue of the event that is heard next"),
        Variable(TAIL.name, "whole", about="place in the queue of the event that is raised next"),
        Variable(EVENT.name, "whole", about="event that is heard in this micro-step, 0: none"),
    ]
    return [*found, Variable(QUEUE, "whole", size=max(size, 1), about="events that wait")]
