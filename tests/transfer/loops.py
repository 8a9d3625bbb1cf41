"""Small quick targets for the closed loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import optimal_value
from tickwise.envs.temporal import FormulaTask
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.rl.qlearning import Problem, evaluate
from tickwise.rl.states import tick_memory
from tickwise.transfer.closed_loop import ClosedLoop, Target
from tickwise.transfer.episodes import Good, good_return, unbroken
from tickwise.transfer.settings import LoopSettings

QUICK: dict[str, Any] = {"hypotheses": 300, "candidates": 3, "fresh": 20}


def sdnf(text: str) -> SDNF:
    return to_sdnf(parse(text))


@dataclass(frozen=True)
class Case:
    """A source's formula and a target task in a gridworld."""

    source: str
    task: FormulaTask
    size: int = 4
    is_good: Good = good_return
    rate: float = 0.95

    @property
    def target(self) -> Target:
        mdp, deadline = GridWorld(self.size).mdp(), self.task.deadline
        problem = Problem(mdp, self.task.table(mdp), tick_memory(mdp, deadline))
        prior = PathPrior(mdp.support_graph(), mdp.coordinates, mdp.variables, deadline)
        space = SearchSpace.grid(self.size, deadline)
        return Target(problem, prior, space, InferenceSettings(size=4, rate=self.rate), self.is_good)

    def loop(self, seed: int = 0, **settings: Any) -> ClosedLoop:
        return ClosedLoop(self.target, sdnf(self.source), LoopSettings(**QUICK | settings), np.random.default_rng(seed))


STAY = Case("F[0,4] G[0,3] (x <= 1 & y <= 1)", FormulaTask("F[0,6] G[0,2] (x >= 3 & y >= 3)", 10))
"""Stay somewhere else, and not as long."""

EITHER = Case("F[0,5] (2 <= x <= 3 & y >= 2)", FormulaTask("F[0,6] (x >= 3 & y >= 3) | F[0,6] (x <= 1 & y <= 1)", 7))
"""Two copies of the source's structure."""

ERRAND = Case("F[2,5] (x >= 1 & y >= 2)", FormulaTask("F[0,4] (x <= 1) & F[5,8] (x >= 2)", 8), size=3)
"""No copies of the source's structure say that there are two things to do."""

SEVERAL = Case(
    "F[0,4] G[0,1] (x <= 1 & y <= 1) | F[2,6] (x >= 3 & y >= 3)",
    FormulaTask("F[0,4] G[0,1] (x >= 3 & y <= 1) | F[4,6] (x <= 1 & y >= 3)", 8),
)
"""A source of two disjuncts that differ in structure."""

OUTSIDE = Case("G[2,8] !(2 <= x <= 4 & 0 <= y <= 4)", FormulaTask("G[3,10] !(x <= 4 & y >= 1)", 10, ends="violated"))
"""A complemented predicate: stay out of most of the world."""

KEEP = Case(
    "G[0,4] F[0,2] (x <= 1)", FormulaTask("G[0,6] F[0,3] (x >= 2 & 2 <= y <= 3)", 10, ends="violated"), is_good=unbroken
)
"""An episode is good if nothing was broken."""

CASES = {"stay": STAY, "either": EITHER, "several": SEVERAL, "outside": OUTSIDE, "keep": KEEP}
"""Those whose target the source's structure can say."""


def share_of_the_optimum(loop: ClosedLoop) -> float:
    """The mean return of what was learned, in units of V*."""
    problem = loop.problem
    return evaluate(problem, loop.q, np.random.SeedSequence(1), 2_000) / optimal_value(problem.mdp, problem.task)
