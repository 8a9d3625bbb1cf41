"""Recorded episodes: those that the evaluation plays, and nothing else changes because of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.experiments.tiny import TINY
from tickwise._seeding import generator, seed_sequence
from tickwise.experiments.jobs import evaluation_points, learning_problem
from tickwise.experiments.recording import EPISODES, PREFIX, greedy_episodes, recording_points
from tickwise.experiments.store import Store
from tickwise.rl.kernels import greedy_returns
from tickwise.rl.qlearning import Problem, learn
from tickwise.rl.stream import take_stream

FIXED = seed_sequence(TINY.seed, TINY.name, "evaluate")


def kernel_returns(problem: Problem, q: Any, episodes: int) -> Any:
    returns = np.empty(episodes, dtype=np.float32)
    greedy_returns(*problem.arrays, take_stream(np.random.default_rng(FIXED)), q, returns)
    return returns


@pytest.mark.parametrize("subject", ["source", "I", "II", "III"])
def test_what_is_recorded_is_what_the_evaluation_plays(finished: Path, subject: str):
    problem = learning_problem(TINY, Store(finished), subject)
    q = problem.initial_q(TINY.learning.settings)
    learn(problem, q, TINY.learning.settings, generator(0, "test"), 2_000)
    before = q.copy()
    found = greedy_episodes(problem, q, FIXED, 30, problem.memory)
    np.testing.assert_array_equal(found["returns"], kernel_returns(problem, q, 30))
    np.testing.assert_array_equal(q, before)
    assert len(np.unique(found["returns"])) > 1  # else agreement would say little


def test_states_actions_and_memory_belong_together(finished: Path):
    problem = learning_problem(TINY, Store(finished), "III")
    memory, mdp = problem.memory, problem.mdp
    found = Store(finished).load("learn-III-1")
    states, actions, remembered = (found[PREFIX + name] for name in ("states", "actions", "memory"))
    points, episodes, ticks = states.shape
    assert (episodes, ticks) == (EPISODES, problem.task.horizon + 1)
    for point, episode in np.ndindex(points, episodes):
        path, u = states[point, episode], remembered[point, episode]
        assert u[0] == memory.start[path[0]]
        (table,) = memory.tables
        assert found[PREFIX + "disjunct"][point, episode] == 0
        for t, action in enumerate(actions[point, episode]):
            outcomes = mdp.successor[path[t], action] == path[t + 1]
            assert (mdp.probability[path[t], action][outcomes] > 0).any()
            letters = memory.letter[path[t], action][outcomes]
            assert u[t + 1] in memory.delta[u[t], letters]
        assert table.verdict[u[-1]] != 0


def test_recordings_begin_before_learning_and_end_with_it(finished: Path):
    points = evaluation_points(TINY, 20_000)
    chosen = recording_points(points)
    assert chosen == [0, 400, 2_000, 20_000]
    for method in ("I", "II", "III", "IV"):
        found = Store(finished).load(f"learn-{method}-0")
        assert found[PREFIX + "at"].tolist() == chosen
        assert (found[PREFIX + "memory"][..., 0] >= 0).all()
    assert (Store(finished).load("learn-I-0")[PREFIX + "disjunct"] == -1).all()


@pytest.mark.parametrize(
    ("points", "chosen"),
    [
        ([0, 10], [0, 10]),
        ([0, 1, 5, 50, 100], [0, 5, 50, 100]),
        ([0, 2, 10, 99, 100], [0, 2, 10, 100]),
        ([0], [0]),
    ],
)
def test_each_point_is_recorded_once(points: list[int], chosen: list[int]):
    assert recording_points(points) == chosen
