from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.automata.twins import walk
from tests.strategies import VARIABLES, random_trajectories, sdnfs, trajectories
from tickwise.automata.build import timed_automata
from tickwise.automata.monitor import Monitor
from tickwise.automata.run import EdgeStep, letters_of, run
from tickwise.errors import DataError, FormulaError, UnknownVariableError
from tickwise.logic.sdnf import SDNF
from tickwise.logic.semantics import verdict


def followed(monitor: Monitor, X: np.ndarray) -> list[np.ndarray]:
    states = [monitor.start(X[0])]
    for row in X[1:]:
        states.append(monitor.advance(states[-1], row))
    return states


@settings(max_examples=50)
@given(sdnfs(), trajectories())
def test_locations_and_clocks_are_those_of_the_run_by_definition(sdnf: SDNF, X: np.ndarray):
    monitor = Monitor.of(sdnf, VARIABLES, reduce=False)
    states = followed(monitor, X)
    for index, automaton in enumerate(timed_automata(sdnf)):
        # the table's clocks stop at the last constant, past which no guard can tell values apart
        highest = monitor.tables[index].clocks.max(initial=0)
        steps = [step for step in run(automaton, X, variables=VARIABLES).steps if isinstance(step, EdgeStep)]
        for step, state in zip(steps, states, strict=True):
            assert monitor.tables[index].location[state[index]] == step.target
            clocks = monitor.tables[index].clocks[state[index]].tolist()
            assert clocks == [min(value, highest) for value in step.after]
        word = letters_of(automaton, X, variables=VARIABLES).tolist()
        assert walk(automaton, word)[-1][0] == steps[-1].target


@settings(max_examples=30)
@given(sdnfs(), trajectories(), st.booleans())
def test_the_verdict_at_each_tick_is_that_of_the_semantics_on_what_was_read(sdnf: SDNF, X: np.ndarray, reduce: bool):
    monitor = Monitor.of(sdnf, VARIABLES, reduce=reduce)
    for tick, states in enumerate(followed(monitor, X)):
        assert int(monitor.verdict(states)) == int(verdict(sdnf.formula, X[: tick + 1], variables=VARIABLES))


@settings(max_examples=50)
@given(sdnfs(), st.integers(0, 2**32 - 1))
def test_many_side_by_side_are_each_as_if_alone(sdnf: SDNF, seed: int):
    monitor = Monitor.of(sdnf, VARIABLES)
    X = random_trajectories(seed, 6, 8, 2)
    block = X.reshape(2, 3, 8, 2)
    states = monitor.start(block[:, :, 0])
    for tick in range(1, 8):
        states = monitor.advance(states, block[:, :, tick])
    assert states.shape == (2, 3, len(sdnf.disjuncts))
    alone = np.array([followed(monitor, each)[-1] for each in X])
    np.testing.assert_array_equal(states.reshape(6, -1), alone)
    np.testing.assert_array_equal(monitor.verdict(states).reshape(6), monitor.verdict(alone))
    np.testing.assert_array_equal(
        monitor.choose(block[:, :, 0]).reshape(6), [int(monitor.choose(each[0])) for each in X]
    )


def test_columns_that_the_formula_does_not_name_change_nothing():
    narrow = Monitor.of("F[0,3] (x >= 2)", ("x",))
    wide = Monitor.of("F[0,3] (x >= 2)", ("speed", "x"))
    for value in (1.0, 2.0, 3.0):
        assert narrow.start([value]) == wide.start([99.0, value])


def distance_by_hand(sdnf: SDNF, index: int, features: dict[str, float]) -> float:
    """The distance of Step 3: to the centre where a range is closed, else how far outside."""
    total = 0.0
    for bound in sdnf.disjuncts[index].primitives[0].box.bounds:
        value = features[bound.variable]
        if math.isinf(bound.lower):
            away = max(0.0, value - bound.upper)
        elif math.isinf(bound.upper):
            away = max(0.0, bound.lower - value)
        else:
            away = abs(value - (bound.lower + bound.upper) / 2)
        total += away**2
    return math.sqrt(total)


@given(sdnfs(), trajectories(shortest=1, longest=1))
def test_the_nearest_disjunct_is_chosen_and_the_lower_one_of_two(sdnf: SDNF, X: np.ndarray):
    features = dict(zip(VARIABLES, X[0].tolist(), strict=True))
    distances = [distance_by_hand(sdnf, index, features) for index in range(len(sdnf.disjuncts))]
    assert int(Monitor.of(sdnf, VARIABLES).choose(X[0])) == distances.index(min(distances))


def test_an_infinite_feature_is_infinitely_far_from_what_it_is_not_in():
    monitor = Monitor.of("F[0,3] (x <= 2) | F[0,3] (x >= 4)", ("x",))
    assert int(monitor.choose([np.inf])) == 1
    assert int(monitor.choose([-np.inf])) == 0
    assert int(monitor.verdict(monitor.start([np.inf]))) == 1


def test_a_variable_that_is_no_feature_is_named():
    with pytest.raises(UnknownVariableError, match="variable 'speed' is no feature; the features are x, y"):
        Monitor.of("F[0,3] (speed <= 2)", VARIABLES)


def test_what_has_no_normal_form_is_refused():
    with pytest.raises(FormulaError):
        Monitor.of("F[0,3] (x >= 2) & F[1,4] (y >= 2)", VARIABLES)
    with pytest.raises(FormulaError):
        Monitor.of("F[0,3] (x >=", VARIABLES)


@pytest.mark.parametrize(
    ("features", "message"),
    [
        ([1.0, 2.0, 3.0], r"shape \(3,\); use \(..., 2\)"),
        (1.0, r"shape \(\); use"),
        ([[1.0, 2.0], [1.0, math.nan]], "feature 'y' is NaN"),
    ],
)
def test_features_that_do_not_fit_are_refused(features: object, message: str):
    monitor = Monitor.of("F[0,3] (x >= 2 & y >= 1)", VARIABLES)
    with pytest.raises(DataError, match=message) as caught:
        monitor.start(features)
    assert "\n" not in str(caught.value)
