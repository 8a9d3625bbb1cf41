"""Seconds of an exact search of one primitive, beside the swarm and a scan of everything.

    python benchmarks/exact_search.py [--quick]

A node of Algorithm 1 on Case Study 1: real collections of Q-learning, 9×9 cells, 40 ticks, all four operators and both
polarities, with the information gain, on one core. Then how the search grows with the number of trajectories and with
the world, and what memory 100,000 trajectories take that are coded in parts. Times are medians of processor seconds;
what is compiled is compiled before. The scan looks at every box with the compiled tables of all windows and durations,
but bounds nothing; it leaves the information gain out.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.catalog import CASE_STUDY_1_SOURCE
from tickwise.envs.gridworld import GridWorld
from tickwise.experiments.case_studies import CASE_STUDY_1
from tickwise.inference.boxes import root, single, split
from tickwise.inference.exact import KINDS, ExactProblem, ExactResult, ExactSettings, exact_search, worth_of
from tickwise.inference.gains import gain_bound
from tickwise.inference.levels import Levels, code, code_parts
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
PART = 10_000


@dataclass(frozen=True)
class Row:
    """One measurement; ``size`` counts trajectories, or cells along a side of the world."""

    benchmark: str
    size: int
    contender: str
    seconds: float


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


def run_exact(data: LabelledTrajectories, prior: PathPrior, space: SearchSpace) -> ExactResult:
    """The exact search, coding included."""
    return exact_search(problem_of(data, prior, space), ExactSettings())


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


Contender = Callable[[LabelledTrajectories, PathPrior, SearchSpace], object]
CONTENDERS: dict[str, Contender] = {"exact": run_exact, "swarm": run_swarm, "scan": run_scan}


def seconds(work: Callable[[], object]) -> float:
    begin = time.process_time()
    work()
    return time.process_time() - begin


def one_node(quick: bool) -> Iterator[Row]:
    """Contenders in turn, on several collections."""
    world = CASE_STUDY_1_SOURCE.world
    prior, space = prior_of(world), SearchSpace.grid(world.size, TICKS)
    data = [collection(seed) for seed in range(3 if quick else 9)]
    for run in CONTENDERS.values():
        run(data[0].select(np.arange(-20, 20)), prior, space)  # compiles
    times: dict[str, list[float]] = {name: [] for name in CONTENDERS}
    for each in data:
        for name, run in CONTENDERS.items():
            repeats = 1 if quick or name == "swarm" else 3
            times[name].append(min(seconds(lambda run=run, each=each: run(each, prior, space)) for _ in range(repeats)))
    size = round(statistics.median(map(len, data)))
    for name in CONTENDERS:
        yield Row("one node of Case Study 1", size, name, statistics.median(times[name]))


def growth(quick: bool) -> Iterator[Row]:
    """More trajectories, and larger worlds."""
    world = GridWorld(9)
    prior, space = prior_of(world), SearchSpace.grid(9, TICKS)
    for count in (100, 1_000, 10_000) if quick else (100, 1_000, 10_000, 100_000):
        data = walks(np.random.default_rng(1), world, count)
        yield Row("trajectories, 9×9", count, "exact", seconds(lambda data=data: run_exact(data, prior, space)))
    for size in (9, 15) if quick else (9, 15, 20, 30):
        world = GridWorld(size)
        data, prior, space = (
            walks(np.random.default_rng(1), world, 1_000),
            prior_of(world),
            SearchSpace.grid(size, TICKS),
        )
        work = lambda data=data, prior=prior, space=space: run_exact(data, prior, space)  # noqa: E731
        yield Row("cells along a side, 1,000 trajectories", size, "exact", seconds(work))


def measure(quick: bool) -> list[Row]:
    """All rows of seconds; ``quick`` takes fewer and smaller ones."""
    return [*one_node(quick), *growth(quick)]


def coding(count: int) -> None:
    """Code trajectories that come in parts, and print how much memory that took; for a process of its own."""
    world, rng = GridWorld(9), np.random.default_rng(1)
    levels = Levels.of(SearchSpace.grid(9, TICKS), walks(rng, world, 2), 32)

    def parts() -> Iterator[tuple[LabelledTrajectories, NDArray[np.float64]]]:
        for _ in range(count // PART):
            yield walks(rng, world, PART), np.ones(PART)

    next(iter(parts()))
    code_parts([next(iter(parts()))], levels, TICKS)  # compiles, and takes what one part takes
    before = peak()
    coded = code_parts(parts(), levels, TICKS)
    held = sum(array.nbytes for array in coded)
    print(f"coding {count:,} trajectories in parts of {PART:,}: states of {(TICKS + 1) * 16} bytes each,")
    print(f"{held / count:.0f} bytes coded, {held / 2**20:.0f} MiB; peak {peak():.0f} MiB, {before:.0f} for one part")


def peak() -> float:
    """The most memory that this process has held, in MiB."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer and smaller measurements")
    parser.add_argument("--coding", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.coding:
        coding(options.coding)
        return 0
    print(f"{'benchmark':42}{'size':>9}  {'contender':10}{'seconds':>9}", flush=True)
    for rows in (one_node, growth):
        for row in rows(options.quick):
            print(f"{row.benchmark:42}{row.size:9,}  {row.contender:10}{row.seconds:9.3f}", flush=True)
    command = [sys.executable, __file__, "--coding", str(20_000 if options.quick else 100_000)]
    return subprocess.run(command, check=False, env=os.environ).returncode


if __name__ == "__main__":
    sys.exit(main())
