"""The best primitive of a node of Algorithm 1, beside the swarm and a scan of everything, and how its search grows.

The node is the root of Case Study 1: real collections of Q-learning, 9×9 cells, 40 ticks, all four operators and both
polarities, with the information gain. The scan looks at every box with the compiled tables of windows and durations,
but bounds nothing; it leaves the information gain out. Neither may find more than the exact search. The search then
grows with the number of trajectories, and with the world for 1,000 trajectories.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from benchmarks.contest import Contender, Turn, contest
from benchmarks.result import OURS, Result
from tickwise.envs.catalog import CASE_STUDY_1_SOURCE
from tickwise.envs.gridworld import GridWorld
from tickwise.experiments.case_studies import CASE_STUDY_1
from tickwise.inference.boxes import root, single, split
from tickwise.inference.exact import KINDS, ExactProblem, ExactSettings, exact_search, worth_of
from tickwise.inference.gains import gain_bound
from tickwise.inference.levels import Levels, code
from tickwise.inference.objective import Objective
from tickwise.inference.prior import PathPrior
from tickwise.inference.scan import bound_all
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.starts import sampled_starts
from tickwise.inference.swarm import maximise
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import STRUCTURES
from tickwise.rl.qlearning import Problem, collect
from tickwise.rl.states import tau_memory

TICKS = 40
WEIGHT = CASE_STUDY_1.inference.information_weight
TRAJECTORIES = (100, 1_000, 10_000, 100_000)
WORLDS = (9, 12, 15, 20)


def prior_of(world: GridWorld) -> PathPrior:
    """The uniform prior over the world's paths."""
    mdp = world.mdp()
    return PathPrior(mdp.support_graph(), mdp.coordinates, variables=mdp.variables, horizon=TICKS)


def collection(seed: int, negatives: int = CASE_STUDY_1.collection.negatives) -> LabelledTrajectories:
    """What the study's data collection phase gives."""
    environment, phase = CASE_STUDY_1_SOURCE, CASE_STUDY_1.collection
    mdp, settings = environment.mdp(), CASE_STUDY_1.learning.settings
    if phase.epsilon is not None:
        settings = replace(settings, epsilon=phase.epsilon)
    problem, rng = Problem(mdp, environment.task_table(), tau_memory(mdp, phase.tau)), np.random.default_rng(seed)
    returns, paths = collect(problem, problem.initial_q(settings), settings, rng, phase.episodes)
    good = returns > 0
    chosen = np.concatenate([np.flatnonzero(good), rng.choice(np.flatnonzero(~good), negatives, replace=False)])
    return LabelledTrajectories.from_arrays(
        mdp.coordinates[paths[chosen]], np.where(good[chosen], 1, -1), mdp.variables
    )


def walks(rng: np.random.Generator, world: GridWorld, count: int) -> LabelledTrajectories:
    """Lazy random walks with label 1 iff they stay three ticks in a block of cells, and some labels turned round."""
    steps = np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])[rng.integers(0, 5, (count, TICKS))]
    cells = np.empty((count, TICKS + 1, 2), dtype=np.int64)
    cells[:, 0] = rng.integers(0, world.size, (count, 2))
    for tick in range(TICKS):
        cells[:, tick + 1] = np.clip(cells[:, tick] + steps[:, tick], 0, world.size - 1)
    inside = ((cells >= world.size // 3) & (cells < world.size // 3 + 2)).all(axis=2)
    good = (inside[:, 5:20] & inside[:, 6:21] & inside[:, 7:22]).any(axis=1) != (rng.random(count) < 0.02)
    return LabelledTrajectories.from_arrays(cells + 0.5, np.where(good, 1, -1), world.mdp().variables)


def problem_of(data: LabelledTrajectories, prior: PathPrior, space: SearchSpace) -> ExactProblem:
    """The search at the root of the tree."""
    levels = Levels.of(space, data, ExactSettings().levels)
    coded = code(data, np.ones(len(data)), levels, space.horizon)
    return ExactProblem(coded, levels, prior, space.gaps(), worth_of(coded, WEIGHT))


def run_exact(data: LabelledTrajectories, prior: PathPrior, space: SearchSpace) -> float:
    """The exact search, coding included."""
    return exact_search(problem_of(data, prior, space), ExactSettings()).value


def run_swarm(data: LabelledTrajectories, prior: PathPrior, space: SearchSpace) -> float:
    """The swarm over all structures, as Algorithm 1 calls it."""
    rng, swarm, values = np.random.default_rng(0), CASE_STUDY_1.swarm, []
    for pair in STRUCTURES:
        shape = shape_of([[pair]])
        objective = Objective(data, np.ones(len(data)), prior, space, shape, space.gaps(), WEIGHT)
        starts = sampled_starts(data, space, shape, swarm.restarts * swarm.particles // 2, rng)
        values.append(maximise(objective, *space.bounds(shape), space.units(shape), swarm, rng, starts).value)
    return max(values)


def run_scan(data: LabelledTrajectories, prior: PathPrior, space: SearchSpace) -> float:
    """The greatest classification rate, box after box."""
    problem = problem_of(data, prior, space)
    waiting, boxes = [root(problem.levels, *kind) for kind in KINDS], []
    while waiting:
        node = waiting.pop()
        if single(node):
            boxes.append(node)
        else:
            waiting += split(node)
    limits = gain_bound(prior.arrays(space.variables), problem.levels)
    worth = problem.worth._replace(information_weight=0.0)
    gaps = np.array(problem.gaps)
    return float(bound_all(problem.coded, np.array(boxes), gaps, worth, limits, TICKS + 1).max())


Search = Callable[[LabelledTrajectories, PathPrior, SearchSpace], float]
SEARCHES: dict[str, Search] = {OURS: run_exact, "swarm": run_swarm, "scan": run_scan}


def searching(search: Search, data: list[LabelledTrajectories], world: GridWorld) -> Turn:
    """One search of each data set; what is compiled is compiled before."""
    prior, space = prior_of(world), SearchSpace.grid(world.size, TICKS)
    small = walks(np.random.default_rng(0), world, 50)
    search(small, prior, space)
    return lambda: [search(each, prior, space) for each in data]


def none_better(exact: list[float], others: list[float]) -> bool:
    """Whether the exact search found the most."""
    return all(one >= other - 1e-9 for one, other in zip(exact, others, strict=True))


def contenders(
    names: tuple[str, ...], data: list[LabelledTrajectories], world: GridWorld, most: int
) -> list[Contender]:
    """Those of these names; the swarm is slow and searches once."""
    return [
        Contender(
            name, functools.partial(searching, SEARCHES[name], data, world), len(data), 1 if name == "swarm" else most,
            warm=False,
        )
        for name in names
    ]  # fmt: skip


def measure(quick: bool) -> list[Result]:
    search = functools.partial(contest, unit="search", agree=none_better)
    world = CASE_STUDY_1_SOURCE.world
    data = [collection(seed) for seed in range(1 if quick else 9)]
    results = search("node of Case Study 1", contenders=contenders(tuple(SEARCHES), data, world, 3))
    for count in TRAJECTORIES[:2] if quick else TRAJECTORIES:
        names = (OURS, "swarm") if count <= 1_000 else (OURS,)
        one = contenders(names, [walks(np.random.default_rng(1), world, count)], world, 1 if count > 10_000 else 3)
        results += search("best primitive", contenders=one, axis="trajectories", size=count)
    for size in WORLDS[:2] if quick else WORLDS:
        larger = GridWorld(size)
        one = contenders((OURS,), [walks(np.random.default_rng(1), larger, 1_000)], larger, 1)
        results += search("best primitive", contenders=one, axis="world", size=size)
    return results
