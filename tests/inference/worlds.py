"""A small robot for test data: straight and turning moves on a grid, as in Case Study 1."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise.inference.prior import PathPrior
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import SDNF
from tickwise.logic.syntax import Verdict

STEPS = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])  # east, north, west, south
Region = tuple[int, int, int, int]
"""x1, x2, y1, y2: whole cells."""


def grid_prior(size: int, horizon: int) -> PathPrior:
    """Uniform over all paths that stay or step to a neighbouring cell."""
    cells = np.array([(i, j) for i in range(size) for j in range(size)])
    near = np.abs(cells[:, None] - cells[None]).sum(axis=2) <= 1
    return PathPrior(near, cells + 0.5, ("x", "y"), horizon)


def within(cells: NDArray[np.int64], region: Region) -> NDArray[np.bool_]:
    x1, x2, y1, y2 = region
    return (cells[:, 0] >= x1) & (cells[:, 0] < x2) & (cells[:, 1] >= y1) & (cells[:, 1] < y2)


def walk(rng: np.random.Generator, size: int, horizon: int) -> NDArray[np.int64]:
    """A robot with uniform random actions; slips are 0.04 to each side, a turn fails with 0.03."""
    cell, heading, cells = rng.integers(0, size, 2), int(rng.integers(4)), []
    for _ in range(horizon + 1):
        cells.append(cell)
        action, chance = rng.integers(3), rng.random()
        if action == 0:
            turn = 1 if chance < 0.04 else 3 if chance < 0.08 else 0
            after = cell + STEPS[(heading + turn) % 4]
            cell = after if ((after >= 0) & (after < size)).all() else cell
        elif chance >= 0.03:
            heading = (heading + (1 if action == 1 else 3)) % 4
    return np.array(cells)


def path_to(cell: NDArray[np.int64], goal: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Cells after ``cell`` on a way to the goal that goes along x first, with a tick for each turn."""
    cells = []
    for axis in (0, 1):
        while cell[axis] != goal[axis]:
            cell = cell.copy()
            cell[axis] += np.sign(goal[axis] - cell[axis])
            cells.append(cell)
        cells.append(cell)
    return cells


def errand(
    rng: np.random.Generator, size: int, horizon: int, first: Region, stay: int, second: Region
) -> NDArray[np.int64]:
    """A robot that goes to the first region at some time, stays there, goes to the second, and wanders on."""

    def somewhere(region: Region) -> NDArray[np.int64]:
        return np.array([rng.integers(region[0], region[1]), rng.integers(region[2], region[3])])

    begin = walk(rng, size, horizon)[: int(rng.integers(1, 10))]
    cells = list(begin)
    cells += path_to(cells[-1], somewhere(first))
    cells += [cells[-1]] * int(rng.integers(stay, stay + 4))
    cells += path_to(cells[-1], somewhere(second))
    while len(cells) <= horizon:
        after = cells[-1] + STEPS[rng.integers(4)] * rng.integers(2)
        cells.append(after if ((after >= 0) & (after < size)).all() else cells[-1])
    return np.array(cells[: horizon + 1])


def does_errand(cells: NDArray[np.int64], first: Region, stay: int, second: Region) -> bool:
    """Whether a path stays ``stay`` ticks in the first region and is in the second one afterwards."""
    run = 0
    for tick, here in enumerate(within(cells, first)):
        run = run + 1 if here else 0
        if run == stay + 1:
            return bool(within(cells[tick + 1 :], second).any())
    return False


def errand_data(
    seed: int, size: int, horizon: int, first: Region, stay: int, second: Region, positives: int, negatives: int
) -> LabelledTrajectories:
    """Labelled trajectories of the rule "first stay in one region, then reach another"."""
    rng = np.random.default_rng(seed)
    good: list[NDArray[np.int64]] = []
    bad: list[NDArray[np.int64]] = []
    while len(good) < positives:
        cells = errand(rng, size, horizon, first, stay, second)
        if does_errand(cells, first, stay, second):
            good.append(cells)
    while len(bad) < negatives:
        cells = walk(rng, size, horizon)
        if not does_errand(cells, first, stay, second):
            bad.append(cells)
    return LabelledTrajectories.from_arrays(np.array(good + bad) + 0.5, [1] * positives + [-1] * negatives, ("x", "y"))


def cut_short(data: LabelledTrajectories, rng: np.random.Generator, shortest: int = 1) -> LabelledTrajectories:
    """The same trajectories, each ended at a random tick."""
    lengths = rng.integers(shortest, data.lengths + 1)
    return LabelledTrajectories(data.values, lengths, data.labels, data.variables, data.ids)


def ragged_walks(seed: int, size: int, horizon: int, count: int, rule: SDNF | None = None) -> LabelledTrajectories:
    """Walks that end at any tick, labelled by a rule, or in turn where it says the same of nearly all of them."""
    rng = np.random.default_rng(seed)
    walks = np.array([walk(rng, size, horizon) for _ in range(count)]) + 0.5
    labels = np.resize([1, -1], count)
    data = cut_short(LabelledTrajectories.from_arrays(walks, labels, ("x", "y")), rng)
    if rule is not None:
        said = np.where(weakly(rule, data), 1, -1)
        labels = said if abs(said.sum()) < 0.7 * count else labels
    return LabelledTrajectories(data.values, data.lengths, labels, data.variables, data.ids)


def weakly(rule: SDNF, data: LabelledTrajectories) -> NDArray[np.bool_]:
    """Whether the reference semantics' verdict on each trajectory is not FALSE."""
    return np.asarray(verdicts(rule, data)) != Verdict.FALSE


def verdicts(rule: SDNF, data: LabelledTrajectories) -> NDArray[np.int8]:
    """The three-valued verdict of the reference semantics on each trajectory."""
    return np.asarray(rule.formula.verdict(data.values, variables=data.variables, lengths=data.lengths))
