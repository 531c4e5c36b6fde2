"""Arrow: pyarrow with its Parquet, where it is installed."""

from __future__ import annotations

from types import ModuleType

from language.text.diagnostic import MissingToolError


def import_pyarrow(feature: str, hint: str = "") -> ModuleType:
    """Return pyarrow for what needs it. Raises ToolMissing, with what to do `hint`."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingToolError(
            f"{feature} needs the package `pyarrow`: pip install 'modewright[parquet]'{hint}"
        ) from None
    found: ModuleType = pyarrow
    return found
