"""Report of the solved numbers of a Program: integration method, stability limits, observers."""

from __future__ import annotations

from collections.abc import Iterator

from language.integration.crossing_location import RUN_BISECTIONS
from language.ir.operation_count import max_operations
from language.ir.program import IntegrationInfo, ObserverInfo, Program

MATRIX_COLUMNS = {"Phi": "states", "Gamma": "inputs", "L": "measures"}
"""The matrices of an observer in the report, and the attribute that names their columns."""


def format_solved_numbers(program: Program) -> str:
    """Return the text of the report, which ends with a line feed.

    It begins with `program <name>` and gives the method, |A h|, stability limits, the bound of work
    of a run with events and of each rewind (all if the Program integrates), the longest tick in
    operations (sampled Programs), and the matrices Phi, Gamma and L of the observers.
    """
    lines = [f"program {program.name}"]
    if program.integration:
        lines += format_method_lines(program.integration)
        lines += _format_work_lines(program, program.integration)
        lines += _format_rewind_lines(program)
    if program.period is not None:
        most = max_operations(program.blocks, "step")
        what = "operations (arithmetic, comparisons, stores)"
        lines.append(f"longest tick: at most {most} {what}, every loop to its end")
    for observer in program.observers:
        lines += _format_observer_lines(program, observer)
    return "\n".join(lines) + "\n"


def format_method_lines(motion: IntegrationInfo) -> Iterator[str]:
    """Yield a line for the method, then one for |A h| and one for the stability limit of each mode.

    The first names method, step [s] and number of terms K. Modes without such a value have no line.
    """
    yield f"method {motion.method}, step {motion.step:.6g} s, K = {motion.series_terms}"
    for mode, norm in motion.norms.items():
        yield f"  mode {mode}: |A h| = {norm:.4g}, at most 4"
    for limit in motion.stability_limits:
        value = limit.eigenvalue
        turning = f" +- {abs(value.imag):.6g} i" if value.imag else ""
        yield (
            f"  mode {limit.mode}: largest stable step {limit.step:.6g} s, eigenvalue "
            f"{value.real:.6g}{turning} 1/s of `{limit.term}` in the rate of {limit.state}"
        )


def _format_work_lines(program: Program, motion: IntegrationInfo) -> Iterator[str]:
    """Yield the bound of work for the events of a run inside a tick; nothing without events.

    Each event takes a Taylor sum of K products by A, then bisections that evaluate K terms.
    """
    if program.period is None or not motion.max_events:
        return
    n = motion.state_count
    once = motion.series_terms * n * n + RUN_BISECTIONS * motion.series_terms * n
    yield (
        f"  work: at most {motion.max_events} events per substep, "
        f"{motion.max_events * once} products and "
        f"{motion.max_events * RUN_BISECTIONS} evaluations of the guards"
    )


def _format_rewind_lines(program: Program) -> Iterator[str]:
    """Yield the bound of work of each transition with `rewind` in its tick."""
    for info in program.transitions:
        if info.rewind_ticks:
            modes = f"{program.mode_name(info.source)} -> {program.mode_name(info.target)}"
            evaluations = info.rewind_ticks + RUN_BISECTIONS + 2
            yield (
                f"  rewind {modes}: at most {evaluations} evaluations of `until` and "
                f"{info.rewind_ticks} runs, one of them over a part of a period"
            )


def _format_observer_lines(program: Program, observer: ObserverInfo) -> Iterator[str]:
    """Yield the matrices of an observer, one line for each row; matrices of zeros are left out."""
    yield f"observer of mode {observer.mode}: gain {observer.gain}"
    values = {constant.name: constant.value for constant in program.constants}
    for letter, what in MATRIX_COLUMNS.items():
        columns = getattr(observer, what)
        rows = []
        for row in observer.states:
            names = [f"solved.{observer.mode}_{letter}.{row}.{column}" for column in columns]
            rows.append([values.get(name, 0.0) for name in names])
        if not columns or not any(any(row) for row in rows):
            continue
        yield f"  {letter} ({', '.join(observer.states)} by {', '.join(columns)})"
        for numbers in rows:
            yield "    " + " ".join(f"{number:>23.16g}" for number in numbers)
