"""The exact probability of a formula under the uniform prior over paths, as the world and the horizon grow.

The formula is that of Case Study 1's target. `counting.c` counts by the same dynamic programming; SciPy's contender is
the same one step a tick as a product with the sparse matrix of the graph, for each state of the automaton.
"""

from __future__ import annotations

import ctypes
import functools
import math
from typing import Any

import numpy as np
from scipy import sparse

from benchmarks.contest import Contender, Turn, contest
from benchmarks.native import Record, library
from benchmarks.result import OURS, Result
from tickwise.automata.build import timed_automata
from tickwise.envs.gridworld import GridWorld
from tickwise.inference.counting import log_probability
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import to_arrays
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.rl.states import state_letters

WORLDS = (9, 15, 25, 50, 100)
HORIZONS = (40, 120, 400, 1200, 4000)
VARIABLES = ("x", "y")
LARGEST_FOR_SCIPY = 9 * 9 * 400
"""Cells times ticks: more would take it minutes."""


class Query(Record):
    """The struct ``query`` of `counting.c`."""

    _fields_ = (
        *((name, ctypes.c_long) for name in ("states", "variables", "horizon", "primitives")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                "coordinates", "indptr", "indices", "weights", "scale", "backward", "forward", "operators",
                "complemented", "times", "lower", "upper",
            )
        ),
    )  # fmt: skip


class Case:
    """A formula and a prior, as arrays."""

    def __init__(self, size: int, horizon: int) -> None:
        self.mdp = GridWorld(size).mdp()
        prior = PathPrior(self.mdp.support_graph(), self.mdp.coordinates, horizon=horizon)
        # the second window ends at the horizon
        text = f"F[0,22] G[0,5] (5 <= x <= 6 & 6 <= y <= 7) & F[31,{horizon}] (4 <= x <= 7 & 0 <= y <= 2)"
        self.sdnf = to_sdnf(parse(text))
        self.arrays = prior.arrays(VARIABLES)
        self.shape, self.times, self.lower, self.upper = to_arrays(self.sdnf, VARIABLES)

    def ours(self) -> Turn:
        """The compiled kernel."""
        return lambda: log_probability(self.arrays, self.shape, self.times, self.lower, self.upper)

    def in_c(self) -> Turn:
        """The C reference."""
        function = library("counting").log_probability
        function.restype = ctypes.c_double
        states, variables = self.arrays.coordinates.shape
        sizes = {
            "states": states, "variables": variables, "horizon": self.arrays.horizon,
            "primitives": len(self.shape.operators),
        }  # fmt: skip
        graph = {name: getattr(self.arrays, name) for name, _ in Query._fields_[4:11]}
        formula = {"operators": self.shape.operators, "complemented": self.shape.complemented}
        record = Query(**sizes, **graph, **formula, times=self.times, lower=self.lower, upper=self.upper)
        return lambda: function(ctypes.byref(record))

    def in_scipy(self) -> Turn:
        """Products with sparse matrices, from tick to tick: one for the letters, one for the steps of the graph."""
        table = timed_automata(self.sdnf)[0].compile()
        letters = state_letters(self.mdp, table)
        graph = self.arrays
        steps = sparse.csr_array((graph.weights, graph.indices, graph.indptr))
        states = np.arange(len(table.delta))
        ones = np.ones(len(states))
        moves = [sparse.csr_array((ones, (after, states))) for after in table.delta.T]
        reads = [(np.flatnonzero(letters == letter), move) for letter, move in enumerate(moves)]
        undecided_or_true = table.verdict != -1

        def turn() -> float:
            mass = np.zeros((len(states), len(letters)))
            mass[0] = graph.forward[0]
            for tick in range(graph.horizon + 1):
                if tick:
                    mass = (mass @ steps) / graph.scale[tick - 1]
                after = np.zeros_like(mass)
                for columns, move in reads:
                    after[:, columns] = move @ mass[:, columns]
                mass = after * undecided_or_true[:, None]
            return math.log(mass.sum())

        return turn


def same(one: Any, other: Any) -> bool:
    return math.isclose(one, other, rel_tol=1e-9)


def contenders(size: int, horizon: int, repetitions: int) -> list[Contender]:
    case = Case(size, horizon)
    those = [Contender(OURS, case.ours, 1, repetitions), Contender("C", case.in_c, 1, repetitions)]
    if size * size * horizon <= LARGEST_FOR_SCIPY:
        those.append(Contender("SciPy", case.in_scipy, 1, 3))
    return those


def measure(quick: bool) -> list[Result]:
    results, repetitions = [], 3 if quick else 11
    contest_paths = functools.partial(contest, "path counting", "formula", agree=same)
    for size in WORLDS[:3] if quick else WORLDS:
        results += contest_paths(contenders(size, 40, repetitions), axis="world", size=size)
    for horizon in HORIZONS[:3] if quick else HORIZONS:
        results += contest_paths(contenders(9, horizon, repetitions), axis="ticks", size=horizon)
    return results
