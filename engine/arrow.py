"""Arrow: pyarrow with its Parquet, where it is installed."""

from __future__ import annotations

from types import ModuleType

from language.missing import ToolMissing


def arrow_for(what: str, instead: str = "") -> ModuleType:
    """Return pyarrow for what needs it. Raises ToolMissing, with what to do `instead`."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ToolMissing(
            f"{what} needs the package `pyarrow`: pip install 'modewright[parquet]'{instead}"
        ) from None
    found: ModuleType = pyarrow
    return found
