import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise.errors import ConfigurationError
from tickwise.inference.swarm import SwarmResult, SwarmSettings, climb, maximise

LOWER, UPPER, UNITS = np.full(4, -5.0), np.full(4, 9.0), np.ones(4)


def staircase(target):
    """Minus the distance from a whole-number point, after rounding; its best value is 0."""

    def objective(positions, incumbents):
        values = -np.abs(np.rint(positions) - target).sum(axis=1)
        return np.where(values > incumbents, values, -np.inf)  # as strict a pruning as is allowed

    return objective


@given(target=st.lists(st.integers(-5, 9), min_size=4, max_size=4), seed=st.integers(0, 1000))
def test_a_simple_peak_is_always_found(target, seed):
    settings = SwarmSettings(particles=12, iterations=20, restarts=1, stall=10)
    rng = np.random.default_rng(seed)
    found = maximise(staircase(np.array(target)), LOWER, UPPER, UNITS, settings, rng)
    assert found.value == 0
    assert np.rint(found.position).tolist() == target


@given(seed=st.integers(0, 100))
def test_no_particle_leaves_the_box_and_pruning_changes_nothing(seed):
    settings, results = SwarmSettings(particles=8, iterations=15, stall=15), []
    for prune in (False, True):

        def objective(positions, incumbents, prune=prune):
            assert (positions >= LOWER).all()
            assert (positions <= UPPER).all()
            values = np.cos(positions * 3).sum(axis=1) - (positions**2).sum(axis=1) / 20
            return np.where(values > incumbents, values, -np.inf) if prune else values

        results.append(maximise(objective, LOWER, UPPER, UNITS, settings, np.random.default_rng(seed)))
    assert results[0].value == results[1].value
    assert (results[0].position == results[1].position).all()
    assert results[0].evaluations == results[1].evaluations


def test_starts_are_used_and_equal_seeds_give_equal_results():
    def needle(positions, _):
        return (np.abs(positions - np.array([1.25, 2, 3, 4])).max(axis=1) < 1e-9).astype(float)

    start = np.array([[1.25, 2.0, 3.0, 4.0]])
    found = maximise(needle, LOWER, UPPER, UNITS, SwarmSettings(restarts=3), np.random.default_rng(0), start)
    assert found.value == 1
    runs = [
        maximise(staircase(np.zeros(4)), LOWER, UPPER, UNITS, SwarmSettings(), np.random.default_rng(5)) for _ in "ab"
    ]
    assert (runs[0].position == runs[1].position).all()


def test_the_climb_ends_where_no_step_is_better():
    target = np.array([3, -2, 0, 8])
    objective = staircase(target)
    start = SwarmResult(np.zeros(4), float(objective(np.zeros((1, 4)), np.array([-np.inf]))[0]), 1)
    steps = np.vstack((np.diag(UNITS), -np.diag(UNITS)))
    assert climb(objective, LOWER, UPPER, steps, start).position.tolist() == target.tolist()


@pytest.mark.parametrize("name", ["particles", "iterations", "restarts", "stall", "climbers"])
def test_wrong_counts(name):
    with pytest.raises(ConfigurationError, match=f"{name} is 0"):
        SwarmSettings(**{name: 0})


def test_wrong_factors():
    with pytest.raises(ConfigurationError, match="inertia is -1"):
        SwarmSettings(inertia=-1)
