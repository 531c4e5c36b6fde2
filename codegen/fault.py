"""Fault: why a bit of the fault word is set, as the comment beside it says (rule C16)."""

from __future__ import annotations

from language.ir.ops import FaultBit
from language.ir.program import Program
from language.ir.traversal import walk_ops
from language.lowering.calibration_stamp import STALE_CALIBRATION
from language.model.declaration import MICRO_STEP_LIMIT_FAULT
from language.observers.covariance_update import COVARIANCE_RANGE
from language.programs.major_step import LIVELOCK, ZENO
from language.programs.model_run import EVENT_LIMIT
from language.programs.rewind import REWIND_LIMIT

FAULT_REASONS = {
    COVARIANCE_RANGE: "a variance was outside its range",
    EVENT_LIMIT: "more transitions in a tick than `events`: the rest is dropped",
    LIVELOCK: "transitions at an instant did not end: no more are taken",
    MICRO_STEP_LIMIT_FAULT: "transitions of a tick did not end: no more are taken",
    REWIND_LIMIT: "a rewind would go back further than ticks are kept",
    STALE_CALIBRATION: "solved numbers belong to another calibration",
    ZENO: "more transitions than a step may have: its rest is dropped",
}
RANGE_REASON = "{} was outside its range"


def fault_reason(program: Program, fault: str) -> str:
    """Return why a fault bit is set; nothing where only the spec knows."""
    if fault in FAULT_REASONS:
        return FAULT_REASONS[fault]
    ops = (op for block in program.blocks.values() for op in walk_ops(block))
    set_by = (
        op.signal for op in ops if isinstance(op, FaultBit) and op.fault == fault and op.value
    )
    names = dict.fromkeys(name for name in set_by if name)
    return RANGE_REASON.format(" or ".join(names)) if names else ""
