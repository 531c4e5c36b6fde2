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

from modewright.show_sensitivity import ordered_indices
from modewright.show_study import interval_text, short
from sweep.block import DONE
from sweep.picture import pictures
from sweep.rows_file import arrow_module
from sweep.sensitivity import sensitivity_of
from sweep.store import Store
from sweep.summary import Summary, summary_of, with_unit
from sweep.table import Table

MOST_WORST, MOST_FAILED, MOST_INDICES = 5, 100, 300
"""Rows of each table that grows with the study."""
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
        **_measures(summary),
        **_sensitivity(store),
        "figures": [
            (name, _embedded(name, picture.data("svg")))
            for name, picture in pictures(store).items()
        ],
        "worst": _worst(table),
        **_failed(table),
        "version": metadata.version("modewright"),
        "digest": manifest.digest,
        "identity": sorted(manifest.identity.items()),
    }
    return _page(context).encode()


def _measures(summary: Summary) -> dict[str, Any]:
    lines = [
        {
            "group": list(line.group.values()), "measure": line.measure, "unit": line.unit,
            "cells": [
                line.count, short(line.median), interval_text(line.median_interval),
                *map(short, (line.mean, line.deviation, line.p95, line.low, line.high)),
            ],
        }
        for line in summary.lines
    ]  # fmt: skip
    rates = [
        {
            "group": list(rate.group.values()), "measure": rate.measure,
            "cells": [
                rate.hits, rate.count, short(rate.hits / rate.count) if rate.count else "-",
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
    if store.manifest.design is None:
        return {"indices": [], "index_heads": []}
    found = ordered_indices(sensitivity_of(store))
    if not found:
        return {"indices": [], "index_heads": []}
    heads = [*found[0].group, "measure", "of"]
    heads += [text for name in found[0].values for text in (name, "interval")]
    rows = []
    for one in found[:MOST_INDICES]:
        ends = (interval_text(one.intervals[name]) for name in one.values)
        cells = zip(map(short, one.values.values()), ends, strict=True)
        rows.append([*one.group.values(), one.measure, one.name, *itertools.chain(*cells)])
    return {"indices": rows, "index_heads": heads}


def _worst(table: Table) -> list[tuple[str, str, list[list[str]]]]:
    """Return for each measure that is a number the variants with its largest magnitudes."""
    found = []
    for column in table.store.manifest.measures:
        if column.type not in ("real", "whole"):
            continue
        values = np.where(table.is_done, np.abs(table.reals(column.name)), np.nan)
        places = np.argsort(-np.where(np.isnan(values), -np.inf, values), kind="stable")
        kept = [int(place) for place in places[:MOST_WORST] if not np.isnan(values[place])]
        if kept:
            found.append((column.name, column.unit, _rows(table, kept, (column.name,))))
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
    units = {column.name: column.unit for column in manifest.varied}
    names = ["number", "variant", "scenario", *units, *last]
    parquet, first = arrow_module().parquet, 0
    found: dict[int, dict[str, Any]] = {}
    for path in table.store.paths():
        count = parquet.read_metadata(path).num_rows
        own = [place for place in places if first <= place < first + count]
        if own:
            read = parquet.read_table(path, columns=names).take([p - first for p in own])
            found.update(zip(own, read.to_pylist(), strict=True))
        first += count
    return [[_cell(found[place][name], units.get(name)) for name in names] for place in places]


def _cell(value: Any, unit: str | None) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return with_unit(value, unit or "1")
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
