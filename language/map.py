"""Map reader: how the columns of a recording become signals."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, cast

from language.document import Document, Entry, Items, Node, Scalar, Table, require_kind
from language.experiment import EVERY_FILE, Column, RecordingMap, Window
from language.literal import constant
from language.problem import Problems, Span
from language.project import Project, expanded
from language.reader import Reader
from language.units import NO_UNIT, NUMBER, SECOND, Dimension, fits, parse_unit, product

MAP_KEYS = ("language", "map", "time", "columns", "constants", "windows", "dbc")
COLUMN_KEYS = (
    "column mean to compare unit scale sign delay hold blank time".split()  # noqa: SIM905
)


def read_map(document: Document, project: Project) -> RecordingMap:
    """Read a map. Raises SpecError with all problems."""
    document = expanded(document, project)
    problems = Problems()
    require_kind(document, "map", problems)
    problems.stop_if_any()
    found = map_of(document.root, document.name, document.name_span, problems)
    problems.stop_if_any()
    return found


def map_of(root: Table, name: str, at: Span, problems: Problems) -> RecordingMap:
    """Return the map that a mapping of a file holds; what is wrong is reported."""
    return _MapReader(problems).read(root, name, at)


class _MapReader(Reader):
    """The sections of a map."""

    def read(self, root: Table, name: str, at: Span) -> RecordingMap:
        tree = self.table(root, f"map {name}", MAP_KEYS)
        time = self.table(tree.get("time"), "time", ("column", "unit"))
        has_time = "time" in tree.entries
        unit = self.unit(time.get("unit")) if has_time else parse_unit("s")
        if not fits(unit.dimension, SECOND):
            self.problems.error(
                "unit", time.span if time.entries else at, "the unit of `time` is a time"
            )
        constants: dict[str, tuple[Fraction, Dimension]] = {}
        for entry in self.named(tree.get("constants"), "constants"):
            value, own = self.quantity(entry.node, entry.key, entry.span, None)
            constants[entry.key] = value, own.dimension
        columns = [self._column(entry) for entry in self.table(tree.get("columns"), "columns")]
        if not columns:
            self.problems.error("missing", at, "a map has at least one column in `columns`")
        return RecordingMap(
            name=name,
            time=self.text(time.get("column"), "time.column", at) if has_time else "",
            time_unit=unit,
            columns={column.name: column for column in columns},
            constants=constants,
            span=at,
            windows=self._windows(tree.get("windows")),
            databases=self._databases(tree.get("dbc")),
        )

    def _databases(self, node: Node | None) -> tuple[Scalar, ...]:
        """One DBC file or a list of them."""
        return (node,) if isinstance(node, Scalar) else tuple(self.items(node, "dbc"))

    def _windows(self, node: Node | None) -> dict[str, tuple[Window, ...]]:
        """A list of windows for every file, or a mapping from file names to such lists."""
        if node is None:
            return {}
        if not isinstance(node, Table):
            return {EVERY_FILE: self._list_of_windows(node)}
        return {entry.key: self._list_of_windows(entry.node) for entry in node}

    def _list_of_windows(self, node: Node) -> tuple[Window, ...]:
        found: list[Window] = []
        if not isinstance(node, Items) or not node.nodes:
            label = "`windows` is a list like `[[1 s, 8 s]]`, or such a list for each file"
            self.problems.error("form", node.span, label)
            return ()
        for item in node.nodes:
            if not isinstance(item, Items) or len(item.nodes) != 2:
                self.problems.error(
                    "form", item.span, "a window is `[from, to]`, like `[1 s, 8 s]`"
                )
                continue
            start, end = (self._time_of(part) for part in item.nodes)
            if end <= start:
                self.problems.error("range", item.span, "a window ends after it starts")
            elif found and start <= found[-1][1]:
                label = "this window starts before the one above it ends"
                self.problems.error("range", item.span, label, "windows stand in order")
            found.append((start, end))
        return tuple(found)

    def _time_of(self, node: Node) -> Fraction:
        value, unit = self.quantity(node, "a window", node.span, None)
        if value and not fits(unit.dimension, SECOND):
            self.problems.error("dimension", node.span, "a window is in time, like `[1 s, 8 s]`")
        return value

    def _column(self, entry: Entry) -> Column:
        what = f"columns.{entry.key}"
        table = self.table(entry.node, what, COLUMN_KEYS)
        mean = table.get("mean")
        names = [item.text for item in self.items(mean, f"{what}.mean")]
        if isinstance(mean, Items) and not mean.nodes:
            label = "`mean` is a list of at least one column"
            self.problems.error("missing", mean.span, label)
        column = table.get("column")
        if not names:
            names = [self.text(column, "column", entry.span) if column else entry.key]
        elif column:
            self.problems.error("form", entry.span, "`column` and `mean` exclude each other")
        to, compare = table.get("to"), table.get("compare")
        if (to is None) == (compare is None):
            label = "a column has `to` (an input) or `compare` (an output)"
            self.problems.error("missing", entry.span, label)
        hold = self.choice(table.get("hold"), "hold", ("previous", "linear"), "previous")
        blank = self.choice(table.get("blank"), "blank", ("refuse", "skip"), "refuse")
        delay = table.get("delay")
        shift, unit = (
            self.quantity(delay, "delay", delay.span, None) if delay else (Fraction(0), NO_UNIT)
        )
        if delay and ((shift and not fits(unit.dimension, SECOND)) or shift < 0):
            self.problems.error("unit", delay.span, "`delay` is a time of at least 0 s")
        time = table.get("time")
        return Column(
            name=entry.key,
            columns=tuple(names),
            to=self.text(to, "to", entry.span) if to else None,
            compare=self.text(compare, "compare", entry.span) if compare else None,
            unit=self.unit(table.get("unit")),
            scale=self._scale(table),
            sign=int(self.choice(table.get("sign"), "sign", ("1", "-1"), "1")),
            delay=shift,
            blank=cast(Literal["refuse", "skip"], blank),
            time=self.text(time, "time", entry.span) if time else None,
            span=entry.span,
            hold=cast(Literal["previous", "linear"], hold),
        )

    def _scale(self, table: Table) -> tuple[Fraction, Dimension]:
        node = table.get("scale")
        formula = self.expression(node, "scale", node.span) if node else None
        if formula:
            with self.problems.collecting():
                return constant(formula.tree)
        return Fraction(1), NUMBER


def column_dimension(column: Column) -> Dimension:
    """Return the dimension of what a column gives: its unit times its scale."""
    return product(column.unit.dimension, column.scale[1])
