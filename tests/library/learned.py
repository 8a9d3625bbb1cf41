"""Learned tasks in worlds so small that all of it takes a moment."""

from __future__ import annotations

from functools import cache

import numpy as np

from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.temporal import sdnf_table
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.library.entry import Entry
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.qlearning import Problem, QSettings, collect, learn
from tickwise.rl.states import automaton_memory, tau_memory
from tickwise.transfer.hypothesis import tick_tables

TICKS = 12
REACH = "F[0,5] (0 <= x <= 1 & 0 <= y <= 2) & F[7,12] (3 <= x <= 4 & 2 <= y <= 4)"
STAY = "F[0,8] G[0,3] (1 <= x <= 3 & 0 <= y <= 2)"
SETTINGS = QSettings(epsilon=0.1, initial=50.0)


def problem_of(text: str, mdp: TabularMDP, ticks: int = TICKS) -> Problem:
    """A formula as a hidden task, and as what is remembered."""
    formula = to_sdnf(parse(text))
    return Problem(mdp, sdnf_table(formula, mdp, ticks), automaton_memory(mdp, tick_tables(formula, ticks)))


@cache
def learned(name: str = "reach", text: str = REACH, size: int = 4, episodes: int = 20_000) -> Entry:
    """An entry that was learned in a gridworld."""
    mdp = GridWorld(size).mdp()
    problem = problem_of(text, mdp)
    q = problem.initial_q(SETTINGS)
    learn(problem, q, SETTINGS, np.random.default_rng(0), episodes)
    facts = {"rate": 1.0, "size": to_sdnf(parse(text)).size}
    return Entry(name, to_sdnf(parse(text)), mdp, TICKS, q, facts=facts, provenance={"episodes": episodes})


def walks(text: str, mdp: TabularMDP, ticks: int = TICKS, most: int = 100) -> LabelledTrajectories:
    """Random walks, at most so many of each label, labelled by whether they satisfy a formula."""
    problem = Problem(mdp, sdnf_table(to_sdnf(parse(text)), mdp, ticks), tau_memory(mdp, 1))
    rng = np.random.default_rng(0)
    returns, paths = collect(problem, problem.initial_q(SETTINGS), QSettings(epsilon=1.0), rng, 20_000)
    kept = np.concatenate([np.flatnonzero(returns > 0)[:most], np.flatnonzero(returns < 0)[:most]])
    labels = np.where(returns[kept] > 0, 1, -1)
    return LabelledTrajectories.from_arrays(mdp.coordinates[paths[kept]], labels, mdp.variables)
