from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.strategies import VARIABLES, random_trajectories, sequential_conjunctions
from tickwise.automata.build import build
from tickwise.automata.run import EdgeStep, run
from tickwise.errors import DataError, UnknownVariableError
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SequentialConjunction, to_sdnf
from tickwise.transfer.landmarks import landmarks


def conjunction(text: str) -> SequentialConjunction:
    (only,) = to_sdnf(parse(text)).disjuncts
    return only


def found(
    text: str, X: list[list[list[float]]], y: list[int], names: tuple[str, ...] = ("x", "y")
) -> list[list[float]]:
    data = LabelledTrajectories.from_arrays([np.array(each, dtype=float) for each in X], y, names)
    return landmarks(build(conjunction(text)).compile(), data).tolist()


def test_an_open_region_has_its_place_from_the_data_and_a_closed_one_its_centre():
    X = [
        [[0, 1], [5, 3], [7, 7], [1, 9]],  # x >= 5 at tick 1, y >= 8 at tick 3
        [[6, 5], [0, 0], [0, 8], [2, 8]],  # at ticks 0 and 2
        [[9, 9], [9, 9], [9, 9]],  # label -1: does not count
        [[0, 0], [0, 0], [0, 0]],  # label 1, but not satisfied: does not count
    ]
    y = [1, 1, -1, 1]
    assert found("F[0,1] (x >= 5) & F[2,3] (y >= 8)", X, y) == [[5.5, 4.0], [0.5, 8.5]]
    # closed in x, so that x is the centre and only y comes from the data
    assert found("F[0,1] (5 <= x <= 8) & F[2,3] (y >= 8)", X, y) == [[6.5, 4.0], [0.5, 8.5]]
    # closed in all, as the paper has it
    assert found("F[0,1] (5 <= x <= 8 & 1 <= y <= 6)", X, y) == [[6.5, 3.5]]


def test_a_stay_is_done_with_at_its_last_tick():
    X = [[[0, 0], [5, 1], [6, 2], [7, 3], [0, 9]]]
    assert found("F[0,2] G[0,2] (x >= 5)", X, [1]) == [[7.0, 3.0]]
    assert found("G[1,3] (x >= 5)", X, [1]) == [[7.0, 3.0]]


def test_columns_that_the_formula_does_not_name_have_a_place_too():
    X = [[[4, 0, 1], [4, 5, 2]], [[2, 6, 3], [9, 9, 9]]]
    assert found("F[0,1] (key >= 5)", X, [1, 1], ("x", "key", "z")) == [[3.0, 5.5, 2.5]]


@settings(max_examples=60)
@given(sequential_conjunctions(most=2, longest=2), st.integers(0, 2**30))
def test_each_place_is_where_the_run_leaves_a_primitives_locations(phi: SequentialConjunction, seed: int):
    automaton = build(phi)
    X = random_trajectories(seed, 30, phi.primitives[-1].end + 2, 2)
    places: list[list[np.ndarray]] = [[] for _ in phi.primitives]
    for each in X:
        steps = [step for step in run(automaton, each, variables=VARIABLES).steps if isinstance(step, EdgeStep)]
        if steps[-1].target not in automaton.accepting:
            continue
        for stage, own in enumerate(places):
            working = [q for q, s in enumerate(automaton.stages) if s <= stage and q not in automaton.accepting]
            own.append(each[next(step.tick for step in steps if step.target not in working)])
    assume(places[0])
    data = LabelledTrajectories.from_arrays(X, np.ones(30, dtype=int), VARIABLES)
    ours = landmarks(automaton.compile(), data)
    for row, primitive, own in zip(ours, phi.primitives, places, strict=True):
        expected = np.mean(own, axis=0)
        for bound in primitive.box.bounds:
            if np.isfinite([bound.lower, bound.upper]).all():
                expected[VARIABLES.index(bound.variable)] = (bound.lower + bound.upper) / 2
        np.testing.assert_allclose(row, expected)


@pytest.mark.parametrize("y", [[1], [-1]])
def test_without_an_example_there_are_no_landmarks(y: list[int]):
    with pytest.raises(DataError, match=r"no trajectory with label 1 satisfies .*; give trajectories of its own task"):
        found("F[0,1] (x >= 5)", [[[0 if y == [1] else 9, 0], [1, 1]]], y)


def test_a_variable_that_the_data_do_not_have_is_named():
    with pytest.raises(UnknownVariableError, match="speed"):
        found("F[0,1] (speed >= 5)", [[[0, 0], [1, 1]]], [1])
