"""Value numbering: equal operations on equal numbers have equal numbers (Cocke, Schwartz 1970).

A variable that is written gets a new version, and with it a new number.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable

from language.ir.ops import Call, Expr, Item, Ref, Select, Value
from language.ir.rewrite_ops import operands


class ValueNumbering:
    """The numbers of the values of expressions at one point of a sequence of operations.

    `versions` counts the writes to each variable. `number_by_name` may give a variable the number
    of the value that it holds.
    """

    def __init__(self) -> None:
        self.versions: Counter[str] = Counter()
        self.number_by_name: dict[str, int] = {}
        self._numbers: dict[Hashable, int] = {}

    def number_of(self, expr: Expr) -> int:
        """Return the number of the value of an expression; a new value gets the next number."""
        label: Hashable = None
        match expr:
            case Ref(name) if name in self.number_by_name:
                return self.number_by_name[name]
            case Value(value):
                label = repr(value)  # 0.0 and -0.0, 1 and 1.0 are equal, but not the same value
            case Ref(name) | Item(name):
                label = name, self.versions[name]
            case Call(function):
                label = function
            case Select():
                pass
            case _:
                label = expr.operator
        key = type(expr), label, *map(self.number_of, operands(expr))
        return self._numbers.setdefault(key, len(self._numbers))
