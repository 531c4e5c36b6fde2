"""modewright: hybrid automata in YAML, interpreted, printed as C, kept in lock-step.

What is named here is loaded when it is first used: `import modewright` itself takes no time.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from engine.trajectory import Event, Trajectory
    from language.problem import Problem, SpecError, render_all
    from lockstep.compare import Verdict
    from modewright.api import Loaded, Replayed, check, generate, load, lockstep, replay, simulate

__all__ = [
    "Event",
    "Loaded",
    "Problem",
    "Replayed",
    "SpecError",
    "Trajectory",
    "Verdict",
    "check",
    "generate",
    "load",
    "lockstep",
    "render_all",
    "replay",
    "simulate",
]

PLACES = {
    "Event": "engine.trajectory",
    "Problem": "language.problem",
    "SpecError": "language.problem",
    "Trajectory": "engine.trajectory",
    "Verdict": "lockstep.compare",
    "render_all": "language.problem",
}
"""Where a name of the public API is defined, if not in `modewright.api`."""


def __getattr__(name: str) -> Any:
    """Load a name of the public API."""
    if name not in __all__:
        raise AttributeError(f"module `modewright` has no `{name}`")
    value = getattr(import_module(PLACES.get(name, "modewright.api")), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
