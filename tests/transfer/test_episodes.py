"""Tests of the record of an agent's episodes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tickwise.envs.catalog import CASE_STUDY_1_TARGET, CASE_STUDY_2_TARGET, EnvironmentSpec
from tickwise.envs.environment import GridWorldEnv
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.temporal import FormulaTask
from tickwise.errors import DataError
from tickwise.rl.learner import QLearning
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.states import tick_memory
from tickwise.transfer.episodes import SHARES, Episodes, Good, good_return, unbroken


def line(formula: str = "G[0,3] (x <= 2)", deadline: int = 3, ends: str = "violated") -> Problem:
    """Three cells in a row, all of which may follow each other, and a task that is over as soon as it is violated."""
    mdp = TabularMDP(
        successor=np.broadcast_to(np.arange(3)[:, None], (3, 3, 1)),
        probability=np.ones((3, 3, 1)),
        initial=np.full(3, 1 / 3),
        cell=np.arange(3),
        cell_coordinates=np.array([[0.5], [1.5], [2.5]]),
        variables=("x",),
        limits=((0.0, 3.0),),
    )
    task = FormulaTask(formula, deadline, ends=ends)  # type: ignore[arg-type]
    return Problem(mdp, task.table(mdp), tick_memory(mdp, deadline))


def added(problem: Problem, is_good: Good, returns: list[float], paths: list[list[int]]) -> Episodes:
    episodes = Episodes(problem, is_good)
    full = np.array([[*path, *[-1] * (problem.task.horizon + 1 - len(path))] for path in paths], np.int32)
    episodes.add(np.array(returns, np.float32), full)
    return episodes


def states(values: NDArray[np.float64], length: int) -> list[float]:
    assert np.isnan(values[length:]).all()
    return values[:length, 0].tolist()


def test_what_is_good():
    returns, ended = np.array([0.0, -1.0, 2.0, 2.0], np.float32), np.array([False, True, False, True])
    assert good_return(returns, ended).tolist() == [False, False, True, True]
    assert unbroken(returns, ended).tolist() == [True, False, True, False]


def test_labels_and_prefixes():
    # broken at tick 3, kept, broken at tick 1: without the last state there is no step left, and kept again
    paths = [[0, 1, 0, 2], [0, 0, 1, 1], [0, 2], [1, 1, 1, 0]]
    episodes = added(line(), good_return, [-10, 100, -10, 100], paths)
    data, weights = episodes.labelled()
    assert data.variables == ("x",)
    assert data.labels.tolist() == [-1, 1, -1, 1, 1]
    assert data.lengths.tolist() == [4, 4, 2, 4, 3]
    expected = [[0.5, 1.5, 0.5, 2.5], [0.5, 0.5, 1.5, 1.5], [0.5, 2.5], [1.5, 1.5, 1.5, 0.5], [0.5, 1.5, 0.5]]
    assert [states(*each) for each in zip(data.values, data.lengths, strict=True)] == expected
    # the bad ones share a half, the good ones two fifths, and what was not broken yet has the rest
    np.testing.assert_allclose(weights, [0.25, 0.2, 0.25, 0.2, 0.1])
    plain, weights = episodes.labelled(prefixes=False)
    assert plain.labels.tolist() == [-1, 1, -1, 1]
    np.testing.assert_allclose(weights, [0.25, 0.2, 0.25, 0.2])


def test_only_bad_episodes_that_the_task_ended_have_prefixes():
    # what the deadline ended may be wrong anywhere
    never = added(line(ends="deadline"), good_return, [-10, -10, 100], [[0, 1, 0, 2], [2, 2, 0, 0], [0, 0, 0, 0]])
    assert never.labelled()[0].labels.tolist() == [-1, -1, 1]
    # what ended in success is good without its last state, too, or not: it says nothing
    reach = line("F[1,3] (x >= 2)", ends="decided")
    ended = added(reach, good_return, [100, -10], [[0, 1, 2], [0, 0, 1, 1]])
    data, _ = ended.labelled()
    assert data.labels.tolist() == [1, -1, 1]
    assert data.lengths.tolist() == [3, 4, 3]


def test_the_second_kind_of_good():
    episodes = added(line(), unbroken, [500, -800, 0], [[0, 1, 2], [0, 0, 0, 0], [0, 1, 0, 2]])
    assert episodes.good.tolist() == [False, True, False]
    data, weights = episodes.labelled()
    assert data.labels.tolist() == [-1, 1, -1, 1, 1]
    assert data.lengths.tolist() == [3, 4, 4, 2, 3]
    np.testing.assert_allclose(weights, [0.25, 0.4, 0.25, 0.05, 0.05])


@pytest.mark.parametrize(("good", "kinds"), [(True, [0.4]), (False, [0.5, 0.1])])
def test_weights_where_a_kind_is_missing(good: bool, kinds: list[float]):
    paths = [[0, 1, 1, 1], [1, 1, 1, 1]] if good else [[0, 1, 2], [1, 1, 2]]
    episodes = added(line(), good_return, [1, 1] if good else [0, 0], paths)
    data, weights = episodes.labelled()
    assert len(data) == 2 * len(kinds)
    np.testing.assert_allclose(weights, np.repeat(kinds, 2) / 2)
    assert sum(SHARES) == 1


def test_a_record_grows():
    problem = line()
    episodes = Episodes(problem, good_return)
    assert len(episodes) == len(episodes.returns) == len(episodes.good) == 0
    assert episodes.paths.shape == (0, 4)
    # where episodes begin is not known yet
    assert episodes.starts.tolist() == [0, 1, 2]
    good = [
        episodes.add(np.array([1.0], np.float32), np.array([[1, 1, 1, 1]], np.int32)),
        episodes.add(np.array([-1.0, 0.0], np.float32), np.array([[0, 2, -1, -1], [1, 2, -1, -1]], np.int32)),
    ]
    assert [each.tolist() for each in good] == [[True], [False, False]]
    assert len(episodes) == 3
    assert episodes.good.tolist() == [True, False, False]
    assert episodes.returns.tolist() == [1, -1, 0]
    assert episodes.paths.tolist() == [[1, 1, 1, 1], [0, 2, -1, -1], [1, 2, -1, -1]]
    assert episodes.starts.tolist() == [1, 0, 1]


def test_without_episodes_there_are_no_trajectories():
    with pytest.raises(DataError, match="give at least one trajectory"):
        Episodes(line(), good_return).labelled()


def test_an_episode_of_a_single_tick():
    problem = line("G[0,1] (x <= 2)", deadline=1)
    episodes = added(problem, good_return, [-10, 100], [[0, 2], [0, 0]])
    data, weights = episodes.labelled()
    assert data.labels.tolist() == [-1, 1]
    np.testing.assert_allclose(weights, [0.5, 0.4])


def compare(spec: EnvironmentSpec, ticks: int, count: int) -> NDArray[np.bool_]:
    """Check `terminated` after each step of random episodes; which of them the environment ended within some ticks."""
    mdp = spec.mdp()
    problem = Problem(mdp, spec.task_table(), tick_memory(mdp, spec.task.deadline))
    env, rng = GridWorldEnv(spec), np.random.default_rng(0)
    ended = np.zeros(count, bool)
    for episode in range(count):
        path = np.full((1, spec.task.deadline + 1), -1, np.int32)
        path[0, 0] = env.reset(seed=int(rng.integers(2**31)))[1]["state"]
        for tick in range(1, ticks + 1):
            _, _, ended[episode], _, info = env.step(rng.integers(3))
            path[0, tick] = info["state"]
            assert problem.terminated(path) == [ended[episode]]
            if ended[episode]:
                break
    return ended


@pytest.mark.parametrize("ends", ["deadline", "violated", "decided"])
@pytest.mark.parametrize("formula", ["G[0,4] F[0,2] !(x >= 2 & y >= 1)", "F[0,3] G[0,1] (x <= 1) | F[1,6] (y >= 3)"])
def test_terminated_is_what_the_environment_says(ends: str, formula: str):
    # the environment's own last tick, at which it always ends, is not reached: the formula is decided by tick 6
    task = FormulaTask(formula, 7, ends=ends)  # type: ignore[arg-type]
    ended = compare(EnvironmentSpec("Some", GridWorld(4), task), 6, 100)
    assert ended.all() if ends == "decided" else ended.any() == (ends == "violated")


@pytest.mark.parametrize(("spec", "some"), [(CASE_STUDY_1_TARGET, False), (CASE_STUDY_2_TARGET, True)])
def test_terminated_is_what_the_environment_says_in_the_case_studies(spec: EnvironmentSpec, some: bool):
    assert compare(spec, spec.task.deadline - 1, 30).any() == some


def test_an_end_at_the_deadline_may_be_the_task_s_own():
    problem = line()
    paths = np.array([[0, 1, 0, 2], [0, 1, 0, 1]], np.int32)
    assert problem.terminated(paths).tolist() == [True, False]


@pytest.mark.parametrize("is_good", [good_return, unbroken])
def test_episodes_of_a_learner(is_good: Good):
    mdp = GridWorld(3).mdp()
    task = FormulaTask("G[0,8] F[0,3] (x >= 1)", 12, ends="violated")
    problem = Problem(mdp, task.table(mdp), tick_memory(mdp, 12))
    learner = QLearning(QSettings(epsilon=1.0)).learner(problem)
    episodes = Episodes(problem, is_good)
    good = episodes.add(*learner.learn(np.random.default_rng(0), 100))
    np.testing.assert_array_equal(good, episodes.good)
    data, weights = episodes.labelled()
    broken = problem.terminated(episodes.paths)
    # the rule was either broken or kept, so both say the same
    np.testing.assert_array_equal(good, ~broken)
    assert 0 < broken.sum() < 100
    assert len(data) == 100 + broken.sum()
    assert weights.sum() == pytest.approx(1)
    np.testing.assert_array_equal(data.lengths[100:], data.lengths[:100][broken] - 1)
