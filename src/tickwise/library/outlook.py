"""The outlook on a new task: what the model of its world foresees before an episode is learned in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.tasks import TaskTable
from tickwise.envs.temporal import sdnf_table
from tickwise.library.target import Target
from tickwise.logic.sdnf import SDNF
from tickwise.rl.qlearning import Problem
from tickwise.rl.states import Memory
from tickwise.transfer.rehearsal import Goal, learning_times, rehearsal

RUNS = 10
"""How often a task is learned in each rehearsal; so often it was in the measurements of how well rehearsals rank."""

LEVELS = (0.8, 0.9)
"""Shares of the way to the best return that will do where the target's own level is not reached steadily."""

STEADY = 0.5
"""Runs are steady if all get there, with a standard deviation of at most this share of their mean.

One that gets there by luck takes about as long on average as it varies.
"""


@dataclass(frozen=True, eq=False)
class Outlook:
    """A new task, tried out in the model of its world.

    Attributes:
        target: The new task, in a world.
        formula: The formula that is to be satisfied.
    """

    target: Target
    formula: SDNF

    @cached_property
    def table(self) -> TaskTable:
        """The formula as a hidden task, which all values are tried out on; an episode ends once it is decided.

        Raises:
            ConfigurationError: If no world is known, a region contains no cell, or the table would be too large.
        """
        return sdnf_table(self.formula, self.target.world, self.target.horizon, ends="decided")

    def problem(self, memory: Memory) -> Problem:
        """The task for an agent that remembers as given; the exceptions are those of `table`."""
        return Problem(self.target.world, self.table, memory)

    @property
    def goal(self) -> Goal:
        """When the task counts as learned: at the greatest of the levels that learning from nothing reaches steadily.

        Where actions go wrong often, Q-learning may come near the best only now and then; how many episodes that takes
        is then a matter of luck, and tells nothing of values.
        """
        return self._alone[0]

    @property
    def without(self) -> float:
        """The episodes that it takes without transferred values, on the extended states of the formula itself."""
        return self._alone[1]

    @cached_property
    def _alone(self) -> tuple[Goal, float]:
        """The goal, and the episodes to it from nothing."""
        target, found = self.target, None
        problem, asked = self.problem(target.memory(self.formula)), target.goal
        for level in sorted({asked.level, *(each for each in LEVELS if each < asked.level)}):
            goal = replace(asked, level=level)
            times = learning_times(problem, None, target.seed, RUNS, form=target.form, goal=goal)
            counted = np.array([goal.most if time is None else time for time in times])
            steady = None not in times and counted.std() <= STEADY * counted.mean()
            if steady or found is None:
                found = goal, float(counted.mean())
            if not steady:
                break
        assert found is not None  # there is at least the level that is asked for
        return found

    def rehearsal(self, problem: Problem, q: NDArray[np.float32]) -> float:
        """The episodes that it takes to learn a problem from given values (see `tickwise.transfer.rehearsal`).

        All rehearsals draw the same, from the target's seed.

        Raises:
            ConfigurationError: If the target's form of learning cannot learn the problem.
        """
        target = self.target
        return rehearsal(problem, q, target.seed, RUNS, form=target.form, goal=self.goal)
