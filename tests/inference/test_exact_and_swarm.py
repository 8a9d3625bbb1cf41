"""The exact search is never worse than the swarm, on data as in Case Study 1."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.inference.exhaustive import problem_of
from tickwise.envs.catalog import CASE_STUDY_1_SOURCE, CASE_STUDY_1_TARGET, EnvironmentSpec
from tickwise.inference.exact import ExactSettings, exact_search
from tickwise.inference.objective import Objective
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.starts import sampled_starts
from tickwise.inference.swarm import SwarmSettings, maximise
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import STRUCTURES
from tickwise.rl.qlearning import Problem, QSettings, collect
from tickwise.rl.states import tau_memory

TICKS = 40
SPACE = SearchSpace.grid(9, TICKS)


@cache
def world(target: bool) -> tuple[EnvironmentSpec, Problem, PathPrior]:
    """An environment of Case Study 1, its learning problem, and the prior over its paths."""
    environment = CASE_STUDY_1_TARGET if target else CASE_STUDY_1_SOURCE
    mdp = environment.mdp()
    prior = PathPrior(mdp.support_graph(), mdp.coordinates, variables=mdp.variables, horizon=TICKS)
    return environment, Problem(mdp, environment.task_table(), tau_memory(mdp, 5)), prior


def case(seed: int) -> tuple[LabelledTrajectories, PathPrior]:
    """Every third data set is a collection of Q-learning, the others are random walks, one kind labelled by chance."""
    rng = np.random.default_rng(seed)
    environment, problem, prior = world(seed % 2 == 1)
    mdp, kind = environment.mdp(), seed % 3
    settings = QSettings(epsilon=0.02 if kind == 0 else 1.0)
    returns, paths = collect(problem, problem.initial_q(settings), settings, rng, 10_000 if kind < 2 else 200)
    good = returns > 0 if kind < 2 else rng.random(len(returns)) < 0.3
    if good.sum() < 3:  # the best that there are
        good[np.argsort(-(paths == paths[:, :1]).sum(axis=1), kind="stable")[:20]] = True
    others = np.flatnonzero(~good)
    chosen = np.concatenate([np.flatnonzero(good)[:60], rng.choice(others, min(200, len(others)), replace=False)])
    labels = np.where(good[chosen], 1, -1)
    return LabelledTrajectories.from_arrays(mdp.coordinates[paths[chosen]], labels, mdp.variables), prior


def swarm_value(data: LabelledTrajectories, prior: PathPrior, information_weight: float, seed: int) -> float:
    """The best J that the swarm finds over all structures."""
    rng, swarm, values = np.random.default_rng(seed), SwarmSettings(), []
    for pair in STRUCTURES:
        shape = shape_of([[pair]])
        objective = Objective(data, np.ones(len(data)), prior, SPACE, shape, SPACE.gaps(), information_weight)
        starts = sampled_starts(data, SPACE, shape, swarm.restarts * swarm.particles // 2, rng)
        limits = SPACE.bounds(shape)
        values.append(maximise(objective, *limits, SPACE.units(shape), swarm, rng, starts).value)
    return max(values)


def compare(seed: int, information_weight: float = 0.01) -> float:
    """How much better the exact search is than the swarm, in units of J."""
    data, prior = case(seed)
    result = exact_search(problem_of(data, prior, SPACE, information_weight=information_weight), ExactSettings())
    assert result.proved
    return result.value - swarm_value(data, prior, information_weight, seed)


@pytest.mark.parametrize("seed", range(2))
def test_never_worse_than_the_swarm(seed):
    assert compare(seed) >= -1e-12


@pytest.mark.slow
def test_never_worse_than_the_swarm_on_a_hundred_data_sets():
    assert min(compare(seed) for seed in range(2, 100)) >= -1e-12
