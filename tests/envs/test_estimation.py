from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.envs.test_tabulate import chain
from tickwise.envs.estimation import estimated
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import draw
from tickwise.errors import DataError


def test_counts_by_hand():
    """From state 0 action 0 led twice to state 1 and once nowhere; state 1 was never left, the second ends early."""
    states = [[0, 1, 1], [0, 1, -1], [0, 0, -1], [1, 1, -1]]
    model = estimated(chain(), states, [[0, 0], [0, 7], [0, 0], [0, -1]])
    assert model.successor.tolist() == [[[0, 1]], [[1, 1]]]
    np.testing.assert_allclose(model.probability, [[[1 / 3, 2 / 3]], [[1, 0]]])
    assert model.initial.tolist() == [0.75, 0.25]
    assert model.cell.tolist() == [0, 1]


def test_what_was_never_tried_changes_nothing():
    world = GridWorld(2).mdp()
    model = estimated(world, [[3, 3]], [[1]])
    assert model.successor.shape == (16, 3, 1)
    assert (model.successor[..., 0] == np.arange(16)[:, None]).all()
    assert (model.probability == 1).all()


def test_many_steps_come_near_the_world():
    world, rng = GridWorld(2).mdp(), np.random.default_rng(0)
    states, actions = np.zeros((4_000, 9), dtype=int), rng.integers(3, size=(4_000, 8))
    states[:, 0] = rng.integers(16, size=4_000)
    thresholds = np.cumsum(world.probability, axis=-1)
    for row, tick in np.ndindex(actions.shape):
        s, a = states[row, tick], actions[row, tick]
        states[row, tick + 1] = world.successor[s, a, draw(thresholds[s, a], rng.random())]
    model = estimated(world, states, actions)

    def matrix(mdp: Any) -> np.ndarray:
        found = np.zeros((16, 3, 16))
        for s, a, k in np.ndindex(mdp.successor.shape):
            found[s, a, mdp.successor[s, a, k]] += mdp.probability[s, a, k]
        return found

    np.testing.assert_allclose(matrix(model), matrix(world), atol=0.04)
    np.testing.assert_allclose(model.initial, world.initial, atol=0.02)


@pytest.mark.parametrize(
    ("states", "actions", "message"),
    [
        ([0, 1], [0], r"states have shape \(2,\) and actions \(1,\)"),
        ([[0, 1]], [[0, 0]], r"actions \(1, 2\); use \(trajectories, ticks\), and one tick less"),
        (np.zeros((0, 2), int), np.zeros((0, 1), int), "states have shape"),
        ([[0.5, 1]], [[0]], "states are of type float64"),
        ([[0, 2]], [[0]], r"state 2 is outside 0\.\.1"),
        ([[0, 1]], [[1]], r"action 1 is outside 0\.\.0"),
        ([[0, 1]], [[-1]], r"action -1 is outside 0\.\.0"),
        ([[-1, 1]], [[0]], "has no state at tick 0, or goes on after its end"),
        ([[0, -1, 1]], [[0, 0]], "has no state at tick 0, or goes on after its end"),
    ],
)
def test_what_is_no_trajectory_is_refused(states: Any, actions: Any, message: str):
    with pytest.raises(DataError, match=message):
        estimated(chain(), states, actions)
