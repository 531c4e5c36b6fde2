"""Typing context: the interface of the type checker for the functions that type calls."""

from __future__ import annotations

from typing import Protocol

from language.expressions.syntax_tree import SyntaxTree
from language.expressions.units import Dimension
from language.text.diagnostic import Problems, Span
from language.typecheck.environment import NameEnvironment
from language.typecheck.types import ExprType


class TypingContext(Protocol):
    """Inference and checks of types in an environment; `infer.TypeChecker` implements it."""

    environment: NameEnvironment
    problems: Problems

    def inside_memory_function(self, *functions: str) -> TypingContext:
        """Return the context for an argument of a function with memory.

        Of the functions with memory only `functions` are allowed there.
        """

    def infer_type(self, tree: SyntaxTree) -> ExprType | None:
        """Return the type of an expression; None if a problem was reported inside it."""

    def require_real(self, kind: ExprType | None, tree: SyntaxTree) -> Dimension | None:
        """Return the dimension of a type used as a real; report another type and return None."""

    def check_quantity(self, tree: SyntaxTree, expected: Dimension, what: str) -> None:
        """Report an expression that is not a quantity of the expected dimension."""

    def check_condition(self, tree: SyntaxTree, what: str) -> None:
        """Report an expression that is not a condition."""

    def unify_dimensions(
        self,
        a: SyntaxTree,
        left: Dimension,
        b: SyntaxTree,
        right: Dimension,
        span: Span,
        what: str,
    ) -> Dimension | None:
        """Return the common dimension of two operands.

        Report operands that do not fit and return None.
        """

    def report(self, kind: str, span: Span, label: str, help: str = "") -> None:
        """Report a problem as an error."""
