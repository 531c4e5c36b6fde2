"""modewright: hybrid automata in YAML, interpreted, printed as C, kept in lock-step."""

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
