"""An automaton that waits for as long as its page says."""

from __future__ import annotations

TEXT = """language: 1
automaton: {name}
period: {period}
numbers: {numbers}
parameters: {{t_on: {{value: {value}, tunable: true, range: {limits}}}}}
inputs: {{u: {{range: [0, 1]}}}}
initial: low
modes: {{low: {{transitions: {{high: {{when: u > 0.5, wait: t_on}}}}}}, high: {{}}}}
outputs: [mode]
"""


def waiting_automaton(name: str, period: str, numbers: str, value: str, limits: str) -> str:
    """Return its text; `value` and `limits` are those of the wait `t_on`."""
    return TEXT.format(name=name, period=period, numbers=numbers, value=value, limits=limits)
