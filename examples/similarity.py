"""Does the similarity of two formulas say how much transfer helps? Random tasks, and what could have told in advance.

A group is a random target and five random sources of the same structure, each in a world of its own. Every source is
learned and its values are transferred (Algorithm 2, the true formulas); the speed-up is how many times fewer episodes
the target then takes to 95 % of the best. It is held against what is known before the first of them: distances between
the formulas, the values, and what becomes of them in a model of the target's world from random walks.

    python examples/similarity.py --groups 70 --runs 20 --out runs/similarity

Each group is a file; the same command again goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from statistics import fmean
from typing import Any

import joblib
import numpy as np
from numpy.typing import NDArray

from ranking import Group, draw_choices, draw_scatter, summary, table
from tickwise._files import write_bytes
from tickwise._seeding import generator, seed_sequence
from tickwise.envs.catalog import EnvironmentSpec
from tickwise.envs.estimation import estimated
from tickwise.envs.planning import best_success_probability
from tickwise.envs.random_tasks import Structure, random_task
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.walks import random_walks
from tickwise.errors import ConfigurationError
from tickwise.experiments.random_pairs import SETTINGS
from tickwise.inference.prior import PathPrior
from tickwise.inference.similarity import aligned_dissimilarity, disagreement, dissimilarity
from tickwise.logic.alignment import align, carried
from tickwise.logic.sdnf import SDNF
from tickwise.rl.learner import QLearning
from tickwise.rl.qlearning import Problem, QSettings, learn
from tickwise.rl.states import automaton_memory
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.promise import greedy_success
from tickwise.transfer.qtransfer import transfer_q
from tickwise.transfer.rehearsal import Goal, learning_times, rehearsal

TASKS = replace(SETTINGS, disjuncts=(1, 1))
"""Random tasks as in the study of random pairs, of one disjunct."""

LEARNING = QSettings(initial=40.0)
FORM = QLearning(LEARNING)


@dataclass(frozen=True)
class Plan:
    """What is done for each group.

    Attributes:
        seed: The root seed.
        runs: How often each target is learned, with each source's values and without any.
        sources: Sources of a target.
        source_episodes: Episodes of learning in a source.
        walks: Random walks that a model of the target's world is from, for each model.
        rehearsals: How often each target is learned in a model of it.
        goal: When a target counts as learned.
    """

    seed: int = 0
    runs: int = 20
    sources: int = 5
    source_episodes: int = 150_000
    walks: tuple[int, ...] = (500, 5_000)
    rehearsals: int = 10
    goal: Goal = field(default_factory=Goal)

    def rng(self, *path: str | int) -> np.random.Generator:
        """The draws at a place in the experiment."""
        return generator(self.seed, "similarity", *path)

    def root(self, *path: str | int) -> int:
        """A root seed for a place in the experiment."""
        return int(seed_sequence(self.seed, "similarity", *path).generate_state(1)[0])


def tasks(plan: Plan, group: int) -> list[EnvironmentSpec]:
    """A random target, then its sources."""
    rng = plan.rng(group, "tasks")
    while True:
        try:
            target = random_task(rng, settings=TASKS)
            return [target, *(random_task(rng, structure_of(target), settings=TASKS) for _ in range(plan.sources))]
        except ConfigurationError:  # rare structures are hardly ever neither trivial nor hopeless
            continue


def structure_of(env: EnvironmentSpec) -> Structure:
    """The operators of a task's formula, each with whether its predicate is a complement."""
    return tuple(
        tuple((primitive.operator, primitive.complemented) for primitive in disjunct.primitives)
        for disjunct in formula_of(env).disjuncts
    )


def formula_of(env: EnvironmentSpec) -> SDNF:
    """The true formula of a task."""
    return env.task.sdnf  # type: ignore[union-attr]


def problem(env: EnvironmentSpec, mdp: TabularMDP) -> Problem:
    """A task on the extended states of its true formula, in its world or a model of it."""
    return Problem(mdp, env.task.table(mdp), automaton_memory(mdp, tick_tables(formula_of(env), env.task.deadline)))


def transferred(plan: Plan, source: Problem, target: Problem, *place: str | int) -> NDArray[np.float32]:
    """What was learned in a source, as values of the target."""
    values = source.initial_q(LEARNING)
    learn(source, values, LEARNING, plan.rng(*place), plan.source_episodes)
    return transfer_q(source.mdp, source.memory, values, target.mdp, target.memory, LEARNING.initial)


def distances(source: EnvironmentSpec, target: EnvironmentSpec) -> dict[str, float]:
    """Everything that needs the formulas only, and the target's world as a graph.

    Regions and shifts are in cells, windows and delays in ticks, each the mean over x and y where there are two.
    """
    near, far, mdp = formula_of(source), formula_of(target), target.mdp()
    # long enough for both formulas, so that nothing is undecided at its end
    horizon = max(target.task.deadline, *(each.disjuncts[0].primitives[-1].end for each in (near, far)))
    prior = PathPrior(mdp.support_graph(), mdp.coordinates, mdp.variables, horizon)
    found = align(near, far)
    return {
        "disagreement": disagreement(near, far, prior),
        "dissimilarity": dissimilarity(near, far, prior),
        "aligned dissimilarity": aligned_dissimilarity(near, far, prior),
        "carried dissimilarity": dissimilarity(carried(near, far), far, prior),
        "regions": fmean(found.regions.values()),
        "windows": found.windows,
        "shift": fmean(map(abs, found.shifts.values())),
        "delay": abs(found.delay),
    }


def measured(plan: Plan, group: int) -> Group:
    """All of one group: the episodes that its target takes, and what each predictor says."""
    target_env, *source_envs = tasks(plan, group)
    world = target_env.mdp()
    target = problem(target_env, world)
    walks = {n: random_walks(world, target.task, n, plan.rng(group, "walks", n)) for n in plan.walks}
    models = {
        f"{n:,} walks": problem(target_env, estimated(world, walks[n].states, walks[n].actions)) for n in plan.walks
    }
    models["true model"] = target

    def rehearsed(model: Problem, q: NDArray[np.float32] | None) -> float:
        time = rehearsal(model, q, plan.root(group, "rehearsal"), plan.rehearsals, form=FORM, goal=plan.goal)
        return max(time, plan.goal.step)

    alone = {name: rehearsed(model, None) for name, model in models.items()}
    sources = []
    for number, env in enumerate(source_envs):
        q = transferred(plan, problem(env, env.mdp()), target, group, "source", number)
        said = distances(env, target_env)
        start = q[target.memory.start, np.arange(world.n_states)].max(axis=1)
        said["value at the start"] = float(world.initial @ start)
        for name, model in models.items():
            said[f"promise, {name}"] = promise = greedy_success(model, q)
            said[f"promise × likeness, {name}"] = promise * (1 - said["carried dissimilarity"])
            said[f"rehearsal, {name}"] = alone[name] / rehearsed(model, q)
        times = learning_times(target, q, plan.root(group, "learn"), plan.runs, form=FORM, goal=plan.goal)
        sources.append({**described(env), "episodes": times, "predictors": said})
    return {
        "plan": asdict(plan),
        "group": group,
        "target": described(target_env),
        "episodes": learning_times(target, None, plan.root(group, "learn"), plan.runs, form=FORM, goal=plan.goal),
        "learned in models": {
            name: modelled(plan, model, target, group, name) for name, model in models.items() if model is not target
        },
        "sources": sources,
    }


def modelled(plan: Plan, model: Problem, target: Problem, *place: str | int) -> float:
    """The success in the target of a policy learned in a model of it, as a share of the best policy's."""
    values = model.initial_q(LEARNING)
    learn(model, values, LEARNING, plan.rng(*place, "modelled"), plan.source_episodes)
    return greedy_success(target, values) / best_success_probability(target.mdp, target.task)


def described(env: EnvironmentSpec) -> dict[str, Any]:
    """A task in a few words."""
    return {
        "formula": str(formula_of(env)),
        "primitives": formula_of(env).size,
        "size": env.world.size,  # type: ignore[union-attr]
        "deadline": env.task.deadline,
        "ends": env.task.ends,  # type: ignore[union-attr]
    }


def kept(plan: Plan, group: int, folder: Path) -> Group | None:
    """A group from its file, if it has been measured by the same plan."""
    path = folder / f"{group:03d}.json"
    found: Group | None = json.loads(path.read_bytes()) if path.exists() else None
    return found if found is not None and found["plan"] == json.loads(json.dumps(asdict(plan))) else None


def added(plan: Plan, group: int, folder: Path) -> Group:
    """A group, measured and written to its file."""
    result = measured(plan, group)
    write_bytes(folder / f"{group:03d}.json", json.dumps(result, indent=1).encode())
    return result


def all_groups(plan: Plan, count: int, folder: Path, workers: int) -> list[Group]:
    """Every group in order; those that are not kept are measured, and how far that is goes to stderr."""
    found = {group: result for group in range(count) if (result := kept(plan, group, folder)) is not None}
    missing = [group for group in range(count) if group not in found]
    print(f"{len(found)} of {count} groups are in {folder}", file=sys.stderr)
    began = time.monotonic()
    work = (joblib.delayed(added)(plan, group, folder) for group in missing)
    results = joblib.Parallel(n_jobs=workers, return_as="generator_unordered")(work)
    for done, result in enumerate(results, start=1):
        found[result["group"]] = result
        minutes = (time.monotonic() - began) / 60
        left = minutes / done * (len(missing) - done)
        print(f"{len(found)} of {count} groups, {minutes:.0f} min, about {left:.0f} to go", file=sys.stderr)
    return [found[group] for group in range(count)]


def main() -> None:
    """Measure, then print and draw what predicts the speed-up and what does not."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--groups", type=int, default=70, help="targets, each with five sources")
    parser.add_argument("--runs", type=int, default=20, help="runs of learning of each target and source")
    parser.add_argument("--seed", type=int, default=0, help="the root seed")
    parser.add_argument("--out", type=Path, default=Path("runs/similarity"), help="where the results go")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    arguments = parser.parse_args()
    plan = Plan(seed=arguments.seed, runs=arguments.runs)
    done = all_groups(plan, arguments.groups, arguments.out / "groups", arguments.workers)
    found = summary(done, plan.goal.most, plan.goal.step)
    write_bytes(arguments.out / "summary.json", json.dumps(found, indent=1).encode())
    print(table(found))
    draw_scatter(done, found, plan.goal.most, plan.goal.step, arguments.out / "similarity.png")
    draw_choices(found, arguments.out / "choices.png")
    print(f"the figures are in {arguments.out}")


if __name__ == "__main__":
    main()
