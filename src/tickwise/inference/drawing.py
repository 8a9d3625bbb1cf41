"""Geometry of a drawing: trajectories over time, on the windows and ranges that a formula's primitives look at."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise._seeding import generator
from tickwise.errors import FormulaError
from tickwise.inference.explanation import Explanation
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import Primitive, to_sdnf
from tickwise.logic.syntax import Bound, Formula

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
    """

    name: str
    label: int
    points: str
    place: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Mark:
    """A window of ticks × a range of values that a primitive looks at.

    Attributes:
        name: Name and operator of the primitive.
        outside: Whether the predicate is the complement: the state is to be outside the box.
        x: Left end.
        y: Upper end.
        width: Along time.
        height: Along values.
        rest: Where the outer window ends and only the inner one goes on, if the operator is nested.
        place: Where its name has room, at its upper left corner.
    """

    name: str
    outside: bool
    x: float
    y: float
    width: float
    height: float
    rest: float | None
    place: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick of an axis: where it is, and what it says."""

    place: float
    text: str


@dataclass(frozen=True, slots=True)
class Panel:
    """One variable over time.

    Attributes:
        variable: Its name.
        lines: The trajectories, those with label -1 first.
        marks: What the primitives look at.
        across: Ticks of the axis of time.
        up: Ticks of the axis of values.
    """

    variable: str
    lines: tuple[Line, ...]
    marks: tuple[Mark, ...]
    across: tuple[Tick, ...]
    up: tuple[Tick, ...]


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
    found: Explanation, data: LabelledTrajectories, rows: NDArray[np.int64], variables: Iterable[str]
) -> tuple[Panel, ...]:
    """Draw trajectories, a panel a variable.

    Args:
        found: The formula.
        data: All trajectories; they and the formula say what range the axes have.
        rows: Which of them to draw.
        variables: Which variables to draw.

    Returns:
        The panels.
    """
    primitives = [(each.name, primitive_of(each.formula)) for each in found.separations]
    known = [(name, primitive) for name, primitive in primitives if primitive is not None]
    if len({separation.disjunct for separation in found.separations}) < 2:  # “1.2” says no more than “2” then
        known = [(name.partition(".")[2], primitive) for name, primitive in known]
    return tuple(_panel(variable, known, data, rows) for variable in variables)


def _panel(
    variable: str, known: Sequence[tuple[str, Primitive]], data: LabelledTrajectories, rows: NDArray[np.int64]
) -> Panel:
    states = data.values[..., data.variables.index(variable)]
    bounds = [
        (name, primitive, bound)
        for name, primitive in known
        for bound in primitive.box.bounds
        if bound.variable == variable
    ]
    scale = _Scale.of(states, data.horizon, [bound for _, _, bound in bounds])
    order = rows[np.argsort(data.labels[rows], kind="stable")].tolist()
    names = _Names()
    marks = tuple(_mark(name, primitive, bound, scale, names) for name, primitive, bound in bounds)
    lines = tuple(_line(row, states[row, : data.lengths[row]], data, scale, names) for row in order)
    across = tuple(Tick(scale.x(tick), f"{tick:g}") for tick in _steps(0, scale.last, 8, whole=True))
    up = tuple(Tick(scale.y(value), f"{value:g}") for value in _steps(scale.low, scale.high, 6))
    return Panel(variable, lines, marks, across, up)


@dataclass(frozen=True, slots=True)
class _Scale:
    """From ticks and values to the units of the drawing."""

    last: int
    low: float
    high: float

    @classmethod
    def of(cls, states: NDArray[np.float64], horizon: int, bounds: Sequence[Bound]) -> _Scale:
        """The scale on which all states and all sides of boxes can be seen."""
        sides = [side for bound in bounds for side in (bound.lower, bound.upper) if math.isfinite(side)]
        low, high = min([float(np.nanmin(states)), *sides]), max([float(np.nanmax(states)), *sides])
        room = 0.04 * (high - low) or max(abs(high), 1.0) * 0.1
        return cls(max(horizon, 1), low - room, high + room)

    def x(self, tick: float) -> float:
        """Where a tick is, within the axes."""
        return round(min(max(LEFT + (RIGHT - LEFT) * tick / self.last, LEFT), RIGHT), 1)

    def y(self, value: float) -> float:
        """Where a value is, within the axes."""
        share = (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)
        return round(BOTTOM - (BOTTOM - TOP) * share, 1)


class _Names:
    """Finds room for names: each goes down, and at the bottom up, until it covers no other."""

    def __init__(self) -> None:
        self._taken: list[tuple[float, float, float]] = []

    def place(self, x: float, y: float, width: float) -> tuple[float, float]:
        """Room for a name of some width, as near as may be to where its left end should be."""
        x = min(max(x, LEFT + 2), RIGHT - width)
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


def _line(row: int, states: NDArray[np.float64], data: LabelledTrajectories, scale: _Scale, names: _Names) -> Line:
    places = [(scale.x(tick), scale.y(value)) for tick, value in enumerate(states.tolist())]
    points = " ".join(f"{x:g},{y:g}" for x, y in places)
    x, y = places[-1]
    width = _LETTER * min(len(data.ids[row]), LONGEST_NAME)
    return Line(data.ids[row], int(data.labels[row]), points, names.place(x - width, y - 5, width))


def _mark(name: str, primitive: Primitive, bound: Bound, scale: _Scale, names: _Names) -> Mark:
    first, last = scale.x(primitive.start - _HALF), scale.x(primitive.end + _HALF)
    top, bottom = scale.y(bound.upper), scale.y(bound.lower)
    rest = scale.x(primitive.window.end + _HALF) if primitive.operator.nested else None
    shown = f"{name} {primitive.operator.symbol}{'¬' if primitive.complemented else ''}"
    width, height = round(last - first, 1), round(bottom - top, 1)
    place = names.place(first + 5, top + 15 if height > 18 else top - 4, _LETTER * len(shown))
    return Mark(shown, primitive.complemented, first, top, width, height, rest, place)


def _steps(low: float, high: float, most: int, *, whole: bool = False) -> list[float]:
    """Round numbers between two, at most so many, at equal distances of 1, 2 or 5 times a power of ten."""
    least = (high - low) / most
    power = 10.0 ** math.floor(math.log10(least))
    step = next(factor * power for factor in (1, 2, 5, 10, 20) if factor * power >= least * (1 - 1e-9))
    step = max(step, 1.0) if whole else step
    numbers = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    return [round(number * step, 12) for number in numbers]
