"""Key trace output: show specs and C side by side with the relation of keys and lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from expectation.key_trace import KeyTrace, KeyTraces
from expectation.requirement_trace import CodeLine
from modewright.render.pluralisation import pluralise
from modewright.runtime.json_format import format_entry

STYLE = """body{font:13px/1.4 system-ui,sans-serif;margin:0;color:#222;height:100vh;display:flex;
flex-direction:column}header{padding:.6rem 1rem;border-bottom:1px solid #ccc}
main{display:flex;flex:1;min-height:0}section{flex:1;overflow:auto;border-right:1px solid #ccc}
h2{font-size:13px;margin:0;padding:.4rem 1rem;position:sticky;top:0;background:#eee}
pre{margin:0;font:12px/1.45 ui-monospace,monospace}pre div{padding:0 1rem;white-space:pre}
pre div::before{content:attr(data-n);display:inline-block;width:3.5em;color:#999}
.k{cursor:pointer}.k:hover{background:#eef4ff}.on{background:#ffe9a8!important}
.none{color:#8a5a00}@media(prefers-color-scheme:dark){body{background:#161616;color:#ddd}
h2{background:#262626}.k:hover{background:#223}.on{background:#5a4a10!important}}"""
SCRIPT = """const of=d=>(d.dataset.k||"").split(" ").filter(Boolean);
const all=[...document.querySelectorAll(".k")];
document.addEventListener("click",e=>{const d=e.target.closest(".k");if(!d)return;
const ks=new Set(of(d));all.forEach(o=>o.classList.toggle("on",of(o).some(k=>ks.has(k))));
document.querySelectorAll("section").forEach(s=>{if(s.contains(d))return;
const f=s.querySelector(".on");if(f)s.scrollTo({top:f.offsetTop-s.clientHeight/3,behavior:"smooth"})
})});"""


def key_traces_json(traces: KeyTraces) -> dict[str, Any]:
    """Return a key trace as a dict for JSON.

    `keys` has the lines of C of each key, `silent` the keys that no line cites, `strays` the
    citations of unknown keys.
    """
    return {
        **format_entry("key-trace"),
        "keys": [
            {
                "spec": key.spec,
                "path": key.path,
                "file": key.place.source.name,
                "line": key.place.line,
                "c": [{"file": file, "line": line} for file, line in key.code],
            }
            for key in traces.keys
        ],
        "silent": [f"{key.spec} {key.path}" for key in traces.uncited],
        "strays": list(traces.unmatched_citations),
    }


def key_traces_lines(traces: KeyTraces) -> list[str]:
    """Return one line `spec path: file 12, 15` for each key, and the summary as the last line.

    A key that the C does not cite has `no line of C`.
    """
    return [
        *(f"{key.spec} {key.path}: {_code_places(key)}" for key in traces.keys),
        key_traces_summary(traces),
    ]


def key_traces_summary(traces: KeyTraces) -> str:
    """Return the number of keys and of those that C cites, in one line.

    Citations of keys that no spec has are listed, if there are any.
    """
    shown = len(traces.keys) - len(traces.uncited)
    text = f"{pluralise(len(traces.keys), 'key')}, {shown} of them in lines of C"
    return text + (
        f"; C cites what no spec has: {', '.join(traces.unmatched_citations)}"
        if traces.unmatched_citations
        else ""
    )


def key_traces_html(
    traces: KeyTraces, specs: Mapping[str, str], code: Mapping[str, str], title: str
) -> str:
    """Return a self-contained page with specs and C side by side.

    A click on a line highlights the related lines. `specs` and `code` are texts by file. Keys that
    no line of C cites are brown.
    """
    numbers = {(key.spec, key.path): f"k{n}" for n, key in enumerate(traces.keys)}
    marks: dict[CodeLine, list[str]] = {}
    for key in traces.keys:
        number = numbers[key.spec, key.path]
        for place in ((key.place.source.name, key.place.line), *key.code):
            marks.setdefault(place, []).append(number)
    silent = {(key.place.source.name, key.place.line) for key in traces.uncited}
    left = "".join(_file_section(name, text, marks, silent) for name, text in specs.items())
    right = "".join(_file_section(name, text, marks, set()) for name, text in code.items())
    return (
        f"<!doctype html><meta charset=utf-8><title>{escape(title)}</title><style>{STYLE}</style>\n"
        f"<header><b>{escape(title)}</b>: {escape(key_traces_summary(traces))}. "
        "Click a line to highlight the related lines. No line of C cites the keys in brown: "
        f"their values are folded into other numbers.</header>\n<main><section>{left}</section>"
        f"<section>{right}</section></main><script>{SCRIPT}</script>\n"
    )


def _file_section(
    name: str,
    text: str,
    marks: Mapping[tuple[str, int], Sequence[str]],
    silent: set[tuple[str, int]],
) -> str:
    """Return the HTML of a file with the keys of each line."""
    lines = []
    for number, line in enumerate(text.splitlines(), start=1):
        keys = marks.get((name, number), ())
        kind = f' class="k{" none" if (name, number) in silent else ""}"' if keys else ""
        of = f' data-k="{" ".join(keys)}"' if keys else ""
        lines.append(f"<div{kind}{of} data-n={number}>{escape(line) or ' '}</div>")
    return f"<h2>{escape(name)}</h2><pre>{''.join(lines)}</pre>\n"


def _code_places(key: KeyTrace) -> str:
    """Return the lines of C that cite a key, by file."""
    by_file: dict[str, list[str]] = {}
    for file, line in key.code:
        by_file.setdefault(file, []).append(str(line))
    return "; ".join(f"{file} {', '.join(n)}" for file, n in by_file.items()) or "no line of C"
