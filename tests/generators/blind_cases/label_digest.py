"""The labels file and its seal."""

import hashlib
import json
from pathlib import Path
from typing import Any

FORMAT = "concealed-labels-1"


def write_labels(path: Path, cases: dict[str, dict[str, Any]]) -> None:
    """Write the labels, cases in the order of their names."""
    content = {"format": FORMAT, "cases": dict(sorted(cases.items()))}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((json.dumps(content, indent=1) + "\n").encode("ascii"))


def seal_digest(labels_path: str | Path) -> str:
    """SHA-256 of the labels file: published before the tool is run, checked after."""
    return hashlib.sha256(Path(labels_path).read_bytes()).hexdigest()
