"""What transfer buys: none, Algorithm 2, each switch of `tickwise.transfer.variants.Transfer`, and several together.

Tasks are the two case studies with their true formulas, the lakes of `examples/frozenlake.py` (8×8 whose ice slips more
than the source's, and 8×8 from 4×4), and random pairs of similar tasks with their true formulas. Every run learns the
source once, and then the target from what each variant makes of it, with the same random numbers; a greedy policy is
played every so many episodes. Counted are the episodes until the first such policy with a share of what is possible,
0 being the worst return and 1 the optimal value V*, and the mean share over the first episodes.

Random pairs are told together: of each pair, how many times the episodes of Algorithm 2 a variant needs, the geometric
mean over its runs, where a run that never gets there counts with all its episodes; and how much the mean share differs.

Run it as ``python -m benchmarks.transfer``; ``--help`` lists the options. It takes an hour on two cores.
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from tickwise._seeding import generator, seed_sequence
from tickwise.envs.enumeration import tabulate
from tickwise.envs.planning import optimal_value, worst_value
from tickwise.envs.temporal import FormulaTask
from tickwise.experiments.case_studies import find_study
from tickwise.experiments.study import StudySpec, environment_of
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.qlearning import Problem, QSettings, evaluate
from tickwise.rl.states import automaton_memory
from tickwise.rl.trusting import Trusting
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.qtransfer import transfer_q
from tickwise.transfer.variants import Confidence, Transfer, transfer

NONE, PAPER = "no transfer", "Algorithm 2"
VARIANTS: dict[str, Transfer | None] = {
    NONE: None,
    PAPER: None,
    "visited": Transfer(visited=True),
    "visited within 2": Transfer(visited=True, within=2.0),
    "progress": Transfer(progress=True),
    "travel": Transfer(travel=True),
    "confidence": Transfer(confidence=Confidence()),
    "progress, travel": Transfer(progress=True, travel=True),
    "visited within 2, progress, travel": Transfer(visited=True, within=2.0, progress=True, travel=True),
    "all": Transfer(visited=True, within=2.0, progress=True, travel=True, confidence=Confidence()),
}
LEVELS = (0.3, 0.5, 0.8, 0.9, 0.95)
SEED = 0
RESAMPLES = 4_999


@dataclass(frozen=True)
class Task:
    """A source, a target, and how they are learned and looked at.

    Attributes:
        source: The source.
        target: The target.
        settings: Settings of Q-learning in the source and in the target.
        source_episodes: Episodes of learning in the source.
        episodes: Episodes of learning in the target.
        window: The first episodes, whose mean share is told.
        step: Episodes from one evaluation to the next, at first.
        plays: Episodes of an evaluation.
    """

    source: Problem
    target: Problem
    settings: tuple[QSettings, QSettings]
    source_episodes: int
    episodes: int
    window: int
    step: int = 100
    plays: int = 200

    @property
    def points(self) -> list[int]:
        """When the greedy policy is played: in the window at each step, later at each tenth."""
        return [*range(0, self.window, self.step), *range(self.window, self.episodes + 1, 10 * self.step)]


@functools.cache
def task(name: str) -> Task:
    """A task by its name: ``case1``, ``case2``, ``lake``, ``lake 4x4`` or a random pair such as ``pair-06``."""
    if name.startswith("lake"):
        settings = QSettings(alpha=0.1, epsilon=0.05, initial=50.0)
        source = lake("4x4", 0.9) if name.endswith("4x4") else lake("8x8", 0.95)
        return Task(source, lake("8x8", 0.9), (settings, settings), 100_000, 100_000, 20_000, 250, 500)
    spec = find_study(name)
    problems = [true_problem(spec, side) for side in ("source", "target")]
    learning = spec.learning
    return Task(*problems, (learning.source, learning.settings), learning.source_episodes, 100_000, 20_000)


def true_problem(spec: StudySpec, side: str) -> Problem:
    """The source or target of a study, with the extended states of its true formula."""
    environment = environment_of(spec, side)
    mdp = environment.mdp()
    tables = tick_tables(to_sdnf(parse(spec.true[side])), environment.task.deadline)
    return Problem(mdp, environment.task_table(), automaton_memory(mdp, tables))


def lake(layout: str, success_rate: float) -> Problem:
    """A lake with the example's requirement: stay in the corner where it begins, then be at the goal."""
    size, deadline = int(layout[0]), 36
    features = {"row": lambda cell: cell // size, "column": lambda cell: cell % size}
    mdp = tabulate(gymnasium.make("FrozenLake-v1", map_name=layout, success_rate=success_rate), features).mdp
    corner = f"(row <= {2 if size == 8 else 1} & column <= 1)"
    requirement = f"G[4,12] {corner} & F[13,{deadline}] (row >= {size - 1} & column >= {size - 1})"
    hidden = FormulaTask(requirement, deadline, reward=100, penalty=0)
    return Problem(mdp, hidden.table(mdp), automaton_memory(mdp, tick_tables(hidden.sdnf, deadline)))


def run(name: str, number: int) -> dict[str, dict[str, Any]]:
    """One run of all variants."""
    it = task(name)
    taught = Trusting(it.settings[0]).learner(it.source)
    rng = generator(SEED, name, "source", number)
    for _ in range(20):  # in parts, since a learner keeps the paths of each
        taught.learn(rng, it.source_episodes // 20)
    return {variant: learned(name, number, variant, taught.q, taught.visits) for variant in VARIANTS}


def learned(name: str, number: int, variant: str, q: NDArray[np.float32], visits: NDArray[np.uint32]) -> dict[str, Any]:
    """What one variant needs to learn the target."""
    it, how = task(name), VARIANTS[variant]
    settings, begun, confidence = it.settings[1], None, None
    if variant == PAPER:
        begun = transfer_q(it.source.mdp, it.source.memory, q, it.target.mdp, it.target.memory, settings.initial)
    elif how is not None:
        found = transfer(it.source, q, visits, it.target, settings.initial, how)
        begun, confidence = found.q, found.confidence
    learner = Trusting(settings).learner(it.target, begun, confidence)
    rng, fixed = generator(SEED, name, "target", number), seed_sequence(SEED, name, "evaluate")
    best, worst = optimal_value(it.target.mdp, it.target.task), worst_value(it.target.mdp, it.target.task)
    shares = []
    for before, now in zip([0, *it.points], it.points, strict=False):
        learner.learn(rng, now - before)
        shares.append((evaluate(it.target, learner.q, fixed, it.plays) - worst) / (best - worst))
    early = shares[: it.window // it.step + 1]
    return {
        "start": shares[0],
        "mean": float(np.trapezoid(early) / (len(early) - 1)),
        "episodes": {f"{level:.0%}": first(shares, it.points, level) for level in LEVELS},
    }


def first(shares: Sequence[float], points: Sequence[int], level: float) -> int | None:
    """The episodes before the first evaluation at a level; None if there is none."""
    return next((point for point, share in zip(points, shares, strict=True) if share >= level), None)


def median_interval(values: Sequence[float | None]) -> list[float | None]:
    """The median and its 95 % bootstrap interval; None is more than all others, and what is more than all is None."""
    numbers = np.array([math.inf if value is None else value for value in values])
    draws = np.random.default_rng(SEED).choice(numbers, (RESAMPLES, len(numbers)))
    middles = np.sort([_median(draw) for draw in draws])
    ends = middles[[round(0.025 * (RESAMPLES - 1)), round(0.975 * (RESAMPLES - 1))]]
    return [float(x) if math.isfinite(x) else None for x in (_median(numbers), *ends)]


def _median(numbers: NDArray[np.float64]) -> float:
    ordered = np.sort(numbers)
    low, high = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return float(low if low == high else (low + high) / 2)


Runs = list[dict[str, dict[str, Any]]]


def of_one(runs: Runs) -> dict[str, dict[str, Any]]:
    """The runs of one task told together: for each variant and measure the median and its interval."""

    def told(variant: str, get: Callable[[dict[str, Any]], float | None]) -> list[float | None]:
        return median_interval([get(each[variant]) for each in runs])

    return {
        variant: {
            "start": told(variant, lambda result: result["start"]),
            "mean": told(variant, lambda result: result["mean"]),
            **{
                level: told(variant, lambda result, level=level: result["episodes"][level])
                for level in runs[0][variant]["episodes"]
            },
        }
        for variant in runs[0]
    }


def of_pairs(pairs: dict[str, Runs]) -> dict[str, dict[str, Any]]:
    """All pairs told together, compared with Algorithm 2 pair by pair."""
    result: dict[str, dict[str, Any]] = {}
    for variant in VARIANTS:
        gains = [np.mean([run[variant]["mean"] - run[PAPER]["mean"] for run in runs]) for runs in pairs.values()]
        result[variant] = {"mean": median_interval([float(gain) for gain in gains])}
        for level in (f"{level:.0%}" for level in LEVELS):
            ratios = [
                float(
                    np.exp(np.mean([_log(name, run, variant, level) - _log(name, run, PAPER, level) for run in runs]))
                )
                for name, runs in pairs.items()
            ]
            result[variant][level] = median_interval(ratios)
    return result


def _log(name: str, run: dict[str, dict[str, Any]], variant: str, level: str) -> float:
    """The logarithm of a run's episodes, at least one step and at most all."""
    episodes = run[variant]["episodes"][level]
    return math.log(max(task(name).episodes if episodes is None else episodes, task(name).step))


def table(title: str, told: dict[str, dict[str, Any]], plain: Sequence[str]) -> str:
    """A table in Markdown; measures in `plain` are shares and ratios, the others episodes."""
    heads = list(told[NONE])
    lines = [f"\n{title}\n", f"| Variant | {' | '.join(heads)} |", f"| --- |{' ---: |' * len(heads)}"]
    for variant, measures in told.items():
        cells = [_cell(measures[head], "{:.2f}" if head in plain else "{:,.0f}") for head in heads]
        lines.append(f"| {variant} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(values: Sequence[float | None], form: str) -> str:
    middle, low, high = ("never" if value is None else form.format(value) for value in values)
    return f"{middle} [{low}, {high}]"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--tasks", nargs="*", default=["case1", "case2", "lake", "lake 4x4"], help="tasks of their own")
    parser.add_argument("--runs", type=int, default=10, help="runs of each (10)")
    parser.add_argument("--pairs", type=int, default=20, help="random pairs (20)")
    parser.add_argument("--pair-runs", type=int, default=5, help="runs of each pair (5)")
    parser.add_argument("--workers", type=int, default=2, help="processes (2)")
    parser.add_argument("--out", type=Path, default=Path("runs/transfer"), help="where the results go (runs/transfer)")
    options = parser.parse_args()
    names = [*options.tasks, *(f"pair-{2 * number:02d}" for number in range(options.pairs))]
    begun = time.monotonic()
    results: dict[str, Runs] = {}
    with ProcessPoolExecutor(options.workers) as pool:
        jobs = {
            name: [
                pool.submit(run, name, number)
                for number in range(options.runs if name in options.tasks else options.pair_runs)
            ]
            for name in names
        }
        for name in names:
            results[name] = [job.result() for job in jobs[name]]
            if name in options.tasks:
                print(table(name, of_one(results[name]), ("start", "mean")), flush=True)
    told: dict[str, Any] = {name: of_one(runs) for name, runs in results.items()}
    if options.pairs:
        told["pairs"] = of_pairs({name: runs for name, runs in results.items() if name not in options.tasks})
        heads = list(told["pairs"][NONE])
        print(
            table("random pairs: difference of the mean share, times the episodes of Algorithm 2", told["pairs"], heads)
        )
    options.out.mkdir(parents=True, exist_ok=True)
    document = {"seed": SEED, "runs": results, "medians": told, "seconds": round(time.monotonic() - begun)}
    (options.out / "transfer.json").write_text(json.dumps(document, indent=1), encoding="utf-8")
    print(f"\nwritten to {options.out / 'transfer.json'} after {document['seconds']:,} s")


if __name__ == "__main__":
    main()
