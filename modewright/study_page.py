"""Study page: the results of a study as one HTML page that needs no other file."""

from __future__ import annotations

import html
import itertools
import re
from collections.abc import Mapping, Sequence
from importlib import metadata, resources
from typing import Any

import jinja2
import numpy as np

from language.units import shown_unit
from modewright.show_sensitivity import WHOLE, ordered_indices, untold_texts
from modewright.show_study import failure_texts, interval_text, short
from sweep.block import DONE
from sweep.manifest import Design, Manifest
from sweep.measure import Column
from sweep.picture import pictures
from sweep.rows_file import arrow_module
from sweep.sensitivity import sensitivity_of
from sweep.store import Store
from sweep.summary import Summary, shown, summary_of
from sweep.table import Table

MOST_EXTREME, MOST_FAILED, MOST_INDICES = 5, 100, 300
"""Rows of each table that grows with the study."""
PLAIN = Column("", "real", "1")
"""A number whose unit stands elsewhere."""
HEAD = re.compile(r"^.*?<svg ", re.DOTALL)
METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
OWN_NAME = re.compile(r"(\bid=\"|\"#|url\(#)")


def report_page(store: Store) -> bytes:
    """Return the page of what a store holds so far. Raises SpecError, ToolMissing."""
    table = Table(store)
    summary, manifest = summary_of(store), store.manifest
    context = {
        "name": manifest.study,
        "there": sum(summary.counts.values()),
        "expected": manifest.count,
        "counts": list(summary.counts.items()),
        "varied": [column.name for column in manifest.varied],
        "told": _told(manifest),
        **_measures(summary),
        **_sensitivity(store),
        "figures": [
            (name, _embedded(name, picture.data("svg")))
            for name, picture in pictures(store).items()
        ],
        "extremes": _extremes(table),
        "reasons": failure_texts(summary),
        **_failed(table),
        "version": metadata.version("modewright"),
        "digest": manifest.digest,
        "identity": sorted(manifest.identity.items()),
    }
    return _page(context).encode()


def _told(manifest: Manifest) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return what the study is, as its file says: sections, each with texts by name."""
    found = []
    for key, said in manifest.description.items():
        rows = [("", said)] if isinstance(said, str) else list(said.items())
        found.append((key, rows))
    drawn = manifest.design
    if drawn.count:
        found.append(("sampling", [(drawn.method, _drawn_text(drawn)), ("seed", str(drawn.seed))]))
    if drawn.replicates > 1:
        found.append(("replicates", [("", str(drawn.replicates))]))
    return found


def _drawn_text(drawn: Design) -> str:
    if not drawn.has_indices:
        return f"{drawn.count} points"
    return f"{drawn.planned} {WHOLE[drawn.method]} of {drawn.each} points"


def _measures(summary: Summary) -> dict[str, Any]:
    lines = [
        {
            "group": list(line.group.values()), "measure": line.measure,
            "unit": shown_unit(line.unit),
            "cells": [
                line.count, line.draws, short(line.median), interval_text(line.median_interval),
                short(line.mean), interval_text(line.mean_interval),
                *map(short, (line.deviation, line.p95, line.low, line.high)),
            ],
        }
        for line in summary.lines
    ]  # fmt: skip
    rates = [
        {
            "group": list(rate.group.values()), "measure": rate.measure,
            "cells": [
                rate.hits, rate.count, rate.draws, short(rate.share),
                interval_text(rate.interval),
            ],
        }
        for rate in summary.rates
    ]  # fmt: skip
    groups = list(summary.lines[0].group) if summary.lines else []
    return {
        "groups": groups, "lines": lines, "rates": rates, "sure": f"{summary.confidence * 100:g} %",
    }  # fmt: skip


def _sensitivity(store: Store) -> dict[str, Any]:
    sensitivity = sensitivity_of(store) if store.manifest.design.has_indices else None
    if sensitivity is None or not sensitivity.indices:
        return {"indices": [], "index_heads": [], "index_notes": []}
    found = ordered_indices(sensitivity)
    heads = [*found[0].group, "measure", "of"]
    heads += [text for name in found[0].values for text in (name, "interval")]
    rows = []
    for one in found[:MOST_INDICES]:
        ends = (interval_text(one.intervals[name]) for name in one.values)
        cells = zip(map(short, one.values.values()), ends, strict=True)
        used = f"{one.used} of {one.count}"
        rows.append([*one.group.values(), one.measure, one.name, *itertools.chain(*cells), used])
    heads.append(WHOLE[sensitivity.method])
    return {"indices": rows, "index_heads": heads, "index_notes": untold_texts(sensitivity)}


def _extremes(table: Table) -> list[tuple[str, str, list[tuple[str, list[list[str]]]]]]:
    """Return for each measure that is a number the variants with its highest and lowest values."""
    found = []
    for column in table.store.manifest.measures:
        if column.type not in ("real", "whole"):
            continue
        values = np.where(table.is_done, table.reals(column.name), np.nan)
        rising = np.argsort(values, kind="stable")[: int(np.sum(~np.isnan(values)))].tolist()
        highest = rising[::-1][:MOST_EXTREME]
        lowest = rising[: max(0, min(MOST_EXTREME, len(rising) - len(highest)))]
        ends = [
            (name, _rows(table, kept, (column.name,)))
            for name, kept in (("highest", highest), ("lowest", lowest))
            if kept
        ]
        if ends:
            found.append((column.name, column.label, ends))
    return found


def _failed(table: Table) -> dict[str, Any]:
    places, names = table.words("status")
    done = names.index(DONE) if DONE in names else -1
    failed = np.flatnonzero(places != done).tolist()
    rows = _rows(table, failed[:MOST_FAILED], ("status", "message"))
    return {"failed": rows, "more": max(0, len(failed) - MOST_FAILED)}


def _rows(table: Table, places: Sequence[int], last: Sequence[str]) -> list[list[str]]:
    """Return the cells of some variants: number, variant, scenario, what varies, and others."""
    if not places:
        return []
    manifest = table.store.manifest
    columns = {column.name: column for column in manifest.varied}
    names = ["number", "variant", "scenario", *columns, *last]
    parquet, first = arrow_module().parquet, 0
    found: dict[int, dict[str, Any]] = {}
    for path in table.store.paths():
        count = parquet.read_metadata(path).num_rows
        own = [place for place in places if first <= place < first + count]
        if own:
            read = parquet.read_table(path, columns=names).take([p - first for p in own])
            found.update(zip(own, read.to_pylist(), strict=True))
        first += count
    return [[_cell(found[place][name], columns.get(name)) for name in names] for place in places]


def _cell(value: Any, column: Column | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return shown(value, column or PLAIN)
    return str(value)


def _embedded(name: str, data: bytes) -> str:
    """Return an SVG as a part of a page: its names are like no other's."""
    title = html.escape(name)
    text = OWN_NAME.sub(lambda found: f"{found[1]}{title}-", METADATA.sub("", data.decode()))
    return HEAD.sub(lambda _: f'<svg role="img" aria-label="{title}" ', text, count=1)


def _page(context: Mapping[str, Any]) -> str:
    own = resources.files("modewright").joinpath("templates")
    shared = resources.files("diagnosis").joinpath("templates")

    def text_of(name: str) -> str:
        folder = shared if name == "report.css.jinja" else own
        return folder.joinpath(name).read_text("utf-8")

    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(text_of),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=True,
    )
    return environment.get_template("study.html.jinja").render(context)
