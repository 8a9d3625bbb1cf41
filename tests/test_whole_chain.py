"""The whole chain for formulas of every kind: trajectories, formula, automaton, table, learning, transfer."""

from __future__ import annotations

import numpy as np
import pytest

from tickwise.automata.run import letters_of
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.temporal import FormulaTask
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_structure
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.structure import structurally_transferable
from tickwise.logic.syntax import Verdict
from tickwise.rl.qlearning import Problem, QSettings, collect, learn
from tickwise.rl.states import Memory, automaton_memory, tau_memory
from tickwise.transfer.hypothesis import tick_tables
from tickwise.transfer.qtransfer import transfer_q

SIZE, TICKS = 3, 14
SWARM = SwarmSettings(particles=30, iterations=25, restarts=1, stall=8, climbers=2)
Q_SETTINGS = QSettings(epsilon=0.1, initial=20.0)

LEFT, RIGHT = "(x <= 1)", "(x >= 2)"
UP, DOWN, MIDDLE = "(y >= 2)", "(y <= 1)", "(1 <= x <= 2 & 1 <= y <= 2)"
FORMULAS = (
    # the eight primitives, the negated ones by their duals
    f"F[1,6] {MIDDLE}",
    f"G[2,4] {LEFT}",
    f"F[1,8] G[0,3] {RIGHT}",
    f"G[0,8] F[0,3] {LEFT}",
    f"!F[2,6] {RIGHT}",
    f"!G[1,5] {LEFT}",
    f"!F[0,6] G[0,2] {LEFT}",
    f"!G[0,8] F[0,3] {UP}",
    # conjunctions, disjunctions, and both
    f"F[0,4] {LEFT} & G[6,8] {UP}",
    f"F[0,5] G[0,2] {LEFT} & !G[9,13] {DOWN}",
    f"G[0,1] !{MIDDLE} & F[3,7] {RIGHT} & G[9,10] {UP}",
    f"G[1,4] {LEFT} | G[1,4] {RIGHT}",
    f"F[0,4] G[0,3] {LEFT} | !F[0,5] {DOWN} | F[2,3] {MIDDLE}",
    f"(F[0,3] {LEFT} & G[5,7] {UP}) | (!G[0,3] {LEFT} & G[5,7] {DOWN})",
)


def walks(mdp: TabularMDP, phi: SDNF) -> LabelledTrajectories:
    """Random walks that end at any tick from 2 on, at most 40 of each label, labelled by the formula's weak verdict."""
    rng = np.random.default_rng(0)
    problem = Problem(mdp, FormulaTask(str(phi), TICKS).table(mdp), tau_memory(mdp, 1))
    _, paths = collect(problem, problem.initial_q(Q_SETTINGS), QSettings(epsilon=1.0), rng, 400)
    lengths = rng.integers(3, TICKS + 2, size=len(paths))
    verdicts = phi.formula.verdict(mdp.coordinates[paths], variables=mdp.variables, lengths=lengths)
    labels = np.where(np.asarray(verdicts) != Verdict.FALSE, 1, -1)
    kept = np.concatenate([np.flatnonzero(labels == label)[:40] for label in (1, -1)])
    return LabelledTrajectories.from_arrays(
        mdp.coordinates[paths[kept]], labels[kept], mdp.variables, lengths[kept]
    ).require_both_classes()


def learned(mdp: TabularMDP, task: FormulaTask, memory: Memory, q: np.ndarray | None = None) -> np.ndarray:
    """A few hundred episodes, which end as soon as the hidden task is decided."""
    problem = Problem(mdp, task.table(mdp), memory)
    fresh = problem.initial_q(Q_SETTINGS)
    q = fresh.copy() if q is None else q.copy()
    returns = learn(problem, q, Q_SETTINGS, np.random.default_rng(1), 300)
    assert set(returns.tolist()) <= {100.0, -10.0}
    assert (q != fresh).any()
    assert np.isfinite(q).all()
    return q


def locations(memory: Memory) -> np.ndarray:
    """A number for each memory state's disjunct and location."""
    return np.concatenate([100 * i + table.location for i, table in enumerate(memory.tables)])


@pytest.mark.parametrize("text", FORMULAS)
def test_from_trajectories_to_a_transferred_q_function(text: str):
    phi, mdp = to_sdnf(parse(text)), GridWorld(SIZE).mdp()
    task = FormulaTask(text, TICKS, ends="decided")
    data = walks(mdp, phi)
    prior = PathPrior(mdp.support_graph(), mdp.coordinates, mdp.variables, TICKS)
    space, chosen = SearchSpace.grid(SIZE, TICKS), InferenceSettings(size=4, rate=0.9)
    fit = fit_structure(data, prior, space, phi, chosen, SWARM, np.random.default_rng(0))
    assert fit.rate >= 0.9
    assert fit.satisfying

    tables = tick_tables(fit.formula, TICKS)
    letters = [
        letters_of(table.automaton, data.values, variables=mdp.variables, lengths=data.lengths) for table in tables
    ]
    said = np.max([table.verdicts(word, data.lengths) for table, word in zip(tables, letters, strict=True)], axis=0)
    assert fit.rate == np.mean((said != Verdict.FALSE) == (data.labels == 1))

    memory = automaton_memory(mdp, tables)
    q = learned(mdp, task, memory)

    # a larger world, and the true formula twice over
    larger, target = GridWorld(SIZE + 2).mdp(), SDNF(phi.disjuncts * 2)
    assert structurally_transferable(target, fit.formula)
    onto = automaton_memory(larger, tick_tables(target, TICKS))
    transferred = transfer_q(mdp, memory, q, larger, onto, Q_SETTINGS.initial)
    assert transferred.shape == (onto.n_states, larger.n_states, larger.n_actions)
    assert np.isfinite(transferred).all()
    assert set(np.unique(transferred)) <= {*np.unique(q), np.float32(Q_SETTINGS.initial)}
    # a table that tells its own locations shows where the values come from
    where = np.broadcast_to(locations(memory)[:, None, None], q.shape).astype(np.float32)
    came_from = transfer_q(mdp, memory, where, larger, onto, -1.0)
    starts = np.isin(np.arange(onto.n_states), onto.offsets)
    mapped = locations(onto) % (100 * len(phi.disjuncts))  # î is i modulo the source's number of disjuncts
    assert (came_from[starts] == -1.0).all()
    assert (came_from[~starts] == mapped[~starts, None, None]).all()
    assert learned(larger, task, onto, transferred).shape == transferred.shape
