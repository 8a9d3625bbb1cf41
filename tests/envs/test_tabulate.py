from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP, cumulative, draw
from tickwise.errors import DataError


def chain(**changes: Any) -> TabularMDP:
    """Two states in one cell each: action 0 goes to state 1 with 0.75, from where nothing leads away."""
    fields: dict[str, Any] = {
        "successor": [[[0, 1]], [[1, 1]]],
        "probability": [[[0.25, 0.75]], [[1.0, 0.0]]],
        "initial": [0.5, 0.5],
        "cell": [0, 1],
        "cell_coordinates": [[0.5], [1.5]],
        "variables": ("x",),
        "limits": ((0.0, 2.0),),
    }
    return TabularMDP(**(fields | changes))


def test_arrays_have_fixed_types_and_cannot_be_written():
    mdp = chain()
    assert (mdp.successor.dtype, mdp.probability.dtype, mdp.initial.dtype) == (
        np.int32,
        np.float64,
        np.float64,
    )
    assert (mdp.cell.dtype, mdp.cell_coordinates.dtype) == (np.int32, np.float64)
    assert (mdp.n_states, mdp.n_actions, mdp.n_cells) == (2, 1, 2)
    with pytest.raises(ValueError, match="read-only"):
        mdp.successor[0, 0, 0] = 1


def test_the_givers_array_stays_writable():
    initial = np.array([0.5, 0.5])
    chain(initial=initial)
    initial[0] = 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"successor": [[0, 1]]}, "successor has shape"),
        ({"successor": np.zeros((0, 1, 2))}, "successor has shape"),
        ({"probability": [[[1.0]], [[1.0]]]}, "probability has shape"),
        ({"initial": [1.0]}, "initial has shape"),
        ({"cell": [0]}, "cell has shape"),
        ({"cell_coordinates": [0.5, 1.5]}, "cell_coordinates has shape"),
        ({"limits": ()}, "0 limits for 1 variables"),
        ({"successor": [[[0, 2]], [[1, 1]]]}, r"successor has a number outside 0\.\.1"),
        ({"successor": [[[0, -1]], [[1, 1]]]}, r"successor has a number outside 0\.\.1"),
        ({"cell": [0, 2]}, r"cell has a number outside 0\.\.1"),
        ({"probability": [[[0.25, 0.5]], [[1.0, 0.0]]]}, "row of probability is not a distribution"),
        ({"probability": [[[-0.25, 1.25]], [[1.0, 0.0]]]}, "row of probability is not a distribution"),
        ({"probability": [[[np.nan, 1.0]], [[1.0, 0.0]]]}, "row of probability is not a distribution"),
        ({"initial": [0.5, 0.6]}, "row of initial is not a distribution"),
        ({"cell_coordinates": [[0.5], [np.inf]]}, "not finite"),
    ],
)
def test_malformed_arrays_are_refused(changes: dict[str, Any], message: str):
    with pytest.raises(DataError, match=message):
        chain(**changes)


def test_support_graph_of_a_chain():
    indptr, indices = chain().support_graph()
    assert indptr.tolist() == [0, 2, 3]
    assert indices.tolist() == [0, 1, 1]


def test_support_graph_of_a_world_of_four_cells():
    # state 0 is cell (0,0) heading east: straight leads to (1,0) = states 8.., a slip to (0,1) = states 4.. or
    # into the wall; the turns lead to headings north (1) and south (3), or fail
    indptr, indices = GridWorld(2).mdp().support_graph()
    assert indices[indptr[0] : indptr[1]].tolist() == [0, 1, 3, 4, 8]


@given(size=st.integers(1, 7), slip=st.sampled_from([0.0, 0.04, 0.5]))
@settings(max_examples=50, deadline=None)
def test_support_graph_is_the_transitions_of_positive_probability(size: int, slip: float):
    mdp = GridWorld(size, slip=slip).mdp()
    indptr, indices = mdp.support_graph()
    for state in range(mdp.n_states):
        possible = mdp.successor[state][mdp.probability[state] > 0]
        assert indices[indptr[state] : indptr[state + 1]].tolist() == sorted(set(possible.tolist()))


def test_coordinates_are_the_centres_of_the_states_cells():
    assert dataclasses.replace(chain(), cell=np.array([1, 0])).coordinates.tolist() == [[1.5], [0.5]]


def slow_draw(probability: list[float], uniform: float) -> int:
    total, last = 0.0, 0
    for outcome, share in enumerate(probability):
        total += share
        last = outcome if share > 0 else last
        if uniform < total:
            return outcome
    return last


@given(
    weights=st.lists(st.integers(0, 5), min_size=1, max_size=6).filter(any),
    uniform=st.floats(0, 1, exclude_max=True),
)
@settings(max_examples=500, deadline=None)
def test_draw_agrees_with_a_running_sum(weights: list[int], uniform: float):
    probability = np.array(weights) / sum(weights)
    outcome = draw(cumulative(probability), uniform)
    assert outcome == slow_draw(probability.tolist(), uniform)
    assert weights[outcome] > 0


def test_the_largest_uniform_draws_the_last_possible_outcome():
    thresholds = cumulative(np.array([[0.1] * 10 + [0.0], [0.97, 0.03] + [0.0] * 9]))
    assert [draw(row, np.nextafter(1.0, 0.0)) for row in thresholds] == [9, 1]
