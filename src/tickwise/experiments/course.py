"""The course of learning: training returns, evaluations of the greedy policy on fixed seeds, and recorded episodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._seeding import generator, seed_sequence
from tickwise.envs.planning import optimal_value
from tickwise.experiments.job import Job, Outcome, Report
from tickwise.experiments.measures import block_means, goal_reached
from tickwise.experiments.recording import PREFIX, Recorder, recording_points
from tickwise.experiments.study import StudySpec
from tickwise.rl.learner import Learner
from tickwise.rl.qlearning import evaluate
from tickwise.rl.states import Memory


def learning_course(
    job: Job,
    spec: StudySpec,
    learner: Learner,
    memory: Callable[[], Memory],
    points: Sequence[int],
    report: Report,
) -> Outcome:
    """Learn to the last of the points, and look at the greedy policy at each of them.

    Args:
        job: What learns.
        spec: The study.
        learner: Its learner.
        memory: Tells the τ-states or extended states that it learns on, without what its form puts into them.
        points: The numbers of episodes after which the greedy policy is evaluated, ascending from 0.
        report: Told of the progress.

    Returns:
        The run, its episodes and when it reached the study's goal, with the curves and the recorded episodes; and the
        formula of each recording for Method V, whose formula changes on the way.
    """
    learning, episodes = spec.learning, points[-1]
    rng = generator(spec.seed, spec.name, "learn", job.subject, job.run)
    fixed = seed_sequence(spec.seed, spec.name, "evaluate")
    recorder, recorded = Recorder(fixed), recording_points(points)
    values: list[float] = []

    def look(learned: int) -> None:
        problem, q = learner.problem, learner.q
        values.append(evaluate(problem, q, fixed, learning.evaluation_episodes))
        if learned in recorded:
            recorder.record(learned, problem, q, memory())

    look(points[0])
    parts = []
    for before, now in pairwise(points):
        report(before, episodes)
        parts.append(learner.learn(rng, now - before)[0])
        look(now)
    returns = np.concatenate(parts)
    arrays: dict[str, NDArray[Any]] = {
        "blocks": block_means(returns, learning.block),
        "evaluation_episodes": np.array(points, dtype=np.int64),
        "evaluation_returns": np.array(values, dtype=np.float64),
        **recorder.arrays(),
    }
    optimum = optimal_value(learner.problem.mdp, learner.problem.task)
    facts: dict[str, Any] = {
        "run": job.run,
        "episodes": episodes,
        "goal": goal_reached(returns, learning.goal, optimum),
    }
    if job.subject == "V":  # its formula changes on the way
        facts[PREFIX + "formulas"] = recorder.formulas
    return Outcome(facts, arrays)
