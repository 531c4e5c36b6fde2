"""Checker protocol: the interface of the type checker for the functions that type calls."""

from __future__ import annotations

from typing import Protocol

from language.expressions.syntax_tree import SyntaxTree
from language.expressions.units import Dimension
from language.text.diagnostic import Problems, Span
from language.typecheck.name_environment import NameEnvironment
from language.typecheck.types import ExprType


class TypingContext(Protocol):
    """Inference and checks of types in an environment; `infer.TypeChecker` implements it."""

    environment: NameEnvironment
    problems: Problems

    def inside_memory_function(self, *functions: str) -> TypingContext:
        """Return the context for an argument of a function with memory, with the same problems.

        Of the functions with memory that are allowed here only `functions` are allowed there.
        """

    def infer_type(self, tree: SyntaxTree) -> ExprType | None:
        """Return the type of an expression, and report the problems inside it.

        The result is None if the expression has no type.
        """

    def require_real(self, kind: ExprType | None, tree: SyntaxTree) -> Dimension | None:
        """Return the dimension of a type used as a real; report another type and return None.

        A whole number is a pure number; None stays None without a report. `tree` gives the place.
        """

    def check_quantity(self, tree: SyntaxTree, expected: Dimension, what: str) -> None:
        """Report an expression that is not a quantity of the expected dimension.

        `what` names the target in the message. A 0 without a unit has any dimension.
        """

    def check_condition(self, tree: SyntaxTree, what: str) -> None:
        """Report an expression that is not a truth value; `what` names the place in the message."""

    def unify_dimensions(
        self,
        a: SyntaxTree,
        left: Dimension,
        b: SyntaxTree,
        right: Dimension,
        span: Span,
        what: str,
    ) -> Dimension | None:
        """Return the common dimension of the operands `a` and `b` of dimensions `left` and `right`.

        Operands that are not compatible are reported at `span`, with `what` as the operator, and
        give None. A 0 without a unit takes the dimension of the other operand.
        """

    def report(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Report a problem as an error in `problems`."""
