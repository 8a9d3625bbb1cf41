"""Slow, obvious twins of the inference kernels: enumeration of all paths, and hand-sized worlds."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.strategies import predicates
from tickwise.inference.prior import BoxPrior, MarkovPrior, PathPrior
from tickwise.logic.sdnf import SDNF
from tickwise.logic.syntax import Box, Not, Verdict

Paths = tuple[NDArray[np.float64], NDArray[np.float64]]
"""All trajectories of a prior, shape (n, ticks, variables), and their probabilities."""


def weak(formula: SDNF, values: NDArray[np.float64], variables: tuple[str, ...]) -> NDArray[np.bool_]:
    """The weak view by the reference semantics."""
    return np.asarray(formula.formula.verdict(values, variables=variables)) != Verdict.FALSE


def enumerated(formula: SDNF, paths: Paths, variables: tuple[str, ...] = ("x", "y")) -> float:
    """P by enumeration."""
    return float(paths[1][weak(formula, paths[0], variables)].sum())


def graph_paths(
    initial: NDArray[np.float64], step: NDArray[np.float64], places: NDArray[np.float64], horizon: int
) -> Paths:
    """All paths with positive weight, their weights normalised."""
    walks = [(state,) for state in np.flatnonzero(initial)]
    for _ in range(horizon):
        walks = [(*walk, after) for walk in walks for after in np.flatnonzero(step[walk[-1]])]
    weights = [initial[w[0]] * np.prod([step[a, b] for a, b in itertools.pairwise(w)]) for w in walks]
    return places[np.array(walks)], np.array(weights) / sum(weights)


def box_paths(formula: SDNF, low: float, high: float, horizon: int) -> Paths:
    """All sequences of cells of one variable's range, cut at the formula's thresholds."""
    cuts = {low, high}
    for box in boxes_of(formula):
        cuts |= {end for bound in box.bounds for end in (bound.lower, bound.upper) if low < end < high}
    edges = np.array(sorted(cuts))
    centres, shares = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / (high - low)
    cells = np.array(list(itertools.product(range(len(centres)), repeat=horizon + 1)))
    return centres[cells][..., None], shares[cells].prod(axis=1)


def boxes_of(formula: SDNF) -> Iterator[Box]:
    """The boxes of all primitives."""
    for disjunct in formula.disjuncts:
        for primitive in disjunct.primitives:
            yield primitive.box


@st.composite
def graphs(draw: st.DrawFn, most: int = 4) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """An adjacency matrix, in which every state has a successor, and places on the half-step grid."""
    states = draw(st.integers(2, most))
    rows = st.lists(st.booleans(), min_size=states, max_size=states).filter(any)
    adjacency = np.array([draw(rows) for _ in range(states)], dtype=float)
    numbers = st.integers(-2, 12).map(lambda n: n / 2)
    places = np.array([[draw(numbers), draw(numbers)] for _ in range(states)])
    return adjacency, places


@st.composite
def chain_priors(
    draw: st.DrawFn, longest: int = 5
) -> tuple[PathPrior | MarkovPrior, NDArray[np.float64], NDArray[np.float64]]:
    """A uniform prior over the paths of a small graph, or a small Markov chain; with initial and step weights."""
    adjacency, places = draw(graphs())
    horizon = draw(st.integers(1, longest))
    if draw(st.booleans()):
        return PathPrior(adjacency, places, ("x", "y"), horizon), np.ones(len(places)), adjacency
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    step = adjacency * rng.uniform(0.1, 1, adjacency.shape)
    step /= step.sum(axis=1, keepdims=True)
    initial = rng.dirichlet(np.ones(len(places)))
    initial[rng.random(len(places)) < 0.2] = 0
    initial = initial / initial.sum() if initial.any() else np.full(len(places), 1 / len(places))
    return MarkovPrior(initial, step, places, ("x", "y"), horizon), initial, step


def box_prior(horizon: int) -> BoxPrior:
    """Independent draws of x from [0, 4]."""
    return BoxPrior({"x": (0.0, 4.0)}, horizon)


def predicate_lists(most: int = 3) -> st.SearchStrategy[list[Box | Not]]:
    """A few predicates over x and y."""
    return st.lists(predicates(), min_size=1, max_size=most)
