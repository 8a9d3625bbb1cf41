"""How to draw an automaton's edges between located circles, for editors that lay nothing out themselves."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias

from tickwise.automata.interchange import layout
from tickwise.automata.model import TimedAutomaton

Point: TypeAlias = tuple[float, float]

COLUMN: Final = 476.0
ROW: Final = 221.0
"""The distances of columns and of rows, in pixels."""

_LOOP, _BOW, _NEAR = 62.0, 76.0, 30.0
_CHARACTER, _LINE = 6.6, 17.0


@dataclass(frozen=True, slots=True)
class Route:
    """Where an edge is drawn.

    Attributes:
        nails: Points that it passes between its ends, in pixels.
        label: The upper left corner of its text, in pixels.
    """

    nails: tuple[Point, ...]
    label: Point


def places(automaton: TimedAutomaton) -> list[Point]:
    """The centre of each location in pixels, y downwards.

    Columns are stages, as in `layout`; each row above the first is half a column further to the right, so that
    the edges of its locations downwards pass beside those below.
    """
    return [((x + max(y, 0) / 2) * COLUMN, -y * ROW) for x, y in layout(automaton)]


def routes(automaton: TimedAutomaton, texts: Sequence[Sequence[str]]) -> list[Route]:
    """A route for each edge: loops point where there is room, edges with the same ends bow apart.

    Args:
        automaton: The timed automaton.
        texts: For each edge the lines of its text.

    Returns:
        The routes, in the order of the edges.
    """
    centres = places(automaton)
    ends = [(edge.source, edge.target) for edge in automaton.edges]
    taken: dict[int, list[float]] = {place: [] for place in range(len(centres))}
    found: dict[int, Route] = {}
    for number, (source, target) in enumerate(ends):
        if source != target:
            rank = sum({source, target} == set(other) for other in ends[:number])
            nail = _bow(centres, source, target, rank)
            found[number] = _between(centres[source], nail, centres[target], texts[number])
            taken[source].append(_angle(centres[source], nail or centres[target]))
            taken[target].append(_angle(centres[target], nail or centres[source]))
    for number, (source, target) in enumerate(ends):
        if source == target:
            direction = _free_direction(taken[source])
            taken[source].append(direction)
            found[number] = _loop(centres[source], direction, texts[number])
    return [found[number] for number in range(len(ends))]


def _bow(centres: Sequence[Point], source: int, target: int, rank: int) -> Point | None:
    """The nail of an edge that is not the first between its ends, or would pass through another location."""
    start, end = centres[source], centres[target]
    blocked = any(_close(start, end, other) for place, other in enumerate(centres) if place not in (source, target))
    if rank == 0 and not blocked:
        return None
    low, high = sorted((start, end))  # one normal for both directions
    length = math.dist(start, end)
    normal = ((high[1] - low[1]) / length, (low[0] - high[0]) / length)
    side = (rank + 1) // 2 * (1 if rank % 2 else -1) + (1.7 if blocked else 0)
    return (
        (start[0] + end[0]) / 2 + normal[0] * side * _BOW,
        (start[1] + end[1]) / 2 + normal[1] * side * _BOW,
    )


def _close(start: Point, end: Point, other: Point) -> bool:
    along = ((other[0] - start[0]) * (end[0] - start[0]) + (other[1] - start[1]) * (end[1] - start[1])) / math.dist(
        start, end
    ) ** 2
    foot = (start[0] + along * (end[0] - start[0]), start[1] + along * (end[1] - start[1]))
    return 0 < along < 1 and math.dist(foot, other) < _NEAR


def _between(start: Point, nail: Point | None, end: Point, text: Sequence[str]) -> Route:
    height, width = _LINE * len(text), _width(text)
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    if nail is not None:  # outwards of the bow
        left = nail[0] - width - 8 if nail[0] < middle[0] else nail[0] + 8
        return Route((nail,), (left, nail[1] - height / 2))
    if abs(start[1] - end[1]) < 1:  # above the line
        return Route((), (middle[0] - width / 2, middle[1] - height - 4))
    if abs(start[0] - end[0]) < 1:
        return Route((), (middle[0] - width - 8, middle[1] - height / 2))
    # to the right of the line and near its source, where other lines are far
    near = (start[0] + 0.35 * (end[0] - start[0]), start[1] + 0.35 * (end[1] - start[1]))
    return Route((), (near[0] + 14, near[1] - height / 2))


def _loop(centre: Point, direction: float, text: Sequence[str]) -> Route:
    nails = tuple(_towards(centre, direction + turn, _LOOP) for turn in (-0.35, 0.35))
    x, y = _towards(centre, direction, _LOOP + 4)
    # the text lies outwards of the loop
    left = x - _width(text) if math.cos(direction) < 0 else x
    return Route(nails, (left, y - _LINE * len(text) if math.sin(direction) < 0 else y))


def _free_direction(taken: Sequence[float]) -> float:
    """The direction that is farthest from all that are taken."""
    candidates = [math.radians(degrees) for degrees in range(-165, 195, 15)]
    return max(candidates, key=lambda angle: round(min((_turn(angle, other) for other in taken), default=0.0), 2))


def _turn(first: float, second: float) -> float:
    return abs((first - second + math.pi) % (2 * math.pi) - math.pi)


def _angle(start: Point, end: Point) -> float:
    return math.atan2(end[1] - start[1], end[0] - start[0])


def _towards(centre: Point, angle: float, distance: float) -> Point:
    return centre[0] + distance * math.cos(angle), centre[1] + distance * math.sin(angle)


def _width(text: Sequence[str]) -> float:
    return _CHARACTER * max(map(len, text), default=0)
