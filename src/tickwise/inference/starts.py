"""Starting positions of the swarm that come from the data.

A uniformly drawn box and window is hardly ever near a rule, and then the objective is flat. So half of a swarm
starts at what some trajectory did: a box around a few of its successive states, and a window around their ticks, or
times with which it satisfies the operator.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.inference.kernels import ALWAYS, ALWAYS_EVENTUALLY, EVENTUALLY, EVENTUALLY_ALWAYS, Shape
from tickwise.inference.space import SearchSpace, SpaceArrays
from tickwise.inference.trajectories import LabelledTrajectories

_LONGEST_STAY = 6


def sampled_starts(
    data: LabelledTrajectories, space: SearchSpace, shape: Shape, count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Draw starting positions from trajectories.

    Args:
        data: The trajectories; each disjunct follows one of them, with label 1 three times in four.
        space: The search space.
        shape: Operators and polarities.
        count: How many positions.
        rng: The source of randomness.

    Returns:
        Positions, shape ``(count, dimensions)``; `decode` makes them valid.
    """
    good, bad = np.flatnonzero(data.labels == 1), np.flatnonzero(data.labels == -1)
    positions = np.empty((count, len(space.units(shape))))
    _fill(data.values, data.lengths, good, bad, space.arrays(), space.horizon, shape, rng, positions)
    return positions


@njit
def _fill(
    values: NDArray[np.float64],
    lengths: NDArray[np.int64],
    good: NDArray[np.int64],
    bad: NDArray[np.int64],
    space: SpaceArrays,
    horizon: int,
    shape: Shape,
    rng: np.random.Generator,
    positions: NDArray[np.float64],
) -> None:
    """Fill positions; a primitive's block is as in `tickwise.inference.space`."""
    for position in positions:
        at = 0
        for disjunct in range(len(shape.starts) - 1):
            low, high = shape.starts[disjunct], shape.starts[disjunct + 1]
            preferred = good if rng.random() < 0.75 else bad
            row = rng.integers(0, len(preferred) if len(preferred) else len(values))
            if len(preferred):
                row = preferred[row]
            states = values[row, : lengths[row]]
            ticks = np.empty(high - low, dtype=np.int64)
            for j in range(len(ticks)):
                ticks[j] = rng.integers(0, min(len(states), horizon + 1))
            ticks.sort()
            for j in range(low, high):
                stay = int(rng.integers(0, _LONGEST_STAY + 1))
                box = position[at : at + 2 * len(space.low)]
                _box(states[ticks[j - low] : ticks[j - low] + stay + 1], space, rng, box)
                at += len(box)
                # what a complemented predicate has to do with a visited box, nobody knows: any window may do
                operator = EVENTUALLY if shape.complemented[j] else shape.operators[j]
                times = _times(operator, states, ticks[j - low], stay, box, space, horizon, rng)
                for k in range(3 if shape.operators[j] >= EVENTUALLY_ALWAYS else 2):
                    position[at + k] = times[k]
                at += 3 if shape.operators[j] >= EVENTUALLY_ALWAYS else 2


@njit
def _box(visited: NDArray[np.float64], space: SpaceArrays, rng: np.random.Generator, box: NDArray[np.float64]) -> None:
    """The sides of a box around some states, as positions, at times a little wider."""
    for column in range(len(space.low)):
        low, high = visited[:, column].min(), visited[:, column].max()
        first, second = rng.random(), rng.random()
        count = space.counts[column]
        if count:
            edges = space.candidates[column, :count]
            box[2 * column] = np.searchsorted(edges, low, side="right") - 1 - (first < 0.25)
            box[2 * column + 1] = np.searchsorted(edges, high, side="left") + (second < 0.25)
        else:
            span = space.high[column] - space.low[column]
            box[2 * column] = low - first * 0.1 * span
            box[2 * column + 1] = high + second * 0.1 * span


@njit
def _times(
    operator: int,
    states: NDArray[np.float64],
    tick: int,
    stay: int,
    box: NDArray[np.float64],
    space: SpaceArrays,
    horizon: int,
    rng: np.random.Generator,
) -> tuple[int, int, int]:
    """A window and a duration with which the trajectory satisfies the operator, or nearly so."""
    before = int(rng.integers(0, horizon // 2 + 1))
    after = int(rng.integers(0, horizon // 2 + 1))
    if operator == ALWAYS and rng.random() < 0.5:
        return tick, tick + max(stay, 1), 0
    if operator == ALWAYS_EVENTUALLY and rng.random() < 0.5:
        # from the first tick to the last, with the longest absence from the box between two visits
        absence = _longest_absence(states, box, space)
        if absence == len(states):
            absence = stay
        return 0, horizon - absence, max(absence, 1)
    return tick - before, tick + after, max(stay, 1)


@njit
def _longest_absence(states: NDArray[np.float64], box: NDArray[np.float64], space: SpaceArrays) -> int:
    """The most ticks in a row that a trajectory is outside a box of positions."""
    longest = absence = 0
    for t in range(len(states)):
        absence = 0 if _within(states[t], box, space) else absence + 1
        longest = max(longest, absence)
    return longest


@njit
def _within(state: NDArray[np.float64], box: NDArray[np.float64], space: SpaceArrays) -> bool:
    """Whether a state is in a box of positions."""
    for column in range(len(space.low)):
        low, high, count = box[2 * column], box[2 * column + 1], space.counts[column]
        if count:
            low = space.candidates[column, int(min(max(low, 0), count - 1))]
            high = space.candidates[column, int(min(max(high, 0), count - 1))]
        if state[column] < low or state[column] > high:
            return False
    return True
