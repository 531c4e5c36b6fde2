"""Recording corruption: what is wrong with the recordings, the map or the options of a diagnosis.

Each corruption changes the draft of a pair of a spec and recordings in place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from random import Random

from tests.validation.properties.recorded_machine import Machine, Table, read_real, record

FACTORS = (-1.0, 1e-3, 0.10472, 0.0174533, 3.6, 9.5493, 57.2958, 1e3)
"""Factors of wrong signs and units."""
HUGE, TINY = ("1e30", "-1e30", "1e300", "9e307"), ("1e-30", "-1e-300", "5e-324")
WORDS = ("nan", "NaN", "inf", "-inf", "Infinity", "None", "null", "#N/A", "1,5", "--", "")


@dataclass
class Draft:
    """A pair while it is drawn.

    `text_changes` are applied to the text of each file; `repeated` are the options that name the
    first training file again.
    """

    machine: Machine
    others: tuple[Machine, ...]
    train: list[Table]
    held_out: list[Table]
    map_name: str | None
    stride: int
    text_changes: list[Callable[[str], str]] = field(default_factory=list)
    repeated: list[str] = field(default_factory=list)

    @property
    def tables(self) -> list[Table]:
        """All recordings."""
        return [*self.train, *self.held_out]


Corruption = Callable[[Random, Draft], None]


def draw_recording(draw: Random, machine: Machine, count: int, stride: int, noise: float) -> Table:
    """Return a simulated recording, or for a machine with real ones a part of one."""
    if machine.files and draw.random() < 0.5:
        return read_real(machine, draw, count)
    return record(machine, draw, count, stride, noise)


def _time_of(draft: Draft) -> str:
    return draft.machine.mapping.time


def _some_columns(draw: Random, draft: Draft, table: Table) -> list[str]:
    """Return one column with values, or all."""
    known = [name for name in draft.machine.columns if name in table]
    return known if not known or draw.random() < 0.3 else [draw.choice(known)]


def _map_cells(
    draw: Random, draft: Draft, change: Callable[[str, int], str], share: float = 1.0
) -> None:
    """Change cells of one column or of all, in some recordings; `share` is that of the cells."""
    for table in draft.tables:
        if table is draft.train[0] or draw.random() < 0.5:
            for name in _some_columns(draw, draft, table):
                cells = table[name]
                table[name] = [
                    change(cell, k) if share == 1.0 or draw.random() < share else cell
                    for k, cell in enumerate(cells)
                ]


def _keep_rows(table: Table, rows: list[int]) -> None:
    for name, cells in table.items():
        table[name] = [cells[k] for k in rows]


def _count(table: Table) -> int:
    return len(next(iter(table.values())))


def none(draw: Random, draft: Draft) -> None:
    """Leave the recordings as they are."""


def wrong_machine(draw: Random, draft: Draft) -> None:
    """Record another machine under the columns of this one."""
    other = draw.choice(draft.others)
    count = _count(draft.train[0])
    for k in range(len(draft.train)):
        made = record(other, draw, count, draft.stride, 0.01)
        values = [made[name] for name in other.columns]
        table = draft.train[k]
        for place, name in enumerate(draft.machine.columns):
            if values:
                table[name] = values[place % len(values)][: _count(table)]


def columns_of_another_machine(draw: Random, draft: Draft) -> None:
    """Record another machine with its own columns."""
    other = draw.choice(draft.others)
    count = _count(draft.train[0])
    draft.train[:] = [record(other, draw, count, draft.stride, 0.01) for _ in draft.train]


def wrong_unit(draw: Random, draft: Draft) -> None:
    """Multiply columns by the factor of a unit or by -1."""
    factor = draw.choice(FACTORS)
    _map_cells(draw, draft, lambda cell, _: f"{float(cell) * factor:.8g}" if cell else cell)


def constant_columns(draw: Random, draft: Draft) -> None:
    """Make columns constant."""
    value = draw.choice(("0", "1", "-3.25", "1000"))
    _map_cells(draw, draft, lambda _, k: value)


def all_zero(draw: Random, draft: Draft) -> None:
    """Make all values zero."""
    for table in draft.tables:
        for name in draft.machine.columns:
            table[name] = ["0"] * _count(table)


def few_samples(draw: Random, draft: Draft) -> None:
    """Keep one sample, two, three or ten."""
    count = draw.choice((1, 2, 3, 10))
    for table in draft.train:
        _keep_rows(table, list(range(count)))


def duplicate_stamps(draw: Random, draft: Draft) -> None:
    """Repeat a row or a time stamp."""
    table = draft.train[0]
    k = draw.randrange(1, _count(table))
    if draw.random() < 0.5:
        table[_time_of(draft)][k] = table[_time_of(draft)][k - 1]
    else:
        _keep_rows(table, [*range(k + 1), *range(k, _count(table))])


def decreasing_stamps(draw: Random, draft: Draft) -> None:
    """Reverse the time, or let it restart."""
    cells = draft.train[0][_time_of(draft)]
    if draw.random() < 0.5:
        cells.reverse()
    else:
        half = len(cells) // 2
        cells[half:] = cells[: len(cells) - half]


def odd_stamps(draw: Random, draft: Draft) -> None:
    """Scale, shift, round or spoil the time stamps."""
    kind = draw.choice(("ms", "epoch", "round", "far", "text", "negative", "jitter"))
    for table in draft.tables:
        times = [float(cell) for cell in table[_time_of(draft)]]
        gap = times[1] - times[0] if len(times) > 1 else 1.0
        table[_time_of(draft)] = [
            _odd_stamp(draw, kind, time, time - times[0], gap) for time in times
        ]


def _odd_stamp(draw: Random, kind: str, time: float, since_start: float, gap: float) -> str:
    """Return the text of a time stamp [s] that is spoiled in a way; `gap` is the sample period."""
    match kind:
        case "ms":
            return f"{1e3 * time:.9g}"
        case "epoch":
            return f"{1.7e9 + time:.6f}"
        case "round":
            return f"{round(time / gap / 3) * 3 * gap:.9g}"
        case "far":
            return f"{1e11 * since_start:.9g}"
        case "negative":
            return f"{time - 1000.0:.9g}"
        case "jitter":
            return f"{time + draw.uniform(-0.4, 0.4) * gap:.9g}"
    return "12:00:01"


def gaps(draw: Random, draft: Draft) -> None:
    """Remove intervals of rows, or shift the later stamps."""
    for table in draft.tables:
        count = _count(table)
        for _ in range(draw.randint(1, 3)):
            first = draw.randrange(1, max(2, count - 1))
            last = first + draw.randrange(1, max(2, count // 3))
            _keep_rows(table, [k for k in range(_count(table)) if not first <= k < last])


def missing_values(draw: Random, draft: Draft) -> None:
    """Empty some cells, most of them, or all of a column."""
    _map_cells(draw, draft, lambda *_: "", draw.choice((0.05, 0.5, 0.95, 1.0)))


def words(draw: Random, draft: Draft) -> None:
    """Write texts such as nan and inf into some cells."""
    _map_cells(draw, draft, lambda *_: draw.choice(WORDS), draw.choice((0.01, 0.3)))


def huge_values(draw: Random, draft: Draft) -> None:
    """Write huge values into some cells or a column, or multiply all by a large number."""
    share = draw.choice((0.01, 0.3, 1.0))
    if draw.random() < 0.5:
        _map_cells(draw, draft, lambda *_: draw.choice(HUGE), share)
    else:
        factor = draw.choice((1e6, 1e9, 1e14, 1e30))
        _map_cells(draw, draft, lambda cell, _: f"{float(cell or 0) * factor:.8g}", share)


def tiny_values(draw: Random, draft: Draft) -> None:
    """Make values tiny."""
    if draw.random() < 0.3:
        _map_cells(draw, draft, lambda *_: draw.choice(TINY))
    else:
        factor = draw.choice((1e-6, 1e-12, 1e-30, 1e-200))
        _map_cells(draw, draft, lambda cell, _: f"{float(cell or 0) * factor:.8g}")


def empty_file(draw: Random, draft: Draft) -> None:
    """Empty a file, or leave its head line or a part of a line."""
    cut = draw.choice(
        (
            lambda text: "",
            lambda text: "\n\n",
            lambda text: text.partition("\n")[0] + "\n",
            lambda text: text[: len(text) // 2],
            lambda text: text.partition("\n")[2],
        )
    )
    draft.text_changes.append(cut)


def other_text(draw: Random, draft: Draft) -> None:
    """Write files with another separator, line end, encoding mark or with zero bytes."""
    draft.text_changes.append(
        draw.choice(
            (
                lambda text: text.replace(",", ";"),
                lambda text: text.replace("\n", "\r\n"),
                lambda text: "\ufeff" + text,
                lambda text: text.replace("\n", "\0\n"),
                lambda text: text.replace("\n", ",\n"),
                lambda text: '"' + text,
            )
        )
    )


def unlike_rates(draw: Random, draft: Draft) -> None:
    """Record files at different rates, or columns of one file."""
    factor = draw.choice((2, 3, 7))
    if draw.random() < 0.5 or len(draft.train) < 2:
        table = draft.train[0]
        for name in draft.machine.columns[: draw.randint(1, 2)]:
            table[name] = [cell if k % factor == 0 else "" for k, cell in enumerate(table[name])]
    else:
        for table in draft.train[1:]:
            _keep_rows(table, list(range(0, _count(table), factor)))


def missing_columns(draw: Random, draft: Draft) -> None:
    """Leave out columns, perhaps that of time."""
    for table in draft.tables:
        names = [*draft.machine.columns, *([_time_of(draft)] if draw.random() < 0.2 else [])]
        for name in draw.sample(names, min(len(names), draw.randint(1, 2))):
            table.pop(name, None)


def extra_columns(draw: Random, draft: Draft) -> None:
    """Add columns, perhaps one twice or with another case."""
    for table in draft.tables:
        count = _count(table)
        for name in ("note", "x y", "", _time_of(draft).upper()):
            if draw.random() < 0.5:
                table[name] = [draw.choice(WORDS[:-4]) for _ in range(count)]
    if draw.random() < 0.3:
        draft.text_changes.append(
            lambda text: "\n".join(f"{line},{line.split(',')[-1]}" for line in text.split("\n"))
        )


def quantised(draw: Random, draft: Draft) -> None:
    """Round values coarsely."""
    for table in draft.tables:
        for name in _some_columns(draw, draft, table):
            numbers = [float(cell or 0) for cell in table[name]]
            step = (max(numbers) - min(numbers)) / draw.choice((1, 2, 5)) or 1.0
            table[name] = [f"{round(number / step) * step:.8g}" for number in numbers]


def map_of_another_spec(draw: Random, draft: Draft) -> None:
    """Name the map of another spec."""
    shipped = [one for one in draft.others if one.map_name is None]
    draft.map_name = draw.choice(shipped).mapping.name


def short_held_out(draw: Random, draft: Draft) -> None:
    """Hold out a recording that is shorter than the training recordings."""
    table = {name: list(cells) for name, cells in draft.train[0].items()}
    _keep_rows(table, list(range(draw.choice((1, 2, 3, 9, 20, 50)))))
    for name in draft.machine.columns:
        table[name] = [f"{float(cell or 0) * 1.01 + 1e-3:.8g}" for cell in table[name]]
    draft.held_out[:] = [table]


def held_out_of_another_machine(draw: Random, draft: Draft) -> None:
    """Hold out a recording of another machine, under its columns or under those of this one."""
    other = draw.choice(draft.others)
    made = record(other, draw, _count(draft.train[0]), draft.stride, 0.01)
    if draw.random() < 0.7 and other.columns:
        names = draft.machine.columns
        values = [made[name] for name in other.columns]
        table = {_time_of(draft): next(iter(made.values()))}
        made = table | {name: values[k % len(values)] for k, name in enumerate(names)}
    draft.held_out[:] = [made]


def same_file_twice(draw: Random, draft: Draft) -> None:
    """Name the first training file twice, or also as held-out."""
    draft.repeated.append(draw.choice(("--train", "--held-out")))


def same_values_twice(draw: Random, draft: Draft) -> None:
    """Give a copy of a training recording a name of its own."""
    copy = {name: list(cells) for name, cells in draft.train[0].items()}
    (draft.train if draw.random() < 0.5 else draft.held_out).append(copy)


def outliers(draw: Random, draft: Draft) -> None:
    """Multiply some values by a large number, or hold the signal for a while."""
    factor = draw.choice((10.0, 1e3, 1e5))
    _map_cells(draw, draft, lambda cell, _: f"{float(cell or 0) * factor:.8g}", 0.02)


CORRUPTIONS: tuple[Corruption, ...] = (
    none,
    wrong_machine,
    columns_of_another_machine,
    wrong_unit,
    constant_columns,
    all_zero,
    few_samples,
    duplicate_stamps,
    decreasing_stamps,
    odd_stamps,
    gaps,
    missing_values,
    words,
    huge_values,
    tiny_values,
    empty_file,
    other_text,
    unlike_rates,
    missing_columns,
    extra_columns,
    quantised,
    map_of_another_spec,
    short_held_out,
    held_out_of_another_machine,
    same_file_twice,
    same_values_twice,
    outliers,
)
