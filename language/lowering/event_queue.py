"""Event: those of a chart - as inputs, in the queue of a macro-step, and in guards.

A tick puts the events whose input is true into the queue, in the order in which they are declared;
a transition that `raise`s one appends it. A micro-step has one event or none: the first one that
of the queue's head; after that transitions without an event go on until none is enabled, then the
next event is taken. What no transition takes is lost (rule 15c; SCXML: run to completion).
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from language.expressions.units import NO_UNIT
from language.ir.ops import (
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
    integer,
)
from language.ir.program import Variable
from language.model.automaton import Transition
from language.model.declaration import MICRO_STEP_LIMIT_FAULT, Input
from language.model.statechart import Chart
from language.text.document import MappingNode, YamlNode

QUEUE = "work.queue"
QUEUE_HEAD = Ref("work.head")
QUEUE_TAIL = Ref("work.tail")
CURRENT_EVENT = Ref("work.event")
HAS_WAITING_EVENT = Compare("<", QUEUE_HEAD, QUEUE_TAIL)
"""Whether an event waits in the queue."""


def event_inputs(chart: Chart, section: YamlNode | None) -> dict[str, Input]:
    """Return the events that come from outside as inputs: there in a tick where they are true."""
    found = {}
    for signal in chart.events.values():
        if signal.is_input and isinstance(section, MappingNode):
            entry = section.entries[signal.name]
            key = f"events.{signal.name}"
            place = (signal.name, NO_UNIT, "bool", Fraction(0), None, key, entry.span)
            found[signal.name] = Input(*place, about="event")  # type: ignore[arg-type]
    return found


def queue_capacity(chart: Chart, transitions: Iterable[Transition]) -> int:
    """Return how many events the queue of a tick holds: more could not be taken anyway."""
    raised = any(way.raises for way in transitions)
    inputs = sum(signal.is_input for signal in chart.events.values())
    return inputs + (chart.micro_steps if raised else 0)


def enqueue_input_events(chart: Chart) -> Block:
    """Return what puts the events of a tick into the queue, and takes the first."""
    ops: list[Op] = [Assign(QUEUE_HEAD.name, integer(0)), Assign(QUEUE_TAIL.name, integer(0))]
    for signal in chart.events.values():
        if signal.is_input:
            ops.append(Branch(Ref(f"input.{signal.name}"), _append_event(signal.number)))
    return (
        *ops,
        Assign(CURRENT_EVENT.name, integer(0)),
        Branch(HAS_WAITING_EVENT, dequeue_event()),
    )


def enqueue_event(chart: Chart, name: str, capacity: int) -> Block:
    """Return what appends an event to the queue; where that is full it is lost, with a fault."""
    fits = Compare("<", QUEUE_TAIL, integer(capacity))
    return (
        Branch(fits, _append_event(chart.events[name].number), (FaultBit(MICRO_STEP_LIMIT_FAULT),)),
    )


def _append_event(number: int) -> Block:
    return (
        Store(QUEUE, QUEUE_TAIL, integer(number)),
        Assign(QUEUE_TAIL.name, add(QUEUE_TAIL, integer(1))),
    )


def dequeue_event() -> Block:
    """Return what takes the first event of the queue."""
    return (
        Assign(CURRENT_EVENT.name, Item(QUEUE, QUEUE_HEAD, True)),
        Assign(QUEUE_HEAD.name, add(QUEUE_HEAD, integer(1))),
    )


def event_condition(chart: Chart, transition: Transition) -> Expr | None:
    """Return whether the event of this micro-step is one of a transition's; None if it has none."""
    found: Expr | None = None
    for name in transition.events:
        here = Compare("==", CURRENT_EVENT, integer(chart.events[name].number))
        found = here if found is None else Binary("or", found, here)
    return found


def event_queue_variables(capacity: int) -> list[Variable]:
    """Return the queue of a tick."""
    found = [
        Variable(
            QUEUE_HEAD.name, "whole", about="place in the queue of the event that is heard next"
        ),
        Variable(
            QUEUE_TAIL.name, "whole", about="place in the queue of the event that is raised next"
        ),
        Variable(
            CURRENT_EVENT.name, "whole", about="event that is heard in this micro-step, 0: none"
        ),
    ]
    return [*found, Variable(QUEUE, "whole", size=max(capacity, 1), about="events that wait")]
