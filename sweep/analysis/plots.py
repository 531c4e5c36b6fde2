"""Plots of a study: draw heat maps, parallel coordinates, tornado charts and histograms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from engine.results.array_types import Reals
from engine.results.mode_band import PALETTE
from engine.results.plot import QUANTITIES, Picture
from language.text.sanitise import escape_invisible
from sweep.analysis.summary import group_values
from sweep.definition.measure import StoreColumn
from sweep.store.store import Store
from sweep.store.table import StudyTable, to_display_unit

RELATIVE_ROUNDING = 1.0e-9
"""Relative range of values below which a histogram has one bin. It is larger than rounding errors.
"""

MAX_BINS = 60
"""Largest number of bins of a histogram: a figure of 7.5 inches does not resolve more."""


def histogram_bin_edges(values: Reals) -> Reals:
    """Return the edges (n_bins + 1,) of the bins of a histogram of values (n,).

    The number of bins is the larger one of Freedman and Diaconis (1981) and Sturges (1926), at most
    MAX_BINS; the bins are equal, from minimum to maximum. Values whose range is at most
    RELATIVE_ROUNDING of their magnitude get one bin around them; no values give [0, 1].
    """
    if not len(values):
        return np.array([0.0, 1.0])
    low, high = float(np.min(values)), float(np.max(values))
    size = max(abs(low), abs(high))
    if high - low <= RELATIVE_ROUNDING * size:
        return np.array([low - 0.5 * (size or 1.0), high + 0.5 * (size or 1.0)])
    upper, lower = np.quantile(values, [0.75, 0.25])
    width = 2.0 * float(upper - lower) * len(values) ** (-1.0 / 3.0)
    wanted = (high - low) / width if width > 0.0 else 0.0
    count = min(max(wanted, np.log2(len(values)) + 1.0), MAX_BINS)
    return np.linspace(low, high, int(np.ceil(count)) + 1)


MAX_LINES = 2000
"""Largest number of lines in a plot of parallel coordinates; of more variants every k-th is drawn.
"""

MAX_HEAT_MAP_BINS = 12
"""Bins along each axis of a heat map if the variable has more than twice as many different values.
"""

MAX_ANNOTATED_CELLS = 144
"""Largest number of cells of a heat map whose values are written into the cells."""

MAX_DRAWN_MAGNITUDE = 1.0e300
"""Values of larger magnitude are not drawn, because axis limits with margins would overflow."""

MAX_LABEL_CHARACTERS = 75
"""Largest number of characters of horizontal tick labels below a heat map, with one space each.
A character is 0.06 inch wide and the axis 4.8 inches.
"""


def draw_pictures(store: Store) -> dict[str, Picture]:
    """Return the plots of a study by name, drawn from the variants that are finished.

    A plot without finished variants contains a note instead. Values above MAX_DRAWN_MAGNITUDE are
    left out and counted in the title. Raises SpecError for a damaged store, MissingToolError
    without pyarrow.
    """
    table = StudyTable(store)
    draw = {
        "heat_map": _draw_heat_map,
        "parallel": _draw_parallel,
        "tornado": _draw_tornado,
        "histogram": _draw_histogram,
    }
    found = {}
    for name, plot in store.manifest.presentation.plots.items():
        count = int(np.sum(table.is_done))
        figure = draw[plot["kind"]](table, plot) if count else _draw_empty()
        title = f"{store.manifest.study}: {name} ({count} variants{_omission_text(table, plot)})"
        figure.suptitle(escape_invisible(title), x=0.01, ha="left", fontsize=11, parse_math=False)
        found[name] = Picture(figure)
    return found


def _draw_empty() -> Figure:
    """Return a figure that states that no variant is finished."""
    figure = Figure(figsize=(5.0, 2.0))
    figure.text(0.5, 0.4, "no variant is done yet", ha="center")
    return figure


def _find_column(table: StudyTable, name: str) -> StoreColumn:
    """Return the column of a variable or a measure with this name.

    Raises StopIteration if unknown.
    """
    manifest = table.store.manifest
    return next(c for c in (*manifest.varied, *manifest.measures) if c.name == name)


def _axis_label(table: StudyTable, name: str) -> str:
    """Return the label of an axis: name, physical quantity if known, and unit unless it is 1."""
    column = _find_column(table, name)
    quantity = QUANTITIES.get(column.unit, "")
    extra = f", {quantity}" if quantity not in ("", "number") else ""
    return escape_invisible(f"{name}{extra} [{column.label}]" if column.label != "1" else name)


def _finished_values(table: StudyTable, name: str) -> Reals:
    """Return a column of the finished variants (n_done,) in the display unit.

    Values that cannot be drawn are NaN.
    """
    return _mask_undrawable(
        to_display_unit(table.read_reals(name)[table.is_done], _find_column(table, name))
    )


def _mask_undrawable(values: Reals) -> Reals:
    """Return the values with NaN in place of magnitudes above MAX_DRAWN_MAGNITUDE."""
    return np.where(np.abs(values) <= MAX_DRAWN_MAGNITUDE, values, np.nan)


def _omission_text(table: StudyTable, plot: Mapping[str, Any]) -> str:
    """Return a note with the number of values that are too large to draw.

    The result is empty if there are none.
    """
    drawn = [table.read_pooled(name) for name in plot["of"]]
    count = sum(
        int(np.sum(np.abs(p.values[table.is_done[p.rows]]) > MAX_DRAWN_MAGNITUDE)) for p in drawn
    )
    return f", without {count} numbers above {MAX_DRAWN_MAGNITUDE:g}" if count else ""


def _draw_heat_map(table: StudyTable, plot: Mapping[str, Any]) -> Figure:
    """Return a heat map whose cells are medians of a measure over two variables.

    A cell without a variant, or without a value of the measure, is white.
    """
    (x_name, y_name), measure = plot["over"], plot["of"][0]
    x, y, z = (_finished_values(table, name) for name in (x_name, y_name, measure))
    (xs, x_ticks), (ys, y_ticks) = _assign_bins(x), _assign_bins(y)
    cells = np.full((len(y_ticks), len(x_ticks)), np.nan)
    for row in range(len(y_ticks)):
        for column in range(len(x_ticks)):
            own = z[(xs == column) & (ys == row) & ~np.isnan(z)]
            if len(own):
                cells[row, column] = np.median(own)
    figure = Figure(figsize=(7.5, 5.0), layout="constrained")
    axis = figure.subplots()
    image = axis.imshow(cells, origin="lower", aspect="auto", cmap="viridis")
    names = [f"{v:.4g}" for v in x_ticks]
    axis.set_xticks(range(len(x_ticks)), names, fontsize=8, rotation=_label_rotation(names))
    axis.set_yticks(range(len(y_ticks)), [f"{v:.4g}" for v in y_ticks], fontsize=8)
    axis.set_xlabel(_axis_label(table, x_name), parse_math=False)
    axis.set_ylabel(_axis_label(table, y_name), parse_math=False)
    bar = figure.colorbar(image, ax=axis)
    bar.set_label(f"median {_axis_label(table, measure)}", parse_math=False)
    _annotate(axis, cells)
    return figure


def _label_rotation(names: Sequence[str]) -> float:
    """Return the rotation [deg] of tick labels: 90 if they would overlap horizontally, else 0."""
    return (
        90.0 if len(names) * (max(map(len, names), default=0) + 1) > MAX_LABEL_CHARACTERS else 0.0
    )


def _annotate(axis: Axes, cells: Reals) -> None:
    """Write the finite values into the cells of a heat map.

    This does nothing if there are more than MAX_ANNOTATED_CELLS cells.
    """
    if cells.size > MAX_ANNOTATED_CELLS or not np.any(np.isfinite(cells)):
        return
    middle = (np.nanmin(cells) + np.nanmax(cells)) / 2.0
    for (row, column), value in np.ndenumerate(cells):
        if np.isfinite(value):
            colour = "black" if value > middle else "white"
            axis.text(
                column, row, f"{value:.4g}", ha="center", va="center", fontsize=8, color=colour
            )


def _assign_bins(values: Reals) -> tuple[NDArray[np.int64], Reals]:
    """Return the bin index of each value (n,) and the centres of the bins (n_bins,).

    Each different value is a bin of its own if there are few. Else the bins divide the range
    equally, and the index of NaN is -1.
    """
    unique, places = np.unique(values, return_inverse=True)
    if len(unique) <= 2 * MAX_HEAT_MAP_BINS:
        return places.reshape(-1).astype(np.int64), unique
    ends = np.linspace(np.nanmin(unique), np.nanmax(unique), MAX_HEAT_MAP_BINS + 1)
    places = np.clip(np.searchsorted(ends, values, side="right") - 1, 0, MAX_HEAT_MAP_BINS - 1)
    places[np.isnan(values)] = -1
    return places.astype(np.int64), (ends[:-1] + ends[1:]) / 2.0


def _draw_parallel(table: StudyTable, plot: Mapping[str, Any]) -> Figure:
    """Return parallel coordinates with one line for each variant, coloured by the last measure.

    The axes are the variables and then the measures. Variants with a missing value are left out.
    """
    manifest = table.store.manifest
    names = [column.name for column in manifest.varied] + list(plot["of"])
    columns = np.array([_finished_values(table, name) for name in names])
    kept = np.flatnonzero(~np.any(np.isnan(columns), axis=0))
    step = max(1, -(-len(kept) // MAX_LINES))
    columns = columns[:, kept[::step]]
    figure = Figure(figsize=(min(18.0, max(6.0, 1.5 * len(names))), 5.0), layout="constrained")
    axis = figure.subplots()
    low, high = _row_limits(columns)
    share = (columns - low[:, None]) / (high - low)[:, None]
    colours = matplotlib.colormaps["viridis"](share[-1] if share.size else np.zeros(0))
    places = np.arange(float(len(names)))
    lines = [np.column_stack((places, share[:, k])) for k in range(columns.shape[1])]
    axis.add_collection(LineCollection(lines, colors=colours, linewidths=0.8, alpha=0.6))
    axis.set_xlim(-0.2, len(names) - 0.8)
    axis.set_xticks(
        range(len(names)), [_wrap_label(_axis_label(table, name)) for name in names], fontsize=8
    )
    axis.set_yticks([])
    axis.set_ylim(-0.08, 1.08)
    for place in range(len(names)):
        axis.axvline(place, color="black", lw=0.8)
        for value, height, where in ((low[place], -0.02, "top"), (high[place], 1.02, "bottom")):
            axis.text(place, height, f"{value:.4g}", ha="center", va=where, fontsize=8)
    for side in ("top", "right", "bottom", "left"):
        axis.spines[side].set_visible(False)
    return figure


def _wrap_label(label: str) -> str:
    """Return a label with a line break after its name; unchanged if the label is the name only."""
    head, comma, rest = label.partition(", ")
    return f"{head}\n{rest}" if comma else label


def _row_limits(columns: Reals) -> tuple[Reals, Reals]:
    """Return minimum and maximum of each row of columns (n_rows, n); widened if they are equal.

    Without columns the limits are 0 and 1.
    """
    if columns.shape[1] == 0:
        return np.zeros(len(columns)), np.ones(len(columns))
    low, high = columns.min(axis=1), columns.max(axis=1)
    flat = high == low
    room = np.where(np.abs(low) > 0.0, np.abs(low), 1.0) * 1e-6
    return np.where(flat, low - room, low), np.where(flat, high + room, high)


def _draw_tornado(table: StudyTable, plot: Mapping[str, Any]) -> Figure:
    """Return a tornado chart: the influence of each variable on a measure, largest at the top.

    With one-at-a-time sampling a bar goes from the lowest to the highest result. Else it is
    Spearman's rank correlation.
    """
    measure = plot["of"][0]
    result = _finished_values(table, measure)
    alone = _is_one_at_a_time(table)
    figure = Figure(layout="constrained")
    axis = figure.subplots()
    bars = []
    for column in table.store.manifest.varied:
        values = _finished_values(table, column.name)
        fine = ~np.isnan(values) & ~np.isnan(result)
        if not fine.any():
            continue
        if alone:
            bars.append((column.name, float(result[fine].min()), float(result[fine].max())))
        elif len(np.unique(values[fine])) > 1:
            bars.append((column.name, 0.0, rank_correlation(values[fine], result[fine])))
    bars.sort(key=lambda bar: abs(bar[2] - bar[1]))
    figure.set_size_inches(7.5, 1.4 + 0.4 * max(3, len(bars)))
    for place, (_, low, high) in enumerate(bars):
        colour = PALETTE[0] if high >= low else PALETTE[1]
        axis.barh(place, high - low, left=low, height=0.6, color=colour)
        text = f"{low:.4g} ... {high:.4g}" if alone else f"{high:.2f}"
        axis.annotate(
            text, (max(low, high), place), (4, 0), textcoords="offset points", va="center",
            fontsize=8,
        )  # fmt: skip
    axis.set_yticks(range(len(bars)), [escape_invisible(name) for name, _, _ in bars], fontsize=9)
    nominal = _nominal_result(table, result)
    axis.axvline(nominal if alone else 0.0, color="black", lw=1.0)
    axis.margins(x=0.18)
    shown = _axis_label(table, measure)
    axis.set_xlabel(shown if alone else f"rank correlation with {measure}", parse_math=False)
    return figure


def _is_one_at_a_time(table: StudyTable) -> bool:
    """Return whether the variables vary one at a time, so that no variant has values of two."""
    columns = [table.read_reals(column.name) for column in table.store.manifest.varied]
    return bool(columns) and int(np.max(np.sum(~np.isnan(np.array(columns)), axis=0))) <= 1


def _nominal_result(table: StudyTable, result: Reals) -> float:
    """Return the result of the variant without values of variables; NaN if there is none."""
    columns = [_finished_values(table, column.name) for column in table.store.manifest.varied]
    left = np.all(np.isnan(np.array(columns)), axis=0) if columns else np.zeros(0, dtype=bool)
    return float(result[left][0]) if left.any() else float("nan")


def rank_correlation(a: Reals, b: Reals) -> float:
    """Return Spearman's rank correlation of two columns (n,); ties get their mean rank.

    Returns 0 if a column is constant.
    """
    from scipy.stats import rankdata

    x, y = rankdata(a), rankdata(b)
    x, y = x - x.mean(), y - y.mean()
    spread = float(np.sqrt(np.sum(x * x) * np.sum(y * y)))
    return float(np.sum(x * y)) / spread if spread else 0.0


def _draw_histogram(table: StudyTable, plot: Mapping[str, Any]) -> Figure:
    """Return histograms of a measure with its median, one panel for each group."""
    measure = plot["of"][0]
    pooled = table.read_pooled(measure)
    by = plot.get("by") or []
    groups: Sequence[tuple[str, Any]] = [("", np.ones(len(table.is_done), dtype=bool))]
    if by:
        places, names = group_values(table, by[0])
        groups = [(f"{by[0]}: {name}", places == k) for k, name in enumerate(names)]
    kept = table.is_done[pooled.rows] & (np.abs(pooled.values) <= MAX_DRAWN_MAGNITUDE)
    ends = histogram_bin_edges(pooled.values[kept])
    figure = Figure(figsize=(7.5, 1.0 + 2.2 * len(groups)), layout="constrained")
    axes = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    for axis, (title, chosen) in zip(axes, groups, strict=True):
        values = pooled.values[kept & chosen[pooled.rows]]
        axis.hist(values, bins=ends, color=PALETTE[0], edgecolor="white", linewidth=0.4)
        if len(values):
            middle = float(np.median(values))
            axis.axvline(middle, color=PALETTE[1], lw=1.5, label=f"median {middle:.4g}")
            axis.legend(fontsize=8, frameon=False)
        axis.set_ylabel("number", fontsize=9)
        axis.set_title(escape_invisible(title), fontsize=9, loc="left", parse_math=False)
    axes[-1].set_xlabel(_axis_label(table, measure), parse_math=False)
    return figure
