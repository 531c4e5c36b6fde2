"""Name filter: selects the names of one automaton in a calibration file.

The file of a whole ECU contains values of other functions. If only those of one automaton are read,
the others are not checked: malformed or duplicate entries among them are no problem.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from codegen.exchange.calibration.characteristic import Cell


@dataclass(frozen=True)
class NameFilter:
    """A filter that accepts names that begin with `owner` and a dot; all names if `owner` is empty.

    `skipped` collects the rejected names, each with its first occurrence.
    """

    owner: str = ""
    skipped: dict[str, Cell] = field(default_factory=dict)

    def accepts(self, name: Cell) -> bool:
        """Tell whether the filter accepts a name.

        The first occurrence of a rejected name is stored in `skipped`.
        """
        if not self.owner or name.text.startswith(f"{self.owner}."):
            return True
        self.skipped.setdefault(name.text, name)
        return False
