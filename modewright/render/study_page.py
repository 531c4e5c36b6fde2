"""Study page: render the results of a study as a self-contained HTML page."""

from __future__ import annotations

import html
import itertools
import re
from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any

import numpy as np

from codegen.toolchain.templates import render_html
from diagnosis import report as diagnosis_report
from language.expressions.units import display_unit
from language.text.arguments import PathText, to_path
from language.text.regular_file import open_regular_file
from modewright.render.sensitivity import DESIGN_UNITS, incomplete_index_notes, sort_indices
from modewright.render.study import failure_texts, format_number, interval_text
from sweep.analysis.plots import draw_pictures
from sweep.analysis.sensitivity import sensitivity_of
from sweep.analysis.summary import Summary, format_value, summary_of
from sweep.definition.measure import StoreColumn
from sweep.store.block_file import import_arrow
from sweep.store.manifest import Design, Manifest
from sweep.store.row import DONE
from sweep.store.store import Store, read_store
from sweep.store.table import StudyTable

MAX_EXTREMES, MAX_FAILED, MAX_INDICES = 5, 100, 300
"""Largest numbers of rows of the tables that grow with the study."""

UNITLESS_COLUMN = StoreColumn("", "real", "1")
"""A column for numbers whose unit is shown elsewhere."""

SVG_HEAD = re.compile(r"^.*?<svg ", re.DOTALL)
"""The text of an SVG document up to its attributes."""

SVG_METADATA = re.compile(r"<metadata>.*?</metadata>", re.DOTALL)
"""The metadata of an SVG document."""

SVG_IDENTIFIER = re.compile(r"(\bid=\"|\"#|url\(#)")
"""The start of an identifier or of a reference to one."""


def render_study_page(store: Store) -> bytes:
    """Return the stored results of a study as a self-contained HTML page.

    It has description, counts, measures, sensitivity indices, plots, the variants with extreme
    measures and those that failed; long tables are cut at MAX_EXTREMES, MAX_FAILED and MAX_INDICES
    rows. Raises SpecError and MissingToolError.
    """
    table = StudyTable(store)
    summary, manifest = summary_of(store), store.manifest
    context = {
        "name": manifest.study,
        "there": sum(summary.counts.values()),
        "expected": manifest.count,
        "counts": list(summary.counts.items()),
        "varied": [column.name for column in manifest.varied],
        "description": _description_rows(manifest),
        **_measures_context(summary),
        **_sensitivity_context(store),
        "figures": [
            (name, _embed_svg(name, picture.data("svg")))
            for name, picture in draw_pictures(store).items()
        ],
        "extremes": _extreme_variants(table),
        "reasons": failure_texts(summary),
        **_failed_context(table),
        "version": metadata.version("modewright"),
        "digest": manifest.digest,
        "identity": sorted(manifest.identity.items()),
    }
    return _render_template(context).encode()


def _description_rows(manifest: Manifest) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the sections of the study, each with texts by name."""
    found = []
    for key, entry in manifest.description.items():
        rows = [("", entry)] if isinstance(entry, str) else list(entry.items())
        found.append((key, rows))
    design = manifest.design
    if design.count:
        found.append(
            ("sampling", [(design.method, _design_text(design)), ("seed", str(design.seed))])
        )
    if design.replicates > 1:
        found.append(("replicates", [("", str(design.replicates))]))
    return found


def _design_text(design: Design) -> str:
    """Return the number of points of a design as text."""
    if not design.has_indices:
        return f"{design.count} points"
    return f"{design.group_count} {DESIGN_UNITS[design.method]} of {design.group_size} points"


def _measures_context(summary: Summary) -> dict[str, Any]:
    """Return measures and rates for the template."""
    lines = [
        {
            "group": list(line.group.values()), "measure": line.measure,
            "unit": display_unit(line.unit),
            "cells": [
                line.count, line.draws,
                format_number(line.median), interval_text(line.median_interval),
                format_number(line.mean), interval_text(line.mean_interval),
                *map(format_number, (line.deviation, line.p95, line.low, line.high)),
            ],
        }
        for line in summary.lines
    ]  # fmt: skip
    rates = [
        {
            "group": list(rate.group.values()), "measure": rate.measure,
            "cells": [
                rate.hits, rate.count, rate.draws, format_number(rate.share),
                interval_text(rate.interval),
            ],
        }
        for rate in summary.rates
    ]  # fmt: skip
    groups = list(summary.lines[0].group) if summary.lines else []
    return {
        "groups": groups, "lines": lines, "rates": rates, "sure": f"{summary.confidence * 100:g} %",
    }  # fmt: skip


def _sensitivity_context(store: Store) -> dict[str, Any]:
    """Return the sensitivity indices for the template; empty without a design."""
    sensitivity = sensitivity_of(store) if store.manifest.design.has_indices else None
    if sensitivity is None or not sensitivity.indices:
        return {"indices": [], "index_heads": [], "index_notes": []}
    found = sort_indices(sensitivity)
    heads = [*found[0].group, "measure", "of"]
    heads += [text for name in found[0].values for text in (name, "interval")]
    rows = []
    for one in found[:MAX_INDICES]:
        ends = (interval_text(one.intervals[name]) for name in one.values)
        cells = zip(map(format_number, one.values.values()), ends, strict=True)
        used = f"{one.used} of {one.count}"
        rows.append([*one.group.values(), one.measure, one.name, *itertools.chain(*cells), used])
    heads.append(DESIGN_UNITS[sensitivity.method])
    return {
        "indices": rows,
        "index_heads": heads,
        "index_notes": incomplete_index_notes(sensitivity),
    }


def _extreme_variants(
    table: StudyTable,
) -> list[tuple[str, str, list[tuple[str, list[list[str]]]]]]:
    """Return for each numeric measure the variants with the highest and the lowest values."""
    found = []
    for column in table.store.manifest.measures:
        if column.type not in ("real", "whole"):
            continue
        values = np.where(table.is_done, table.read_reals(column.name), np.nan)
        rising = np.argsort(values, kind="stable")[: int(np.sum(~np.isnan(values)))].tolist()
        highest = rising[::-1][:MAX_EXTREMES]
        lowest = rising[: max(0, min(MAX_EXTREMES, len(rising) - len(highest)))]
        ends = [
            (name, _variant_rows(table, kept, (column.name,)))
            for name, kept in (("highest", highest), ("lowest", lowest))
            if kept
        ]
        if ends:
            found.append((column.name, column.label, ends))
    return found


def _failed_context(table: StudyTable) -> dict[str, Any]:
    """Return the unfinished variants for the template, at most MAX_FAILED, and the number of
    others.
    """
    places, names = table.read_categories("status")
    done = names.index(DONE) if DONE in names else -1
    failed = np.flatnonzero(places != done).tolist()
    rows = _variant_rows(table, failed[:MAX_FAILED], ("status", "message"))
    return {"failed": rows, "more": max(0, len(failed) - MAX_FAILED)}


def _variant_rows(table: StudyTable, places: Sequence[int], last: Sequence[str]) -> list[list[str]]:
    """Return the cells of the variants at the given rows.

    The columns are number, variant, scenario, the variables, and `last`.
    """
    if not places:
        return []
    manifest = table.store.manifest
    columns = {column.name: column for column in manifest.varied}
    names = ["number", "variant", "scenario", *columns, *last]
    parquet, first = import_arrow().parquet, 0
    found: dict[int, dict[str, Any]] = {}
    for path in table.store.paths():
        with open_regular_file(path) as file:
            blocks = parquet.ParquetFile(file)
            count = blocks.metadata.num_rows
            own = [place for place in places if first <= place < first + count]
            if own:
                read = blocks.read(columns=names).take([p - first for p in own])
                found.update(zip(own, read.to_pylist(), strict=True))
        first += count
    return [[_cell(found[place][name], columns.get(name)) for name in names] for place in places]


def _cell(value: Any, column: StoreColumn | None) -> str:
    """Return a value of a column as text; `-` for None."""
    if value is None:
        return "-"
    if isinstance(value, float):
        return format_value(value, column or UNITLESS_COLUMN)
    return str(value)


def _embed_svg(name: str, data: bytes) -> str:
    """Return an SVG for embedding, with identifiers that are unique on the page."""
    title = html.escape(name)
    text = SVG_IDENTIFIER.sub(
        lambda found: f"{found[1]}{title}-", SVG_METADATA.sub("", data.decode())
    )
    return SVG_HEAD.sub(lambda _: f'<svg role="img" aria-label="{title}" ', text, count=1)


def _render_template(context: Mapping[str, Any]) -> str:
    """Return the page for a context."""
    packages = (__name__.rpartition(".")[0], diagnosis_report.__name__)
    return render_html(packages, "study.html.jinja", context)


def study_report(out: PathText) -> bytes:
    """Return the results in the folder of a study as a self-contained HTML page.

    No file is written. Raises SpecError if the folder has no results or a damaged block, and
    MissingToolError without pyarrow.
    """
    return render_study_page(read_store(to_path(out, "out")))
