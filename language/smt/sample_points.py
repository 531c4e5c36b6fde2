"""Sample points: deterministic candidate witnesses of a query from a low-discrepancy sequence.

Coordinates are van der Corput numbers in a prime base for each variable (Halton 1960).
"""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Iterator, Mapping

from language.ir.ops import Compare, Ref
from language.ir.traversal import subexpressions
from language.numerics.evaluate import Scalar, evaluate
from language.smt.query import SolverQuery, Valuation, VariableDomain

SAMPLE_COUNT = 8
"""One more than the number of points that are tried before z3; most guards hold at one of them."""
MAX_SAMPLE_COUNT = 64
"""One more than the number of points that are tried if z3 gives no answer."""
DEFAULT_RANGE = (-10.0, 10.0)
"""Sampled interval of a variable without a range, in SI units."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
"""Bases of the sequence, one for each position of a variable."""


def first_sample_points(
    query: SolverQuery, narrowed_domains: Mapping[str, VariableDomain]
) -> Iterator[Valuation]:
    """Yield `SAMPLE_COUNT - 1` points within the narrowed domains; equal ones at each call.

    A point has a value for each variable that the conditions depend on: its default, else a number
    of a Halton sequence in the range (DEFAULT_RANGE for absent bounds). `narrowed_domains` replace
    those of the query by name. Whether the conditions hold is not checked.
    """
    domains = {**query.domains, **narrowed_domains}
    for index in range(1, SAMPLE_COUNT):
        yield _sample_point(query, domains, index)


def all_sample_points(query: SolverQuery) -> Iterator[Valuation]:
    """Yield `MAX_SAMPLE_COUNT - 1` points, each followed by its projections onto boundaries.

    The points are within the domains of the query. A projection gives a real variable that is one
    side of a relation of the conditions the value of the other side, which may be outside its
    domain.
    """
    parts = [part for condition in query.conditions for part in subexpressions(condition)]
    relations = [part for part in parts if isinstance(part, Compare)]
    for index in range(1, MAX_SAMPLE_COUNT):
        point = _sample_point(query, query.domains, index)
        yield point
        for relation in relations:
            yield from _boundary_points(relation, point, query)


def _sample_point(
    query: SolverQuery, domains: Mapping[str, VariableDomain], index: int
) -> Valuation:
    """Return the point of an index: a value for each variable of the query."""
    return {
        name: _sample_value(domains[name], index, position)
        for position, name in enumerate(query.variables)
    }


def _boundary_points(
    relation: Compare, point: Valuation, query: SolverQuery
) -> Iterator[Valuation]:
    """Yield copies of a point at which both sides of a relation are equal.

    One side has to be a real variable, which gets the value of the other side. A side that cannot
    be evaluated is skipped.
    """
    for side, other in ((relation.left, relation.right), (relation.right, relation.left)):
        if isinstance(side, Ref) and side.name in point and not side.is_integer:
            try:
                value = evaluate(other, ChainMap(point, dict(query.parameter_values)))
            except (KeyError, OverflowError):
                continue
            yield {**point, side.name: value}


def neighbouring_points(point: Valuation, query: SolverQuery) -> Iterator[Valuation]:
    """Yield a point of z3, its floating-point neighbours, and copies with one sampled coordinate.

    The order is: the point with the defaults of the domains, the point itself, the points with one
    float coordinate moved down and up by one float, then those with one sampled coordinate: for
    each of `SAMPLE_COUNT - 1` indices each coordinate in turn. A sampled coordinate with a default
    is its default. Points may repeat, and neighbours may lie outside the domains; whether the query
    holds is not checked. Neighbours are tried because the solution of z3 is rounded. KeyError for a
    name without a domain.
    """
    default = {
        name: domain.default
        for name in point
        if (domain := query.domains[name]).default is not None
    }
    yield {**point, **default}
    yield point
    for name, value in point.items():
        if isinstance(value, float):
            for towards in (-math.inf, math.inf):
                yield {**point, name: math.nextafter(value, towards)}
    for index in range(1, SAMPLE_COUNT):
        for position, name in enumerate(point):
            yield {**point, name: _sample_value(query.domains[name], index, position)}


def _sample_value(domain: VariableDomain, index: int, position: int) -> Scalar:
    """Return the value of an index for the variable at a position.

    The default has precedence; bools and finite sets are cycled through; numbers are spread over
    the range.
    """
    if domain.default is not None:
        return domain.default
    if domain.type == "truth":
        return bool(index >> position % 6 & 1)
    if domain.numbers:
        inside = [number for number in domain.numbers if domain.contains(number)]
        return inside[index % len(inside)] if inside else domain.numbers[0]
    low = DEFAULT_RANGE[0] if domain.low is None else float(domain.low)
    high = DEFAULT_RANGE[1] if domain.high is None else float(domain.high)
    low, high = min(low, high), max(low, high)
    fraction = _radical_inverse(index, PRIMES[position % len(PRIMES)])
    value = low + fraction * (high - low)
    return math.floor(value) if domain.type == "whole" else value


def _radical_inverse(index: int, base: int) -> float:
    """Return the van der Corput number of an index in a base, in [0, 1)."""
    result, scale = 0.0, 1.0 / base
    while index > 0:
        index, digit = divmod(index, base)
        result += digit * scale
        scale /= base
    return result
