"""The parameters θ that a search may choose: candidate boxes, windows and durations, and Υ_z of Algorithm 1.

The swarm moves in a box of real vectors; `decode` turns any such vector into parameters that are valid, by rounding,
sorting and clamping, so that no particle ever leaves Υ_z. The block of one primitive is
``[lower_0, upper_0, lower_1, upper_1, …, window start, window end, (duration)]``.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.errors import ConfigurationError, DataError, UnknownVariableError
from tickwise.inference.kernels import EVENTUALLY_ALWAYS, Shape
from tickwise.inference.prior import BoxPrior
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Bound, Box, Interval, Not

Gaps = tuple[tuple[int, int], ...]

OPERATORS = tuple(Operator)
"""The operators in the order of their compiled codes 0, 1, 2, 3."""

_MARGIN = 0.25  # how far beyond a continuous range a side may move; there the side is open


class SpaceArrays(NamedTuple):
    """A search space as plain arrays: candidate bounds padded with NaN, ranges, and decimals of continuous ones."""

    candidates: NDArray[np.float64]
    counts: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    decimals: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class SearchSpace:
    """What boxes, windows and durations a search may choose.

    Attributes:
        variables: Names of the variables, in the data's order.
        edges: For each variable the candidate box sides in increasing order, or, where it is continuous, the
            range ``(lo, hi)``.
        horizon: Effect windows lie within ``[0, horizon]`` ticks.
        continuous: Whether each variable's sides may be any number in its range; there a side may also be open,
            so that comparisons such as ``x <= 31`` are found. Numbers are rounded to about a thousandth of the range.

    Raises:
        ConfigurationError: If a variable has fewer than two edges, edges do not increase, or the horizon is below 1.
    """

    variables: tuple[str, ...]
    edges: tuple[tuple[float, ...], ...]
    horizon: int
    continuous: tuple[bool, ...]

    def __post_init__(self) -> None:
        if not len(self.variables) == len(self.edges) == len(self.continuous) or not self.variables:
            raise ConfigurationError("a search space needs edges and a continuous flag for every variable")
        for name, edges, continuous in zip(self.variables, self.edges, self.continuous, strict=True):
            increasing = all(low < high for low, high in itertools.pairwise(edges))
            if len(edges) < 2 or not increasing or not all(map(math.isfinite, edges)):
                raise ConfigurationError(f"the edges of {name!r} are {edges}; give two or more, increasing and finite")
            if continuous and len(edges) > 2:
                raise ConfigurationError(f"{name!r} is continuous but has {len(edges)} edges; give its two ends")
        if self.horizon < 1:
            raise ConfigurationError(f"a horizon of {self.horizon} ticks holds no window; use 1 or more")

    @classmethod
    def grid(cls, size: int, horizon: int, variables: tuple[str, ...] = ("x", "y")) -> SearchSpace:
        """Unions of whole cells of a gridworld: box sides among 0, 1, …, size."""
        edges = tuple(float(edge) for edge in range(size + 1))
        return cls(variables, (edges,) * len(variables), horizon, (False,) * len(variables))

    def box_prior(self, horizon: int) -> BoxPrior:
        """Independent uniform draws from the ranges of this space, until a horizon in ticks, at least 1."""
        ranges = {name: (edges[0], edges[-1]) for name, edges in zip(self.variables, self.edges, strict=True)}
        return BoxPrior(ranges, max(horizon, 1))

    @classmethod
    def from_data(cls, data: LabelledTrajectories, horizon: int | None = None) -> SearchSpace:
        """Continuous boxes over the range of the data; the horizon is the data's last tick if left out.

        Raises:
            DataError: If the horizon is left out and no trajectory has a second tick.
        """
        if horizon is None and data.horizon < 1:
            raise DataError("every trajectory has a single tick; give trajectories of two ticks or more")
        ranges = []
        for column in range(len(data.variables)):
            low, high = float(np.nanmin(data.values[..., column])), float(np.nanmax(data.values[..., column]))
            if low == high:
                low, high = low - 0.5, high + 0.5
            unit = 10.0 ** -_decimals(low, high)
            ranges.append((math.floor(low / unit) * unit, math.ceil(high / unit) * unit))
        flags = (True,) * len(ranges)
        return cls(data.variables, tuple(ranges), data.horizon if horizon is None else horizon, flags)

    def arrays(self) -> SpaceArrays:
        """Plain arrays for `decode`."""
        pairs = zip(self.edges, self.continuous, strict=True)
        counts = [0 if continuous else len(edges) for edges, continuous in pairs]
        candidates = np.full((len(counts), max(max(counts), 1)), np.nan)
        for row, edges, count in zip(candidates, self.edges, counts, strict=True):
            row[:count] = edges[:count]
        ends = np.array([(edges[0], edges[-1]) for edges in self.edges])
        decimals = np.array([_decimals(low, high) for low, high in ends])
        return SpaceArrays(candidates, np.array(counts), ends[:, 0].copy(), ends[:, 1].copy(), decimals)

    def gaps(self, occupied: Sequence[tuple[int, int]] = ()) -> Gaps:
        """The free intervals of ticks beside the effect intervals of a path (Equation Theta_exp), with room.

        Args:
            occupied: Effect intervals ``(t_s, t_e)`` of the path's primitives.

        Returns:
            Maximal free intervals of at least two ticks; none if Υ_z is empty (Condition III).
        """
        free, start = [], 0
        for first, last in sorted(occupied):
            free.append((start, first - 1))
            start = max(start, last + 1)
        free.append((start, self.horizon))
        return tuple((low, high) for low, high in free if high - low >= least_span(False))

    def room(self, shape: Shape, gaps: Gaps) -> bool:
        """Whether every disjunct of a shape fits into one of the gaps, its primitives one after the other."""
        spans = [least_span(bool(operator >= EVENTUALLY_ALWAYS)) + 1 for operator in shape.operators]
        largest = max((high - low for low, high in gaps), default=-1)
        ranges = zip(shape.starts[:-1], shape.starts[1:], strict=True)
        return all(sum(spans[low:high]) - 1 <= largest for low, high in ranges)

    def bounds(self, shape: Shape) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The box of real vectors that the swarm moves in, two arrays of shape ``(dimensions,)``."""
        blocks = [self._block(bool(operator >= EVENTUALLY_ALWAYS)) for operator in shape.operators]
        lower, upper = np.concatenate(blocks).T
        return lower.copy(), upper.copy()

    def _block(self, nested: bool) -> NDArray[np.float64]:
        rows = []
        for edges, continuous in zip(self.edges, self.continuous, strict=True):
            margin = _MARGIN * (edges[-1] - edges[0])
            ends = (edges[0] - margin, edges[-1] + margin) if continuous else (-0.49, len(edges) - 0.51)
            rows += [ends, ends]
        rows += [(-0.49, self.horizon + 0.49)] * 2
        if nested:
            rows.append((0.51, max(self.horizon - 1, 1) + 0.49))
        return np.array(rows)

    def units(self, shape: Shape) -> NDArray[np.float64]:
        """The smallest step that matters in each dimension, shape ``(dimensions,)``: 1 for whole numbers."""
        units = []
        sides = zip(self.continuous, self.arrays().decimals, strict=True)
        box = [10.0 ** -int(decimals) if continuous else 1.0 for continuous, decimals in sides for _ in range(2)]
        for operator in shape.operators:
            units += [*box, 1.0, 1.0] + [1.0] * bool(operator >= EVENTUALLY_ALWAYS)
        return np.array(units)

    def decode(self, position: NDArray[np.float64], shape: Shape, gaps: Gaps | None = None) -> SDNF:
        """The formula at a position: always valid, and always within the gaps."""
        times, lower, upper = empty_parameters(shape, len(self.variables))
        free = np.array(self.gaps() if gaps is None else gaps, dtype=np.int64).reshape(-1, 2)
        decode(self.arrays(), shape, free, np.asarray(position, dtype=np.float64), times, lower, upper)
        return to_formula(self.variables, shape, times, lower, upper)

    def encode(self, formula: SDNF) -> NDArray[np.float64]:
        """A position that decodes to a formula whose boxes and windows are in the space, shape ``(dimensions,)``."""
        numbers: list[float] = []
        primitives = [primitive for disjunct in formula.disjuncts for primitive in disjunct.primitives]
        for primitive in primitives:
            ranges = {bound.variable: (bound.lower, bound.upper) for bound in primitive.box.bounds}
            for name, edges, continuous in zip(self.variables, self.edges, self.continuous, strict=True):
                margin = _MARGIN * (edges[-1] - edges[0]) if continuous else 0.0
                ends = ranges.get(name, (-math.inf, math.inf))
                sides = np.clip(ends, edges[0] - margin, edges[-1] + margin)
                if not continuous:  # the index of the nearest edge
                    sides = np.abs(np.array(edges)[:, None] - sides).argmin(axis=0)
                numbers += sides.tolist()
            numbers += [primitive.window.start, primitive.window.end]
            numbers += [primitive.duration] * primitive.operator.nested
        return np.array(numbers)


def _decimals(low: float, high: float) -> int:
    """Decimals that numbers are rounded to: the last one is a thousandth of the range or a little less."""
    return 3 - math.floor(math.log10(high - low))


@njit
def least_span(nested: bool) -> int:
    """The smallest t_e - t_s of a primitive: a window of two ticks, and a duration of one if nested."""
    return 2 if nested else 1


def empty_parameters(
    shape: Shape, variables: int
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Arrays for `decode` to fill: times ``(n, 3)``, lower and upper ``(n, variables)``."""
    n = len(shape.operators)
    return np.zeros((n, 3), dtype=np.int64), np.empty((n, variables)), np.empty((n, variables))


def shape_of(structure: Sequence[Sequence[tuple[Operator, bool]]]) -> Shape:
    """The compiled shape of a structure: for each disjunct its (operator, complemented) pairs."""
    flat = [pair for disjunct in structure for pair in disjunct]
    starts = np.cumsum([0, *(len(disjunct) for disjunct in structure)])
    operators = np.array([OPERATORS.index(operator) for operator, _ in flat], dtype=np.int64)
    return Shape(starts.astype(np.int64), operators, np.array([flag for _, flag in flat], dtype=np.bool_))


def to_arrays(
    formula: SDNF, variables: Sequence[str]
) -> tuple[Shape, NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """A formula as the arrays of the kernels; a strict side becomes the next representable number.

    Raises:
        UnknownVariableError: If the formula names a variable that is not among ``variables``.
    """
    pairs = [[(p.operator, p.complemented) for p in disjunct.primitives] for disjunct in formula.disjuncts]
    shape = shape_of(pairs)
    times, lower, upper = empty_parameters(shape, len(variables))
    lower[:], upper[:] = -np.inf, np.inf
    for j, primitive in enumerate(p for disjunct in formula.disjuncts for p in disjunct.primitives):
        times[j] = primitive.window.start, primitive.window.end, primitive.duration
        for bound in primitive.box.bounds:
            if bound.variable not in variables:
                known = ", ".join(variables)
                raise UnknownVariableError(f"the formula names {bound.variable!r}; the data has {known}")
            column = list(variables).index(bound.variable)
            lower[j, column] = np.nextafter(bound.lower, np.inf) if bound.lower_strict else bound.lower
            upper[j, column] = np.nextafter(bound.upper, -np.inf) if bound.upper_strict else bound.upper
    return shape, times, lower, upper


def to_formula(
    variables: Sequence[str],
    shape: Shape,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> SDNF:
    """The formula of decoded parameter arrays."""
    primitives = []
    for j, code in enumerate(shape.operators):
        sides = zip(variables, lower[j].tolist(), upper[j].tolist(), strict=True)
        bounded = [side for side in sides if math.isfinite(side[1]) or math.isfinite(side[2])]
        box = Box(tuple(Bound(*side) for side in bounded))
        first, last, duration = times[j].tolist()
        predicate = Not(box) if shape.complemented[j] else box
        primitives.append(Primitive(OPERATORS[code], Interval(first, last), duration, predicate))
    ranges = zip(shape.starts[:-1], shape.starts[1:], strict=True)
    return SDNF(tuple(SequentialConjunction(tuple(primitives[low:high])) for low, high in ranges))


@njit
def decode(
    space: SpaceArrays,
    shape: Shape,
    gaps: NDArray[np.int64],
    position: NDArray[np.float64],
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> None:
    """Turn any real vector into valid parameters, in place; see the module's text.

    Args:
        space: The space's arrays.
        shape: The fixed part of the formula.
        gaps: Free intervals of ticks, shape ``(gaps, 2)``; several only for a formula of one primitive.
        position: The vector, shape ``(dimensions,)``.
        times: Filled with windows and durations, shape ``(n, 3)``.
        lower: Filled with lower sides, shape ``(n, variables)``.
        upper: Filled with upper sides, shape ``(n, variables)``.
    """
    at = 0
    for disjunct in range(len(shape.starts) - 1):
        earliest = 0
        reserve = 0  # ticks that the later primitives of this disjunct need
        for j in range(shape.starts[disjunct], shape.starts[disjunct + 1]):
            reserve += least_span(shape.operators[j] >= EVENTUALLY_ALWAYS) + 1
        for j in range(shape.starts[disjunct], shape.starts[disjunct + 1]):
            nested = shape.operators[j] >= EVENTUALLY_ALWAYS
            reserve -= least_span(nested) + 1
            _decode_box(space, position[at:], lower[j], upper[j])
            at += 2 * len(space.low)
            duration = position[at + 2] if nested else 0.0
            _decode_times(gaps, earliest, reserve, nested, position[at], position[at + 1], duration, times[j])
            at += 3 if nested else 2
            earliest = times[j, 1] + times[j, 2] + 1


@njit
def _decode_box(
    space: SpaceArrays, position: NDArray[np.float64], lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> None:
    bounded = False
    for variable in range(len(space.low)):
        first = min(position[2 * variable], position[2 * variable + 1])
        second = max(position[2 * variable], position[2 * variable + 1])
        count = space.counts[variable]
        if count > 0:
            low = min(max(int(np.rint(first)), 0), count - 2)
            high = min(max(int(np.rint(second)), low + 1), count - 1)
            lower[variable] = space.candidates[variable, low]
            upper[variable] = space.candidates[variable, high]
            bounded = True
            continue
        unit = 10.0 ** -space.decimals[variable]
        if second - first < unit:
            second = first + unit
        lower[variable], upper[variable] = -np.inf, np.inf
        if first > space.low[variable]:
            lower[variable] = _rounded(min(first, space.high[variable] - unit), space.decimals[variable])
            bounded = True
        if second < space.high[variable]:
            upper[variable] = _rounded(max(second, space.low[variable] + unit), space.decimals[variable])
            if upper[variable] <= lower[variable]:  # both were rounded to the same number
                upper[variable] = _rounded(lower[variable] + unit, space.decimals[variable])
            bounded = True
    if not bounded:  # a box needs a side: the whole range of the last variable says nothing either
        lower[-1], upper[-1] = space.low[-1], space.high[-1]


@njit
def _rounded(number: float, decimals: int) -> float:
    power = 10.0 ** abs(decimals)
    if decimals >= 0:
        return float(np.rint(number * power) / power)
    return float(np.rint(number / power) * power)


@njit
def _decode_times(
    gaps: NDArray[np.int64],
    earliest: int,
    reserve: int,
    nested: bool,
    first: float,
    second: float,
    third: float,
    times: NDArray[np.int64],
) -> None:
    span = least_span(nested)
    start, end = int(np.rint(min(first, second))), int(np.rint(max(first, second)))
    low, high, nearest = -1, -1, np.inf
    for g in range(len(gaps)):  # the gap with room that is nearest to the wanted start
        begin, stop = max(gaps[g, 0], earliest), gaps[g, 1] - reserve
        distance = float(max(begin - start, start - (stop - span), 0))
        if stop - begin >= span and distance < nearest:
            low, high, nearest = begin, stop, distance
    start = min(max(start, low), high - span)
    duration = min(max(int(np.rint(third)), 1), high - start - 1) if nested else 0
    times[0], times[1], times[2] = start, min(max(end, start + 1), high - duration), duration
