"""Recording map text: a proposed map as the YAML of a map, with the reasons as comments."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence

from diagnosis.data_quality.column_score import ModelSignal, ProposedColumn
from diagnosis.data_quality.file_columns import FileColumn
from diagnosis.data_quality.recording_map_proposal import MapProposal
from diagnosis.data_quality.signal_words import split_words
from language.expressions.name_rules import NAME_PATTERN
from language.expressions.units import Unit
from language.model.system import CanDatabase
from language.text.sanitise import escape_invisible

PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_/*^.-]*")
"""Pattern of a text that YAML reads as a text without quotes; the words in NO_TEXT do not count."""
NO_TEXT = ("true", "false", "null", "yes", "no", "on", "off", "y", "n")
"""Words, in lower case, that some readers of YAML read as another value."""
MAX_LISTED = 40
"""Number of unused columns that a comment lists."""


def format_map(
    name: str,
    about: str,
    time: tuple[str, Unit],
    proposal: MapProposal,
    databases: Sequence[CanDatabase] = (),
) -> str:
    """Return a proposed map as YAML text.

    `time` is the time column, empty if the file needs none, and its unit. Comments give the reason
    of each line, what a person has to state, the signals without a column and the unused columns.
    """
    lines = ["language: 1", f"map: {_scalar(name)}", f"about: {_quoted(about)}"]
    if time[0]:
        lines.append(f"time: {{column: {_scalar(time[0])}, unit: {time[1].text}}}")
    if databases:
        lines.append(f"dbc: {_format_databases(databases)}")
    lines.append("columns:" if proposal.columns else "columns: {}")
    for line in proposal.columns:
        if line.is_open:
            lines.append(f"  # check the unit{' and the scale' if line.scale else ''} of this line")
        if line.reasons:
            lines.append(f"  # {escape_invisible('; '.join(line.reasons))}")
        lines.append(f"  {_key(line.column)}: {_format_column(line)}")
    lines += [f"# {text}" for text in _remarks(proposal)]
    return "\n".join(lines) + "\n"


def _format_databases(databases: Sequence[CanDatabase]) -> str:
    """Return databases as a list, or as a mapping from buses to lists if one names a bus."""
    by_bus: dict[str, list[str]] = {}
    for one in databases:
        by_bus.setdefault(one.bus, []).append(_quoted(one.file.text))
    lists = {bus: f"[{', '.join(files)}]" for bus, files in by_bus.items()}
    if set(lists) == {""}:
        return lists[""]
    return f"{{{', '.join(f'{_quoted(bus)}: {files}' for bus, files in lists.items())}}}"


def map_name(stem: str) -> str:
    """Return a name of a map from the name of a file without its ending."""
    text = "_".join(re.findall(r"[A-Za-z0-9]+", stem)).lower()
    text = text if text[:1].isalpha() else f"recording_{text}".rstrip("_")
    return text if NAME_PATTERN.fullmatch(text) else "recording_columns"


def _format_column(line: ProposedColumn) -> str:
    """Return the mapping of a column in one line of YAML."""
    column, signal = line.column, line.signal
    items = []
    if len(column.names) > 1:
        items.append(f"mean: [{', '.join(map(_scalar, column.names))}]")
    items.append(f"{'to' if signal.is_input else 'compare'}: {_scalar(signal.name)}")
    items.append(f"unit: {_scalar(line.unit)}")
    if line.scale:
        items.append(f"scale: {line.scale}")
    if line.hold:
        items.append(f"hold: {line.hold}")
    if column.time:
        items.append(f"time: {_scalar(column.time)}")
    if column.has_blanks:
        items.append("blank: skip")
    return f"{{{', '.join(items)}}}"


def _key(column: FileColumn) -> str:
    """Return the key of a column: its name, or for a mean the words that the names share."""
    if len(column.names) == 1:
        return _scalar(column.names[0])
    shared = [
        word
        for word in split_words(column.names[0])
        if all(word in split_words(name) for name in column.names)
    ]
    return _scalar("_".join(shared[:-1] or shared or ["mean"]) + "_mean")


def _remarks(proposal: MapProposal) -> list[str]:
    """Return comments on the signals without a column and on the unused columns."""
    remarks = []
    for signal in proposal.missing_inputs:
        rest = "its default value is used"
        if not signal.has_default:
            rest = f"a line of `columns` or `constants: {{{signal.name}: ...}}` has to state it"
        remarks.append(f"input {_describe(signal)} has no column: {rest}")
    for signal in proposal.missing_outputs:
        remarks.append(f"output {_describe(signal)} is not compared with a column")
    unused = [escape_invisible(name) for name in proposal.unused_columns]
    if unused:
        more = f" and {len(unused) - MAX_LISTED} more" if len(unused) > MAX_LISTED else ""
        remarks.append(f"not used: {', '.join(unused[:MAX_LISTED])}{more}")
    return remarks


def _describe(signal: ModelSignal) -> str:
    """Return the name of a signal with its unit."""
    return f"`{signal.name}` [{signal.unit}]"


def _scalar(text: str) -> str:
    """Return a text as a scalar of YAML, in quotes where it needs them."""
    if text == "1" or (PLAIN.fullmatch(text) and text.lower() not in NO_TEXT):
        return text
    return _quoted(text)


def _quoted(text: str) -> str:
    """Return a text in the double quotes of YAML."""
    return json.dumps(text)
