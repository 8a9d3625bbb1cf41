"""The slow, obvious twin of `tickwise.inference.starts`: the same draws, in plain Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.kernels import ALWAYS, ALWAYS_EVENTUALLY, EVENTUALLY, EVENTUALLY_ALWAYS, Shape
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories

LONGEST_STAY = 6


def plain_starts(
    data: LabelledTrajectories, space: SearchSpace, shape: Shape, count: int, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Positions as of `sampled_starts`."""
    rows = {label: np.flatnonzero(data.labels == label) for label in (1, -1)}
    positions = []
    for _ in range(count):
        position: list[float] = []
        for low, high in zip(shape.starts[:-1], shape.starts[1:], strict=True):
            preferred = rows[1 if rng.random() < 0.75 else -1]
            row = int(rng.choice(preferred if len(preferred) else len(data)))
            states = data.values[row, : data.lengths[row]]
            ticks = np.sort(rng.integers(0, min(len(states), space.horizon + 1), size=int(high - low)))
            for j, tick in zip(range(low, high), ticks.tolist(), strict=True):
                stay = int(rng.integers(0, LONGEST_STAY + 1))
                box = _box(states[tick : tick + stay + 1], space, rng)
                # what a complemented predicate has to do with a visited box, nobody knows: any window may do
                operator = EVENTUALLY if shape.complemented[j] else int(shape.operators[j])
                times = _times(operator, states, tick, stay, box, space, rng)
                position += [*box, *times[: 3 if shape.operators[j] >= EVENTUALLY_ALWAYS else 2]]
        positions.append(position)
    return np.array(positions, dtype=np.float64).reshape(count, len(space.units(shape)))


def _box(visited: NDArray[np.float64], space: SearchSpace, rng: np.random.Generator) -> list[float]:
    """The sides of a box around some states, as positions, at times a little wider."""
    numbers: list[float] = []
    for column, (edges, continuous) in enumerate(zip(space.edges, space.continuous, strict=True)):
        low, high = float(visited[:, column].min()), float(visited[:, column].max())
        if continuous:
            slack = rng.random(2) * 0.1 * (edges[-1] - edges[0])
            numbers += [low - slack[0], high + slack[1]]
        else:
            wider = rng.random(2) < 0.25
            numbers += [
                float(np.searchsorted(edges, low, side="right") - 1 - wider[0]),
                float(np.searchsorted(edges, high, side="left") + wider[1]),
            ]
    return numbers


def _times(
    operator: int,
    states: NDArray[np.float64],
    tick: int,
    stay: int,
    box: list[float],
    space: SearchSpace,
    rng: np.random.Generator,
) -> tuple[float, float, float]:
    """A window and a duration with which the trajectory satisfies the operator, or nearly so."""
    before, after = rng.integers(0, space.horizon // 2 + 1, size=2)
    if operator == ALWAYS and rng.random() < 0.5:
        return float(tick), float(tick + max(stay, 1)), 0.0
    if operator == ALWAYS_EVENTUALLY and rng.random() < 0.5:
        # from the first tick to the last, with the longest absence from the box between two visits
        visits = np.flatnonzero(_visits(states, box, space))
        absence = int(np.diff(visits, prepend=-1, append=len(states)).max()) - 1 if len(visits) else stay
        return 0.0, float(space.horizon - absence), float(max(absence, 1))
    return float(tick - before), float(tick + after), float(max(stay, 1))


def _visits(states: NDArray[np.float64], box: list[float], space: SearchSpace) -> NDArray[np.bool_]:
    """At which ticks a trajectory is in a box of positions."""
    within = np.ones(len(states), dtype=np.bool_)
    for column, (edges, continuous) in enumerate(zip(space.edges, space.continuous, strict=True)):
        low, high = box[2 * column : 2 * column + 2]
        if not continuous:
            low, high = (edges[int(np.clip(side, 0, len(edges) - 1))] for side in (low, high))
        within &= (states[:, column] >= low) & (states[:, column] <= high)
    return within
