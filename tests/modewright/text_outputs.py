"""Printers: everything that prints a text of a user's spec or a file's name, by one name each.

A new printer joins the list with a function from the text to what is printed, and the characters
of the language that it prints in are checked by `test_printers.py`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping

import numpy as np

from codegen.emit.c_comment import sanitise_comment
from engine.results.plot import Panel, PlotLine, draw_picture
from engine.results.trajectory import Trajectory
from language.overlays.expand_document import parse_document
from language.text.diagnostic import Problem, Source, Span, render_problem
from modewright.api.spec_check import problem_json
from modewright.diagram.diagram import diagram_of

HOSTILE: Mapping[str, str] = {
    "end of comment": "*/ int evil = 1; /* // /*/ */*/",
    "trigraph": "what ??/",
    "backslash": "ends in \\",
    "quotes": "\"double\" 'single' `tick`",
    "lines": "one\ntwo\r\nthree\x85four\u2028five\x0b",
    "html": "<script>alert('x')</script> & &lt;",
    "direction": "\u202egnp.exe\u2066 \u200b",
    "nul": "before\0after \x1b[31m",
    "surrogate": "\ud800 \udcff",
    "long": "x" * 100_000,
    "markup": "[bold red]a[/] [/nothing]",
    "mathematics": "$x_{ \\frac",
    "arrows": "a --> b : c; %% #35; style a fill:#f00",
    "format": "%s {0} {{ jinja }} {% raw %}",
}


def c_comment(text: str) -> str:
    return f"/* {sanitise_comment(text)} */"


def problem(text: str) -> str:
    source = Source(text[:200], (f"about: {text}",))
    return render_problem(
        Problem("form", Span(source, 1, 8, 5), f"`{text}` is wrong", f"not `{text}`")
    )


def as_json(text: str) -> str:
    return json.dumps(problem_json(Problem("form", Span(Source(text), 1, 1), text, text)))


def _diagram(text: str) -> str:
    quoted = json.dumps(text.encode("utf-8", "replace").decode())
    return f"""language: 1
automaton: drawn
about: {quoted}
initial: a
modes:
  a: {{about: {quoted}, transitions: {{b: {{when: {quoted}}}}}}}
  b: {{}}
"""


def mermaid(text: str) -> str:
    spec = _diagram(text)
    return diagram_of(parse_document(Source("drawn", tuple(spec.split("\n"))), spec)).mermaid()


def svg(text: str) -> str:
    spec = _diagram(text)
    return diagram_of(parse_document(Source("drawn", tuple(spec.split("\n"))), spec)).svg()


def title_of_a_plot(text: str) -> str:
    times = np.linspace(0.0, 1.0, 5)
    run = Trajectory("run", times, {"a.x": times}, {"a.x": "m"}, {}, ())
    panel = Panel(text[:20], [PlotLine("a.x", "x")])
    return draw_picture([run], [panel], [], text[:200]).data("svg").decode()


PRINTERS: Mapping[str, Callable[[str], str]] = {
    "C comment": c_comment,
    "problem": problem,
    "JSON": as_json,
    "Mermaid": mermaid,
    "SVG": svg,
    "plot": title_of_a_plot,
}
