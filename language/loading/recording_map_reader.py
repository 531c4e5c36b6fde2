"""Recording map reader: the assignment of the columns of a recording to signals."""

from __future__ import annotations

from fractions import Fraction
from typing import Literal, cast

from language.expressions.constant_literal import evaluate_literal
from language.expressions.units import (
    NO_UNIT,
    PURE_NUMBER,
    SECOND,
    Dimension,
    are_compatible,
    dimension_product,
    parse_unit,
)
from language.model.system import (
    ALL_FILES,
    CanDatabase,
    ColumnMapping,
    RecordingMap,
    TextFormat,
    Window,
)
from language.overlays.expand_document import Project, expand_document
from language.readers.base_reader import Reader
from language.text.diagnostic import Problems, Span
from language.text.document import (
    Document,
    Entry,
    MappingNode,
    ScalarNode,
    SequenceNode,
    YamlNode,
    require_kind,
)

MAP_KEYS = ("language", "map", "time", "columns", "constants", "windows", "dbc", "csv")
COLUMN_KEYS = (
    "column mean to compare unit file_unit scale sign delay hold blank time".split()  # noqa: SIM905
)

CSV_KEYS = ("separator", "decimal", "encoding", "head", "units")
SEPARATORS = {"comma": ",", "semicolon": ";", "tab": "\t", "bar": "|"}
"""Separators of cells by their word in a map."""
DECIMAL_SIGNS = {"point": ".", "comma": ","}
"""Decimal signs by their word in a map."""
ENCODINGS = (
    *("utf-8", "utf-16", "utf-16-le", "utf-16-be"),
    *("cp1252", "cp1250", "latin-1", "shift-jis"),
)
"""Encodings of text recordings that a map can state."""
MAX_HEAD_LINE = 10_000
"""Largest number of the line with the names of columns."""


def read_map(document: Document, project: Project) -> RecordingMap:
    """Return the recording map of a document. Raises SpecError with all problems.

    Overlays are expanded first. Another kind of document is an error.
    """
    document = expand_document(document, project)
    problems = Problems()
    require_kind(document, "map", problems)
    problems.raise_if_errors()
    mapping = read_map_table(document.root, document.name, document.name_span, problems)
    problems.raise_if_errors()
    return mapping


def read_map_table(root: MappingNode, name: str, span: Span, problems: Problems) -> RecordingMap:
    """Return the recording map in a mapping; problems are reported.

    `span` places problems of the whole map. Without `time` the column of time is "" and its unit s.
    A column reads the source column of its own name unless `column` or `mean` is given. Defaults:
    `hold: previous`, `blank: refuse`, `sign: 1`, scale 1, delay 0 s, unit 1. A bare list of windows
    applies to ALL_FILES.

    Reported are a map without columns, both or neither of `to` and `compare`, wrong units and
    windows that overlap.
    """
    return _MapReader(problems).read(root, name, span)


class _MapReader(Reader):
    """Reads the sections of a recording map."""

    def read(self, root: MappingNode, name: str, span: Span) -> RecordingMap:
        """Return the recording map; without `time` the unit of time is s."""
        tree = self.read_mapping(root, f"map {name}", MAP_KEYS)
        time = self.read_mapping(tree.get("time"), "time", ("column", "unit", "date_order"))
        has_time = "time" in tree.entries
        unit = self.read_unit(time.get("unit")) if has_time else parse_unit("s")
        if not are_compatible(unit.dimension, SECOND):
            self.problems.error(
                "unit", time.span if time.entries else span, "the unit of `time` is a time"
            )
        order = self.read_choice(time.get("date_order"), "date_order", ("DMY", "MDY"), "")
        constants: dict[str, tuple[Fraction, Dimension]] = {}
        for entry in self.named_entries(tree.get("constants"), "constants"):
            value, own = self.read_quantity(entry.node, entry.key, entry.span, None)
            constants[entry.key] = value, own.dimension
        columns = [
            self._read_column(entry) for entry in self.read_mapping(tree.get("columns"), "columns")
        ]
        if not columns:
            self.problems.error("missing", span, "a map has at least one column in `columns`")
        return RecordingMap(
            name=name,
            time=self.read_string(time.get("column"), "time.column", span) if has_time else "",
            time_unit=unit,
            columns={column.name: column for column in columns},
            constants=constants,
            span=span,
            windows=self._read_windows(tree.get("windows")),
            databases=self._read_databases(tree.get("dbc")),
            text_format=self._read_text_format(tree.get("csv")),
            date_order=order,
        )

    def _read_text_format(self, node: YamlNode | None) -> TextFormat:
        """Return the format of text files that the map states; without `csv` all is detected."""
        if node is None:
            return TextFormat()
        table = self.read_mapping(node, "csv", CSV_KEYS)
        separator = self.read_choice(table.get("separator"), "separator", SEPARATORS, "")
        decimal = self.read_choice(table.get("decimal"), "decimal", DECIMAL_SIGNS, "")
        head, units = (
            self.read_integer(table.get(key), f"csv.{key}", 0, 1, MAX_HEAD_LINE)
            for key in ("head", "units")
        )
        if units and units <= head:
            label = "the line of units stands below the head line"
            self.problems.error("range", node.span, label)
        return TextFormat(
            separator=SEPARATORS.get(separator, ""),
            decimal=DECIMAL_SIGNS.get(decimal, ""),
            encoding=self.read_choice(table.get("encoding"), "encoding", ENCODINGS, ""),
            head=head,
            units=units,
        )

    def _read_databases(self, node: YamlNode | None) -> tuple[CanDatabase, ...]:
        """Return the DBC files: one, a list, or one or a list for each bus."""
        if isinstance(node, MappingNode):
            for entry in node:
                if not entry.key.strip():
                    self.problems.error("form", entry.span, "the name of a bus is empty")
            return tuple(
                CanDatabase(file, entry.key)
                for entry in node
                for file in self._files_of(entry.node)
            )
        return tuple(CanDatabase(file) for file in self._files_of(node))

    def _files_of(self, node: YamlNode | None) -> tuple[ScalarNode, ...]:
        """Return the names of DBC files: a single one or a list."""
        names = (node,) if isinstance(node, ScalarNode) else tuple(self.read_list(node, "dbc"))
        for name in names:
            self.check_file_name(name.text, name.span, "dbc")
        return names

    def _read_windows(self, node: YamlNode | None) -> dict[str, tuple[Window, ...]]:
        """Return the windows by file name; a bare list applies to all files."""
        if node is None:
            return {}
        if not isinstance(node, MappingNode):
            return {ALL_FILES: self._read_window_list(node)}
        for entry in node:
            self.check_file_name(entry.key, entry.span, "windows")
        return {entry.key: self._read_window_list(entry.node) for entry in node}

    def _read_window_list(self, node: YamlNode) -> tuple[Window, ...]:
        """Return the windows of a list; windows must be ordered and must not overlap."""
        windows: list[Window] = []
        if not isinstance(node, SequenceNode) or not node.nodes:
            label = "`windows` is a list like `[[1 s, 8 s]]`, or such a list for each file"
            self.problems.error("form", node.span, label)
            return ()
        for item in node.nodes:
            if not isinstance(item, SequenceNode) or len(item.nodes) != 2:
                self.problems.error(
                    "form", item.span, "a window is `[from, to]`, like `[1 s, 8 s]`"
                )
                continue
            start, end = (self._read_time(part) for part in item.nodes)
            if end <= start:
                self.problems.error("range", item.span, "a window ends after it starts")
            elif windows and start <= windows[-1][1]:
                label = "this window starts before the one above it ends"
                self.problems.error("range", item.span, label, "windows stand in order")
            windows.append((start, end))
        return tuple(windows)

    def _read_time(self, node: YamlNode) -> Fraction:
        """Return a time [s]; another dimension is reported."""
        value, unit = self.read_quantity(node, "a window", node.span, None)
        if value and not are_compatible(unit.dimension, SECOND):
            self.problems.error("dimension", node.span, "a window is in time, like `[1 s, 8 s]`")
        return value

    def _read_column(self, entry: Entry) -> ColumnMapping:
        """Return one column of the map; contradictory and missing keys are reported."""
        what = f"columns.{entry.key}"
        table = self.read_mapping(entry.node, what, COLUMN_KEYS)
        mean = table.get("mean")
        names = [item.text for item in self.read_list(mean, f"{what}.mean")]
        if isinstance(mean, SequenceNode) and not mean.nodes:
            label = "`mean` is a list of at least one column"
            self.problems.error("missing", mean.span, label)
        column = table.get("column")
        if not names:
            names = [self.read_string(column, "column", entry.span) if column else entry.key]
        elif column:
            self.problems.error("form", entry.span, "`column` and `mean` exclude each other")
        to, compare = table.get("to"), table.get("compare")
        if (to is None) == (compare is None):
            label = "a column has `to` (an input) or `compare` (an output)"
            self.problems.error("missing", entry.span, label)
        hold = self.read_choice(table.get("hold"), "hold", ("previous", "linear"), "")
        blank = self.read_choice(table.get("blank"), "blank", ("refuse", "skip"), "refuse")
        delay = table.get("delay")
        shift, unit = (
            self.read_quantity(delay, "delay", delay.span, None)
            if delay
            else (Fraction(0), NO_UNIT)
        )
        if delay and ((shift and not are_compatible(unit.dimension, SECOND)) or shift < 0):
            self.problems.error("unit", delay.span, "`delay` is a time of at least 0 s")
        time = table.get("time")
        return ColumnMapping(
            name=entry.key,
            columns=tuple(names),
            to=self.read_reference(to, "to") if to else None,
            compare=self.read_reference(compare, "compare") if compare else None,
            unit=self.read_unit(table.get("unit")),
            scale=self._read_scale(table),
            sign=int(self.read_choice(table.get("sign"), "sign", ("1", "-1"), "1")),
            delay=shift,
            blank=cast(Literal["refuse", "skip"], blank),
            time=self.read_string(time, "time", entry.span) if time else None,
            span=entry.span,
            hold=cast(Literal["previous", "linear"], hold) if hold else None,
            file_unit=self.read_string(table.get("file_unit"), "file_unit", entry.span)
            if "file_unit" in table.entries
            else "",
        )

    def _read_scale(self, table: MappingNode) -> tuple[Fraction, Dimension]:
        """Return the factor of `scale` in SI and its dimension; 1 without it."""
        node = table.get("scale")
        formula = self.read_expression(node, "scale", node.span) if node else None
        if formula:
            with self.problems.collect_errors():
                return evaluate_literal(formula.tree)
        return Fraction(1), PURE_NUMBER


def column_dimension(column: ColumnMapping) -> Dimension:
    """Return the dimension of the signal of a column: its unit times its scale."""
    return dimension_product(column.unit.dimension, column.scale[1])
