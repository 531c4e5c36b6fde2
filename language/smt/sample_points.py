"""Sample: points of a question that are tried as witnesses, the same ones on every machine."""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Iterator, Mapping

from language.ir.ops import Compare, Ref
from language.ir.traversal import subexpressions
from language.numerics.evaluate import Scalar, evaluate
from language.smt.query import SolverQuery, Valuation, VariableDomain

SAMPLE_COUNT = 8
"""Points that are tried before z3 is asked: most guards hold at one of them."""
MAX_SAMPLE_COUNT = 64
"""Points that are tried where z3 knows nothing."""
DEFAULT_RANGE = (-10.0, 10.0)
"""Sampled where a state or input gives no range, in SI."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)


def first_sample_points(
    query: SolverQuery, narrowed_domains: Mapping[str, VariableDomain]
) -> Iterator[Valuation]:
    """Yield a few sample points within narrower bounds."""
    extents = {**query.domains, **narrowed_domains}
    for index in range(1, SAMPLE_COUNT):
        yield _sample_point(query, extents, index)


def all_sample_points(query: SolverQuery) -> Iterator[Valuation]:
    """Yield many sample points, each also moved onto the boundaries that conditions name."""
    found = [part for condition in query.conditions for part in subexpressions(condition)]
    relations = [part for part in found if isinstance(part, Compare)]
    for index in range(1, MAX_SAMPLE_COUNT):
        point = _sample_point(query, query.domains, index)
        yield point
        for relation in relations:
            yield from _boundary_points(relation, point, query)


def _sample_point(
    query: SolverQuery, domains: Mapping[str, VariableDomain], index: int
) -> Valuation:
    return {
        name: _sample_value(domains[name], index, position)
        for position, name in enumerate(query.variables)
    }


def _boundary_points(
    relation: Compare, point: Valuation, query: SolverQuery
) -> Iterator[Valuation]:
    for side, other in ((relation.left, relation.right), (relation.right, relation.left)):
        if isinstance(side, Ref) and side.name in point and not side.is_integer:
            try:
                value = evaluate(other, ChainMap(point, dict(query.parameter_values)))
            except (KeyError, OverflowError):
                continue
            yield {**point, side.name: value}


def neighbouring_points(point: Valuation, query: SolverQuery) -> Iterator[Valuation]:
    """Yield a point of z3 and, since it is rounded, neighbours of it along each variable."""
    default = {
        name: extent.default
        for name in point
        if (extent := query.domains[name]).default is not None
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
    if domain.default is not None:
        return domain.default
    if domain.type == "truth":
        return bool(index >> position % 6 & 1)
    if domain.numbers:
        inside = [number for number in domain.numbers if domain.holds(number)]
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
