"""Events of a chart: inputs, the queue of a macro-step, and the events of transitions (rule 15c).

In a tick, the events whose input is true enter the queue in the order of their declaration. A
transition with `raise` appends an event. A micro-step has one event or none. After the micro-step
of an event, transitions without an event are taken until none is enabled; then the next event is
taken from the queue. An event that enables no transition is lost (SCXML: run to completion).
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
    Ref,
    Store,
    Value,
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
"""The condition that the queue is not empty."""


def event_inputs(chart: Chart, section: YamlNode | None) -> dict[str, Input]:
    """Return the input events of a chart as inputs of type bool with default 0, by name.

    `section` is the `events` section of the document, which gives their places; the result is empty
    if it is no mapping.
    """
    found = {}
    for signal in chart.events.values():
        if signal.is_input and isinstance(section, MappingNode):
            entry = section.entries[signal.name]
            key = f"events.{signal.name}"
            place = (signal.name, NO_UNIT, "bool", Fraction(0), None, key, entry.span)
            found[signal.name] = Input(*place, about="event")  # type: ignore[arg-type]
    return found


def queue_capacity(chart: Chart, transitions: Iterable[Transition]) -> int:
    """Return the number of places of the queue of a tick.

    It is the number of input events, plus the bound of micro-steps if one of the transitions raises
    an event: a tick cannot take more of them.
    """
    raised = any(transition.raises for transition in transitions)
    inputs = sum(signal.is_input for signal in chart.events.values())
    return inputs + (chart.micro_steps if raised else 0)


def enqueue_input_events(chart: Chart) -> Block:
    """Return the operations that fill the queue with a tick's input events and take the first.

    The queue is emptied before; events come in the order of their declaration. Without an event the
    current event is 0.
    """
    enqueue = [
        Branch(Ref(f"input.{signal.name}"), _append_event(signal.number))
        for signal in chart.events.values()
        if signal.is_input
    ]
    return (
        Assign(QUEUE_HEAD.name, integer(0)),
        Assign(QUEUE_TAIL.name, integer(0)),
        *enqueue,
        Assign(CURRENT_EVENT.name, integer(0)),
        *((Branch(HAS_WAITING_EVENT, dequeue_event()),) if enqueue else ()),
    )


def enqueue_event(chart: Chart, name: str, capacity: int) -> Block:
    """Return the operations that append an event; a full queue loses it and sets a fault bit.

    `capacity` is the number of places; the bit is MICRO_STEP_LIMIT_FAULT.
    """
    fits = Compare("<", QUEUE_TAIL, integer(capacity))
    return (
        Branch(fits, _append_event(chart.events[name].number), (FaultBit(MICRO_STEP_LIMIT_FAULT),)),
    )


def _append_event(number: int) -> Block:
    """Return the operations that append an event number to the queue without a test for room."""
    return (
        Store(QUEUE, QUEUE_TAIL, integer(number)),
        Assign(QUEUE_TAIL.name, add(QUEUE_TAIL, integer(1))),
    )


def dequeue_event() -> Block:
    """Return the operations that make the first event of the queue the current one.

    The queue must not be empty; this is not tested.
    """
    return (
        Assign(CURRENT_EVENT.name, Item(QUEUE, QUEUE_HEAD, True)),
        Assign(QUEUE_HEAD.name, add(QUEUE_HEAD, integer(1))),
    )


def event_condition(chart: Chart, transition: Transition, capacity: int) -> Expr | None:
    """Return the condition that the current event is one of a transition's events.

    The result is None for a transition without events. If the queue has no places, no event occurs.
    """
    found: Expr | None = None
    for name in transition.events:
        is_current = Compare("==", CURRENT_EVENT, integer(chart.events[name].number))
        here = is_current if capacity else Value(False)
        found = here if found is None else Binary("or", found, here)
    return found


def event_queue_variables(capacity: int) -> list[Variable]:
    """Return the variables of the queue and of the current event.

    They are `work.head`, `work.tail`, `work.event` and the array `work.queue` of `capacity` places,
    at least one.
    """
    found = [
        Variable(QUEUE_HEAD.name, "whole", about="place in the queue of the next event to process"),
        Variable(QUEUE_TAIL.name, "whole", about="place in the queue of the next event to raise"),
        Variable(CURRENT_EVENT.name, "whole", about="event of this micro-step, 0: none"),
    ]
    return [*found, Variable(QUEUE, "whole", size=max(capacity, 1), about="events that wait")]
