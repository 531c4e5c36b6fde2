"""Sample: points of a question that are tried as witnesses, the same ones on every machine."""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Iterator, Mapping

from language.evaluate import Scalar, evaluate
from language.operation import Compare, Ref
from language.question import Extent, Point, Question
from language.traversal import parts

SAMPLES = 8
"""Points that are tried before z3 is asked: most guards hold at one of them."""
MOST_SAMPLES = 64
"""Points that are tried where z3 knows nothing."""
DEFAULT_RANGE = (-10.0, 10.0)
"""Sampled where a state or input gives no range, in SI."""
PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)


def few_points(question: Question, narrower: Mapping[str, Extent]) -> Iterator[Point]:
    """Yield a few sample points within narrower bounds."""
    extents = {**question.extents, **narrower}
    for index in range(1, SAMPLES):
        yield _sampled_point(question, extents, index)


def many_points(question: Question) -> Iterator[Point]:
    """Yield many sample points, each also moved onto the boundaries that conditions name."""
    found = [part for condition in question.conditions for part in parts(condition)]
    relations = [part for part in found if isinstance(part, Compare)]
    for index in range(1, MOST_SAMPLES):
        point = _sampled_point(question, question.extents, index)
        yield point
        for relation in relations:
            yield from _on_boundary(relation, point, question)


def _sampled_point(question: Question, extents: Mapping[str, Extent], index: int) -> Point:
    return {
        name: _sample(extents[name], index, position)
        for position, name in enumerate(question.variables)
    }


def _on_boundary(relation: Compare, point: Point, question: Question) -> Iterator[Point]:
    for side, other in ((relation.left, relation.right), (relation.right, relation.left)):
        if isinstance(side, Ref) and side.name in point and not side.whole:
            try:
                value = evaluate(other, ChainMap(point, dict(question.values)))
            except (KeyError, OverflowError):
                continue
            yield {**point, side.name: value}


def near(point: Point, question: Question) -> Iterator[Point]:
    """Yield a point of z3 and, since it is rounded, neighbours of it along each variable."""
    default = {
        name: extent.default
        for name in point
        if (extent := question.extents[name]).default is not None
    }
    yield {**point, **default}
    yield point
    for name, value in point.items():
        if isinstance(value, float):
            for towards in (-math.inf, math.inf):
                yield {**point, name: math.nextafter(value, towards)}
    for index in range(1, SAMPLES):
        for position, name in enumerate(point):
            yield {**point, name: _sample(question.extents[name], index, position)}


def _sample(extent: Extent, index: int, position: int) -> Scalar:
    if extent.default is not None:
        return extent.default
    if extent.type == "truth":
        return bool(index >> position % 6 & 1)
    if extent.numbers:
        inside = [number for number in extent.numbers if extent.holds(number)]
        return inside[index % len(inside)] if inside else extent.numbers[0]
    low = DEFAULT_RANGE[0] if extent.low is None else float(extent.low)
    high = DEFAULT_RANGE[1] if extent.high is None else float(extent.high)
    low, high = min(low, high), max(low, high)
    fraction = _radical_inverse(index, PRIMES[position % len(PRIMES)])
    value = low + fraction * (high - low)
    return math.floor(value) if extent.type == "whole" else value


def _radical_inverse(index: int, base: int) -> float:
    """Return the van der Corput number of an index in a base, in [0, 1)."""
    result, scale = 0.0, 1.0 / base
    while index > 0:
        index, digit = divmod(index, base)
        result += digit * scale
        scale /= base
    return result
