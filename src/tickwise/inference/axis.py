"""An axis of a drawing: from values to places, and the round numbers that stand beside it."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Tick:
    """A tick of an axis: where it is, and what it says."""

    place: float
    text: str


@dataclass(frozen=True, slots=True)
class Axis:
    """From the values of a variable, or ticks of time, to the units of a drawing.

    Attributes:
        low: The least value.
        high: The greatest one.
        first: Where the least one is.
        last: Where the greatest one is.
    """

    low: float
    high: float
    first: float
    last: float

    @classmethod
    def around(cls, values: NDArray[np.float64], sides: Iterable[float], first: float, last: float) -> Axis:
        """The axis on which all values and all finite sides of boxes can be seen, with a little room beside them."""
        known = [side for side in sides if math.isfinite(side)]
        low, high = min([float(np.nanmin(values)), *known]), max([float(np.nanmax(values)), *known])
        room = 0.04 * (high - low) or max(abs(high), 1.0) * 0.1
        return cls(low - room, high + room, first, last)

    def place(self, value: float) -> float:
        """Where a value is; one beyond an end is at that end."""
        share = (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)
        return round(self.first + (self.last - self.first) * share, 1)

    def ticks(self, most: int, *, whole: bool = False) -> tuple[Tick, ...]:
        """At most so many ticks, at equal distances of 1, 2 or 5 times a power of ten, or of whole numbers only."""
        least = (self.high - self.low) / most
        power = 10.0 ** math.floor(math.log10(least))
        step = next(factor * power for factor in (1, 2, 5, 10, 20) if factor * power >= least * (1 - 1e-9))
        step = max(step, 1.0) if whole else step
        numbers = range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1)
        values = [round(number * step, 12) for number in numbers]
        return tuple(Tick(self.place(value), f"{value:g}") for value in values)


@dataclass(frozen=True, slots=True)
class Frame:
    """A range on an axis across times a range on an axis up: a rectangle.

    Attributes:
        x: Left end.
        y: Upper end.
        width: Along the axis across.
        height: Along the axis up.
        edges: Its outline as SVG has a path; where a range has no end, no line closes it.
    """

    x: float
    y: float
    width: float
    height: float
    edges: str

    @classmethod
    def of(cls, across: Axis, wide: tuple[float, float], up: Axis, tall: tuple[float, float]) -> Frame:
        """The rectangle of two ranges, each a least and a greatest value, which may be infinite."""
        left, right, bottom, top = *map(across.place, wide), *map(up.place, tall)
        sides = {
            f"M{left:g} {bottom:g}V{top:g}": wide[0], f"M{right:g} {top:g}V{bottom:g}": wide[1],
            f"M{left:g} {bottom:g}H{right:g}": tall[0], f"M{left:g} {top:g}H{right:g}": tall[1],
        }  # fmt: skip
        edges = "".join(path for path, value in sides.items() if math.isfinite(value))
        return cls(left, top, round(right - left, 1), round(bottom - top, 1), edges)
