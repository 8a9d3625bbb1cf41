"""What a step costs in each form of learning, beside one of Q-learning's, in the same run.

The world, its task and the extended states are those of `benchmarks.learning`: the target of Case Study 1, whose
episodes never end early. Each form has its own settings, so that the forms visit different states. Nothing here says
how many steps a form needs: model-based learning plans anew after each episode, so that a step costs it thousands of
times as much, and it plays fewer of them here.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from benchmarks.contest import Contender, Turn, contest
from benchmarks.learning import WORLDS, build_problem
from benchmarks.result import OURS, Result
from tickwise.rl.forms import FORMS
from tickwise.rl.qlearning import Problem

PLANNING = {"model"}
"""The forms that play only a hundredth of the episodes, since they plan after each."""


def one_form(problem: Problem, name: str, episodes: int) -> Turn:
    rng, learner = np.random.default_rng(0), FORMS[name]().learner(problem)

    def turn() -> NDArray[np.float32]:
        learner.learn(rng, episodes)
        return learner.q

    return turn


def measure(quick: bool) -> list[Result]:
    results = []
    for size in WORLDS[:1] if quick else WORLDS[:3]:
        problem = build_problem(size)
        episodes, repetitions = (1_000, 5) if quick else (10_000, 21)
        contenders = []
        for name in FORMS:
            few = episodes // 100 if name in PLANNING else episodes
            turn = functools.partial(one_form, problem, name, few)
            steps = few * problem.task.horizon
            contenders.append(Contender(OURS if name == "q" else name, turn, steps, repetitions))
        results += contest("forms of learning (tickwise: Q-learning)", "step", contenders, axis="world", size=size)
    return results
