"""The levels that box sides may take in an exact search, and trajectories coded by them, as bits over the ticks."""

from __future__ import annotations

import math
import mmap
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.errors import ConfigurationError
from tickwise.inference.decimals import shortest_between
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories

WORD = 64
"""Ticks in a machine word."""


@dataclass(frozen=True, slots=True, eq=False)
class Levels:
    """For each variable the numbers that a side of a box may be, in increasing order.

    Attributes:
        variables: Names of the variables.
        sides: For each variable its levels; where a side may be open, -inf comes first and inf last.
        complete: Whether every threshold that tells the data's values apart is among the levels. It is not where a
            continuous variable has more distinct values than the cap allows thresholds.
        resolution: For each variable the least distance between two thresholds, be they levels or not, shape
            ``(variables,)``.
    """

    variables: tuple[str, ...]
    sides: tuple[NDArray[np.float64], ...]
    complete: bool
    resolution: NDArray[np.float64]

    @classmethod
    def of(cls, space: SearchSpace, data: LabelledTrajectories, cap: int) -> Levels:
        """The levels of a search space for data in one part; see `of_parts`."""
        return cls.of_parts(space, (data,), cap)

    @classmethod
    def of_parts(cls, space: SearchSpace, parts: Iterable[LabelledTrajectories], cap: int) -> Levels:
        """The levels of a search space: its edges, and between neighbouring values of a continuous variable.

        A continuous variable with more than ``cap`` such places gets a third of its levels evenly by rank, a third
        evenly over its range, so that rare values are told apart too, and a third where the extremes of the
        trajectories leave the widest gaps.

        Args:
            space: The search space.
            parts: The trajectories whose values the levels of continuous variables lie between; these values are held
                all at once, and those of one variable twice. Without such variables no part is asked for.
            cap: The most levels of a continuous variable, open sides not counted.

        Returns:
            The levels.

        Raises:
            ConfigurationError: If the cap is below 1.
        """
        if cap < 1:
            raise ConfigurationError(f"a cap of {cap} levels leaves no threshold; use 1 or more")
        gathered = _Gathered.of(parts, np.flatnonzero(space.continuous).tolist())
        sides, complete, resolution = [], True, []
        for column, (edges, continuous) in enumerate(zip(space.edges, space.continuous, strict=True)):
            if not continuous:
                sides.append(np.array(edges))
                resolution.append(np.diff(edges).min())
                continue
            values, extremes = gathered.sorted(column)
            low, high = _neighbours(values, extremes, cap)
            steps = np.diff(values)
            complete = complete and len(low) == np.count_nonzero(steps)
            resolution.append(steps[steps > 0].min() if steps.any() else edges[-1] - edges[0])
            cuts = [shortest_between(*pair) for pair in zip(low.tolist(), high.tolist(), strict=True)]
            sides.append(np.array([-math.inf, *cuts, math.inf]))
        if all(len(levels) == 2 and math.isinf(levels[0]) for levels in sides):  # nothing to tell apart
            sides[-1] = np.array([-math.inf, *space.edges[-1], math.inf])
        return cls(space.variables, tuple(sides), complete, np.array(resolution))

    def arrays(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """The levels padded with NaN, shape ``(variables, most)``, and how many each variable has."""
        counts = np.array([len(levels) for levels in self.sides], dtype=np.int64)
        padded = np.full((len(counts), counts.max()), np.nan)
        for row, levels in zip(padded, self.sides, strict=True):
            row[: len(levels)] = levels
        return padded, counts


@dataclass(frozen=True, slots=True)
class _Gathered:
    """The values of some variables in all parts, and the extremes of each trajectory, by the variable's column."""

    values: dict[int, list[NDArray[np.float64]]]
    extremes: dict[int, list[NDArray[np.float64]]]

    @classmethod
    def of(cls, parts: Iterable[LabelledTrajectories], columns: list[int]) -> _Gathered:
        gathered = cls({column: [] for column in columns}, {column: [] for column in columns})
        for part in parts if columns else ():
            for column in columns:
                states = part.values[..., column]
                gathered.values[column].append(states[~np.isnan(states)])
                gathered.extremes[column] += [np.nanmin(states, axis=1), np.nanmax(states, axis=1)]
        return gathered

    def sorted(self, column: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Both in increasing order, and no longer held here."""
        values, extremes = np.concatenate(self.values.pop(column)), np.concatenate(self.extremes.pop(column))
        values.sort()
        extremes.sort()
        return values, extremes


def _neighbours(
    values: NDArray[np.float64], extremes: NDArray[np.float64], cap: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Pairs of neighbouring distinct values of a sorted array, at most ``cap`` pairs."""
    rises = np.flatnonzero(np.diff(values))
    if len(rises) > cap:
        third = cap // 3
        by_rank = np.linspace(0, len(values) - 1, cap - 2 * third + 2)[1:-1]
        by_range = np.searchsorted(values, np.linspace(values[0], values[-1], third + 2)[1:-1])
        widest = np.sort(np.argsort(np.diff(extremes), kind="stable")[::-1][:third])
        between = np.searchsorted(values, (extremes[widest] + extremes[widest + 1]) / 2) - 1
        wanted = np.concatenate([by_rank, by_range, between]).astype(np.int64)
        rises = np.unique(rises[np.clip(np.searchsorted(rises, wanted), 0, len(rises) - 1)])
    return values[rises], values[rises + 1]


class Coded(NamedTuple):
    """Trajectories as bits: for every level, the ticks at which a variable is at least, or at most, that level.

    Attributes:
        at_least: Bit t is set where the value at tick t is at least the level, shape ``(variables, levels, n, words)``.
        at_most: Likewise for at most.
        alive: The ticks that each trajectory has, shape ``(n, words)``.
        positive: Whether the label is 1, shape ``(n,)``.
        weights: The weight in the classification rate, shape ``(n,)``.
    """

    at_least: NDArray[np.uint64]
    at_most: NDArray[np.uint64]
    alive: NDArray[np.uint64]
    positive: NDArray[np.bool_]
    weights: NDArray[np.float64]

    def select(self, mask: NDArray[np.bool_]) -> Coded:
        """The trajectories where the mask is true."""
        at_least, at_most = (bits.compress(mask, axis=2) for bits in (self.at_least, self.at_most))
        return Coded(at_least, at_most, self.alive[mask], self.positive[mask], self.weights[mask])


def code(data: LabelledTrajectories, weights: NDArray[np.float64], levels: Levels, horizon: int) -> Coded:
    """Code labelled trajectories by levels, up to a horizon.

    Args:
        data: The trajectories.
        weights: The weight of each in the classification rate, shape ``(n,)``.
        levels: The levels.
        horizon: The last tick that matters.

    Returns:
        ``2 * variables * levels + 1`` words of 8 bytes for every 64 ticks of a trajectory, and 9 bytes.
    """
    padded, counts = levels.arrays()
    words = horizon // WORD + 1
    shape = (len(counts), padded.shape[1], len(data), words)
    at_least, at_most, alive = _zeros(shape), _zeros(shape), _zeros((len(data), words))
    _code(data.values, data.lengths, padded, counts, horizon, at_least, at_most, alive)
    return Coded(at_least, at_most, alive, data.labels == 1, np.asarray(weights, dtype=np.float64))


def code_parts(parts: Iterable[LabelledTrajectories], levels: Levels, horizon: int) -> Coded:
    """Code data that comes in parts, each held no longer than it takes to code it: what `code` gives of the whole.

    Args:
        parts: The trajectories; at least one part.
        levels: The levels.
        horizon: The last tick that matters.

    Returns:
        What `code` gives of all, with weights of 1. Nothing but one part's bits is ever held twice.
    """
    kept = deque(code(part, np.ones(len(part)), levels, horizon) for part in parts)
    n, (variables, sides, _, words) = sum(len(coded.positive) for coded in kept), kept[0].at_least.shape
    at_least, at_most = _zeros((variables, sides, n, words)), _zeros((variables, sides, n, words))
    alive, positive, end = _zeros((n, words)), np.empty(n, dtype=np.bool_), 0
    while kept:
        coded = kept.popleft()
        rows, end = slice(end, end + len(coded.positive)), end + len(coded.positive)
        at_least[:, :, rows], at_most[:, :, rows] = coded.at_least, coded.at_most
        alive[rows], positive[rows] = coded.alive, coded.positive
    return Coded(at_least, at_most, alive, positive, np.ones(n))


def _zeros(shape: tuple[int, ...]) -> NDArray[np.uint64]:
    """Zeros that take memory from when they are written, and give it back to the system once they are let go."""
    return np.frombuffer(mmap.mmap(-1, 8 * math.prod(shape)), dtype=np.uint64).reshape(shape)


@njit
def _code(
    values: NDArray[np.float64],
    lengths: NDArray[np.int64],
    levels: NDArray[np.float64],
    counts: NDArray[np.int64],
    horizon: int,
    at_least: NDArray[np.uint64],
    at_most: NDArray[np.uint64],
    alive: NDArray[np.uint64],
) -> None:
    for i in range(len(values)):
        for tick in range(min(lengths[i], horizon + 1)):
            word, bit = tick // WORD, np.uint64(1) << np.uint64(tick % WORD)
            alive[i, word] |= bit
            for variable in range(len(counts)):
                value = values[i, tick, variable]
                for level in range(counts[variable]):
                    if value >= levels[variable, level]:
                        at_least[variable, level, i, word] |= bit
                    if value <= levels[variable, level]:
                        at_most[variable, level, i, word] |= bit
