"""Documents: load specs by name or path, apply calibrations and parse parameter values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from language.loading.load import command_line_value
from language.overlays.expand_document import Project, add_calibrations, read_document
from language.text.document import Document, ScalarNode

Values = Mapping[str, str]
"""Parameter values as text with units, by `parameter` or `instance.parameter`."""


def load_calibrated_document(
    reference: str, project: Project, calibrations: Sequence[str]
) -> Document:
    """Return the document of a spec with calibrations, by name or path, added after its own.

    Later calibrations override earlier ones when the document is expanded; they are not read here.
    Raises SpecError if the spec cannot be found or read.
    """
    document = read_document(project.path_of(reference))
    return add_calibrations(document, calibrations, "--calibration")


def parse_values(values: Values | None) -> dict[str, ScalarNode]:
    """Return parameter values as scalar nodes by name; empty for None.

    The texts are checked by the reader of the spec only, which places their problems at `--set`.
    """
    return {name: command_line_value(text, name=name) for name, text in (values or {}).items()}
