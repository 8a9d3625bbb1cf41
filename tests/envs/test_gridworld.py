from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import ConfigurationError

STRAIGHT, LEFT, RIGHT = 0, 1, 2
EAST, NORTH, WEST, SOUTH = 0, 1, 2, 3


def outcomes(world: GridWorld, mdp: TabularMDP, state: int, action: int) -> list[tuple[tuple[int, int, int], float]]:
    row = zip(mdp.successor[state, action], mdp.probability[state, action], strict=True)
    return [(world.place(int(successor)), round(float(share), 12)) for successor, share in row if share > 0]


@pytest.fixture(scope="module")
def world() -> GridWorld:
    return GridWorld(3)


@pytest.fixture(scope="module")
def mdp(world: GridWorld) -> TabularMDP:
    return world.mdp()


def test_state_numbers_by_hand(world: GridWorld):
    assert world.state(0, 0, EAST) == 0
    assert world.state(1, 2, NORTH) == 21  # cell 1*3+2 = 5, then 5*4+1
    assert world.place(35) == (2, 2, SOUTH)


@pytest.mark.parametrize(
    ("place", "successors"),
    [
        # forward, left, right
        ((1, 1, EAST), [(2, 1), (1, 2), (1, 0)]),
        ((1, 1, NORTH), [(1, 2), (0, 1), (2, 1)]),
        ((1, 1, WEST), [(0, 1), (1, 0), (1, 2)]),
        ((1, 1, SOUTH), [(1, 0), (2, 1), (0, 1)]),
        ((2, 1, EAST), [(2, 1), (2, 2), (2, 0)]),  # at the wall: forward stays
        ((2, 1, NORTH), [(2, 2), (1, 1), (2, 1)]),  # along the wall: right stays
        ((0, 0, EAST), [(1, 0), (0, 1), (0, 0)]),  # in the corner: right stays
        ((0, 0, WEST), [(0, 0), (0, 0), (0, 1)]),  # in the corner: forward and left stay
        ((2, 2, NORTH), [(2, 2), (1, 2), (2, 2)]),
    ],
)
def test_going_straight_by_hand(
    world: GridWorld, mdp: TabularMDP, place: tuple[int, int, int], successors: list[tuple[int, int]]
):
    found = outcomes(world, mdp, world.state(*place), STRAIGHT)
    assert found == [((i, j, place[2]), p) for (i, j), p in zip(successors, (0.92, 0.04, 0.04), strict=True)]


@pytest.mark.parametrize(
    ("action", "turns"),
    [
        (LEFT, {EAST: NORTH, NORTH: WEST, WEST: SOUTH, SOUTH: EAST}),
        (RIGHT, {EAST: SOUTH, SOUTH: WEST, WEST: NORTH, NORTH: EAST}),
    ],
)
def test_turns_by_hand(world: GridWorld, mdp: TabularMDP, action: int, turns: dict[int, int]):
    for before, after in turns.items():
        found = outcomes(world, mdp, world.state(0, 2, before), action)
        assert found == [((0, 2, after), 0.97), ((0, 2, before), 0.03)]


def test_the_start_is_uniform_and_the_robot_at_the_centre(mdp: TabularMDP):
    assert mdp.initial.tolist() == [1 / 36] * 36
    assert mdp.coordinates[21].tolist() == [1.5, 2.5]
    assert mdp.cell_coordinates[:4].tolist() == [[0.5, 0.5], [0.5, 1.5], [0.5, 2.5], [1.5, 0.5]]
    assert mdp.variables == ("x", "y")
    assert mdp.limits == ((0.0, 3.0), (0.0, 3.0))


@given(
    size=st.integers(1, 9),
    slip=st.floats(0, 0.5, allow_subnormal=False),
    failure=st.floats(0, 1, allow_subnormal=False),
)
@settings(max_examples=200, deadline=None)
def test_every_row_is_a_distribution_over_neighbours(size: int, slip: float, failure: float):
    mdp = GridWorld(size, slip, failure).mdp()
    assert mdp.successor.shape == (size * size * 4, 3, 3)
    np.testing.assert_allclose(mdp.probability.sum(axis=-1), 1, rtol=0, atol=1e-12)
    moved = abs(mdp.coordinates[mdp.successor] - mdp.coordinates[:, None, None]).sum(axis=-1)
    assert moved.max() <= 1
    assert not moved[:, 1:].any()  # turns stay in place
    heading = np.arange(mdp.n_states) % 4
    assert (mdp.successor[:, STRAIGHT] % 4 == heading[:, None]).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"size": 0}, "size is 0"),
        ({"size": 2.5}, r"size is 2\.5"),
        ({"size": True}, "size is True"),
        ({"size": 3, "slip": 0.6}, r"slip is 0\.6"),
        ({"size": 3, "slip": float("nan")}, "slip is nan"),
        ({"size": 3, "turn_failure": -0.1}, r"turn_failure is -0\.1"),
    ],
)
def test_numbers_out_of_range_are_refused(arguments: dict[str, float], message: str):
    with pytest.raises(ConfigurationError, match=message):
        GridWorld(**arguments)
