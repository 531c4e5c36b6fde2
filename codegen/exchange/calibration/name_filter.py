"""Owned: which of the names in a file of calibration data are those of an automaton.

A file of a whole ECU has values of other functions. Where only an automaton's own are wanted,
nothing of the others is looked at: not that they are malformed, nor that one stands twice.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from codegen.exchange.calibration.characteristic import Cell


@dataclass(frozen=True)
class NameFilter:
    """The names that begin with an `owner`'s, or all where there is none; `passed` are the others,
    each where it stood first.
    """

    owner: str = ""
    skipped: dict[str, Cell] = field(default_factory=dict)

    def accepts(self, name: Cell) -> bool:
        """Tell whether a name is wanted; one that is not is noted."""
        if not self.owner or name.text.startswith(f"{self.owner}."):
            return True
        self.skipped.setdefault(name.text, name)
        return False
