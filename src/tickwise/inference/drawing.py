"""Geometry of a drawing: trajectories over time, on the windows and ranges that a formula's primitives look at."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tickwise._seeding import generator
from tickwise.errors import FormulaError
from tickwise.inference.axis import Axis, Frame, Tick
from tickwise.inference.explanation import Explanation
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import Operator, Primitive, to_sdnf
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Bound, Box, Formula

WIDTH, HEIGHT = 600, 290
LEFT, RIGHT, TOP, BOTTOM = 50, 590, 8, 252
"""The size of a panel and where its axes end, in units of the drawing."""

LONGEST_NAME = 16
"""Letters of a trajectory's id that are shown."""

_LETTER, _LINE = 8.0, 14.0  # room that a letter and a line of text take
_HALF = 0.35  # how far a window reaches beyond its first and last tick, in ticks


@dataclass(frozen=True, slots=True)
class Line:
    """A trajectory in a panel.

    Attributes:
        name: Its id.
        label: Its label, 1 or -1.
        points: Its states as SVG has points.
        place: Where its name has room, near its last state.
        beside: Whether that is beside the axes, where the name ends rather than begins.
        breaks: Where it first leaves what it may never leave: the states that violate a part with □.
    """

    name: str
    label: int
    points: str
    place: tuple[float, float]
    beside: bool
    breaks: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Mark:
    """A window of ticks × a range of values that a primitive looks at.

    Attributes:
        name: Name and operator of the primitive.
        outside: Whether the predicate is the complement: the state is to be outside the box.
        frame: Where it is.
        rest: Where the outer window ends and only the inner one goes on, if the operator is nested.
        place: Where its name has room, at its upper left corner.
    """

    name: str
    outside: bool
    frame: Frame
    rest: float | None
    place: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Panel:
    """One variable over time.

    Attributes:
        variable: Its name.
        lines: The trajectories, those with label -1 first.
        marks: What the primitives look at.
        across: Ticks of the axis of time.
        up: Ticks of the axis of values.
        right: Where the axis of time ends.
    """

    variable: str
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...]
    across: tuple[Tick, ...]
    up: tuple[Tick, ...]
    right: float


def primitive_of(part: Formula) -> Primitive | None:
    """A part of a formula as a primitive; None where it is not a single one."""
    try:
        disjuncts = to_sdnf(part).disjuncts
    except FormulaError:
        return None
    single = len(disjuncts) == 1 and len(disjuncts[0].primitives) == 1
    return disjuncts[0].primitives[0] if single else None


def sample(data: LabelledTrajectories, most: int) -> NDArray[np.int64]:
    """Rows to draw: at most so many of each label, drawn without replacement by a fixed seed, in ascending order."""
    chosen = []
    for label in (1, -1):
        rows = np.flatnonzero(data.labels == label)
        if len(rows) > most:
            rows = generator(0, "drawing", label).choice(rows, most, replace=False)
        chosen.append(rows)
    return np.sort(np.concatenate(chosen))


def draw(
    found: Explanation,
    data: LabelledTrajectories,
    rows: NDArray[np.int64],
    variables: Iterable[str],
    *,
    named: bool = False,
) -> tuple[Panel, ...]:
    """Draw trajectories, a panel a variable.

    Args:
        found: The formula.
        data: All trajectories; they and the formula say what range the axes have.
        rows: Which of them to draw.
        variables: Which variables to draw.
        named: Whether to leave room beside the axes for the trajectories' names.

    Returns:
        The panels.
    """
    known = named_primitives(found)
    longest = max((len(data.ids[row]) for row in rows), default=0) if named else 0
    right = RIGHT - _LETTER * min(longest, LONGEST_NAME)
    return tuple(_panel(variable, known, data, rows, right) for variable in variables)


def named_primitives(found: Explanation) -> tuple[tuple[str, Primitive], ...]:
    """Those parts of a formula that are primitives, with their names."""
    primitives = [(each.name, primitive_of(each.formula)) for each in found.separations]
    known = [(name, primitive) for name, primitive in primitives if primitive is not None]
    if len({separation.disjunct for separation in found.separations}) < 2:  # “1.2” says no more than “2” then
        known = [(name.partition(".")[2], primitive) for name, primitive in known]
    return tuple(known)


def _panel(
    variable: str,
    known: Sequence[tuple[str, Primitive]],
    data: LabelledTrajectories,
    rows: NDArray[np.int64],
    right: float,
) -> Panel:
    states = data.values[..., data.variables.index(variable)]
    bounds = [
        (name, primitive, bound)
        for name, primitive in known
        for bound in primitive.box.bounds
        if bound.variable == variable
    ]
    time = Axis(0, max(data.horizon, 1), LEFT, right)
    axis = Axis.around(states, [side for *_, bound in bounds for side in (bound.lower, bound.upper)], BOTTOM, TOP)
    order = rows[np.argsort(data.labels[rows], kind="stable")].tolist()
    names = _Names(right)
    beside = _apart([axis.place(float(states[row, data.lengths[row] - 1])) for row in order])
    marks = tuple(_mark(name, primitive, bound, time, axis, names) for name, primitive, bound in bounds)
    lines = []
    for row, level in zip(order, beside, strict=True):
        path = states[row, : data.lengths[row]]
        places = [(time.place(tick), axis.place(value)) for tick, value in enumerate(path.tolist())]
        x, y = places[-1]
        outside = right < RIGHT and x == right
        width = _LETTER * min(len(data.ids[row]), LONGEST_NAME)
        place = (WIDTH - 2.0, level + 4) if outside else names.place(x - width, y - 5, width)
        breaks = tuple(
            places[tick] for tick in _breaks(row, [(primitive, bound) for _, primitive, bound in bounds], data)
        )
        points = " ".join(f"{x:g},{y:g}" for x, y in places)
        lines.append(Line(data.ids[row], int(data.labels[row]), points, place, outside, breaks))
    return Panel(variable, tuple(lines), marks, time.ticks(8, whole=True), axis.ticks(6), right)


def _breaks(row: int, bounds: Iterable[tuple[Primitive, Bound]], data: LabelledTrajectories) -> list[int]:
    """The first tick at which a trajectory is not where it should always be, if the bound has a part in that."""
    ticks = set()
    for primitive, bound in bounds:
        if primitive.operator == Operator.ALWAYS:
            states = data.values[row, primitive.start : min(primitive.end + 1, int(data.lengths[row]))]
            wrong = np.flatnonzero(~holds(primitive.predicate, states, data.variables))[:1]
            inside = holds(Box((bound,)), states[wrong], data.variables)
            ticks |= {primitive.start + int(tick) for tick in wrong[inside == primitive.complemented]}
    return sorted(ticks)


def _apart(levels: Sequence[float]) -> list[float]:
    """Levels in the same order from top to bottom, but a line of text apart and above the end of the axis."""
    order = np.argsort(levels, kind="stable").tolist()
    found = np.array(levels, dtype=np.float64)
    for above, below in pairwise(order):
        found[below] = max(found[below], found[above] + _LINE)
    for below, above in pairwise([None, *reversed(order)]):
        found[above] = min(found[above], BOTTOM if below is None else found[below] - _LINE)
    return [round(float(level), 1) for level in found]


class _Names:
    """Finds room for names: each goes down, and at the bottom up, until it covers no other."""

    def __init__(self, right: float) -> None:
        self._right = right
        self._taken: list[tuple[float, float, float]] = []

    def place(self, x: float, y: float, width: float) -> tuple[float, float]:
        """Room for a name of some width, as near as may be to where its left end should be."""
        x = min(max(x, LEFT + 2), self._right - width)
        downward = [y + step * _LINE for step in range(int((BOTTOM - TOP) / _LINE))]
        upward = [y - step * _LINE for step in range(int((BOTTOM - TOP) / _LINE))]
        inside = [place for place in (*downward, *upward) if TOP + 10 <= place <= BOTTOM - 3]
        free = (place for place in inside if all(self._apart(x, place, width, other) for other in self._taken))
        y = next(free, y)
        self._taken.append((x, y, width))
        return round(x, 1), round(y, 1)

    @staticmethod
    def _apart(x: float, y: float, width: float, other: tuple[float, float, float]) -> bool:
        return abs(y - other[1]) >= _LINE or x >= other[0] + other[2] or other[0] >= x + width


def _mark(name: str, primitive: Primitive, bound: Bound, time: Axis, axis: Axis, names: _Names) -> Mark:
    window = primitive.start - _HALF, primitive.end + _HALF
    frame = Frame.of(time, window, axis, (bound.lower, bound.upper))
    rest = time.place(primitive.window.end + _HALF) if primitive.operator.nested else None
    shown = f"{name} {primitive.operator.symbol}{'¬' if primitive.complemented else ''}"
    below = frame.y + 15 if frame.height > 18 else frame.y - 4
    return Mark(shown, primitive.complemented, frame, rest, names.place(frame.x + 5, below, _LETTER * len(shown)))
