"""Geometry of a drawing: where trajectories are in the plane of two variables while a primitive looks at them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.axis import Axis, Frame, Tick
from tickwise.inference.drawing import named_primitives
from tickwise.inference.explanation import Explanation
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import Primitive

WIDTH, HEIGHT = 360, 330
LEFT, RIGHT, TOP, BOTTOM = 46, 350, 8, 284
"""The size of a plane and where its axes end, in units of the drawing."""


@dataclass(frozen=True, slots=True)
class Way:
    """A trajectory in a plane, during the window of a primitive.

    Attributes:
        name: Its id.
        label: Its label, 1 or -1.
        points: Its states as SVG has points.
        end: Where the last one is.
    """

    name: str
    label: int
    points: str
    end: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Plane:
    """What one primitive looks at, in the plane of two variables.

    Attributes:
        name: The name of the primitive.
        primitive: The primitive.
        variables: The names of the variable across and of the one up.
        ways: The trajectories, those with label -1 first.
        frame: Where the primitive's region is.
        across: Ticks of the axis across.
        up: Ticks of the axis up.
    """

    name: str
    primitive: Primitive
    variables: tuple[str, str]
    ways: tuple[Way, ...]
    frame: Frame
    across: tuple[Tick, ...]
    up: tuple[Tick, ...]


def planes(found: Explanation, data: LabelledTrajectories, rows: NDArray[np.int64]) -> tuple[Plane, ...]:
    """Draw what each primitive looks at that has a plane: its two variables, or the data's if there are just two.

    Args:
        found: The formula.
        data: All trajectories; they and the formula say what range the axes have.
        rows: Which of them to draw.

    Returns:
        The planes.
    """
    drawn = []
    for name, primitive in named_primitives(found):
        bounded = primitive.box.variables
        pair = data.variables if len(data.variables) == 2 else bounded
        if len(pair) == 2:
            drawn.append(_plane(name, primitive, (pair[0], pair[1]), data, rows))
    return tuple(drawn)


def _plane(
    name: str, primitive: Primitive, pair: tuple[str, str], data: LabelledTrajectories, rows: NDArray[np.int64]
) -> Plane:
    bounds = {bound.variable: (bound.lower, bound.upper) for bound in primitive.box.bounds}
    wide, tall = (bounds.get(variable, (-math.inf, math.inf)) for variable in pair)
    states = [data.values[..., data.variables.index(variable)] for variable in pair]
    across, up = Axis.around(states[0], wide, LEFT, RIGHT), Axis.around(states[1], tall, BOTTOM, TOP)
    ways = []
    for row in rows[np.argsort(data.labels[rows], kind="stable")].tolist():
        window = slice(primitive.start, min(primitive.end + 1, int(data.lengths[row])))
        places = [
            (across.place(x), up.place(y))
            for x, y in zip(states[0][row, window].tolist(), states[1][row, window].tolist(), strict=True)
        ]
        if places:
            points = " ".join(f"{x:g},{y:g}" for x, y in places)
            ways.append(Way(data.ids[row], int(data.labels[row]), points, places[-1]))
    frame = Frame.of(across, wide, up, tall)
    return Plane(name, primitive, pair, tuple(ways), frame, across.ticks(6), up.ticks(6))
