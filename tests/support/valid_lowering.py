"""Validity: every Program that a test lowers goes through the checker of Programs."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec

from language.ir.program import Program
from language.ircheck.check_program import require_valid
from language.passes.program_pass import LOWERED_PROPERTIES

Given = ParamSpec("Given")


def require_valid_result(lower: Callable[Given, Program]) -> Callable[Given, Program]:
    """Return a function that lowers, and raises InvalidProgram for a Program with violations."""

    @wraps(lower)
    def lowered(*given: Given.args, **named: Given.kwargs) -> Program:
        program = lower(*given, **named)
        require_valid(program, lower.__name__, LOWERED_PROPERTIES)
        return program

    return lowered
