"""Exact probability and information gain of a formula under a prior (Definitions 2 and 3, Proposition 1).

This is the reference computation over tick tables; the search uses the compiled `tickwise.inference.kernels`, which
agree with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import accumulate, pairwise, product

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.build import timed_automata
from tickwise.inference.prior import BoxPrior, Chain, MarkovPrior, PathPrior, Prior
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.syntax import Constant, Formula, Verdict

__all__ = ["BoxPrior", "MarkovPrior", "PathPrior", "information_gain", "log_probability", "probability"]


def log_probability(phi: Formula | SDNF, prior: Prior) -> float:
    """The natural logarithm of `probability`, without underflow; -inf where the probability is 0."""
    if isinstance(phi, Constant):
        return 0.0 if phi.value else -math.inf
    return log_mass([to_sdnf(phi)], prior, lambda satisfied: satisfied[0])


def log_mass(formulas: Sequence[SDNF], prior: Prior, counts: Callable[[tuple[bool, ...]], bool]) -> float:
    """The natural logarithm of the probability of a combination of formulas, without underflow.

    Dynamic programming over (chain state x tick-table states of all formulas), reachable part only.

    Args:
        formulas: The formulas.
        prior: The prior distribution.
        counts: Whether a trajectory counts, by which of the formulas it satisfies.

    Returns:
        The logarithm; -inf where no trajectory counts.
    """
    disjuncts = [disjunct for formula in formulas for disjunct in formula.disjuncts]
    bounds = list(accumulate((len(formula.disjuncts) for formula in formulas), initial=0))
    tables = [automaton.compile() for formula in formulas for automaton in timed_automata(formula)]
    chain = prior.chain([primitive.predicate for disjunct in disjuncts for primitive in disjunct.primitives])
    letters = _split(chain.letters, [len(disjunct.primitives) for disjunct in disjuncts])
    wanted = np.array([counts(each) for each in product((False, True), repeat=len(formulas))])

    # rows of a chain state, a state of each table before it reads the letter there, and the weight of the paths thither
    state = np.flatnonzero(chain.initial > 0)
    parts = np.zeros((len(state), len(tables)), dtype=np.int64)
    mass = chain.initial[state]
    factor, counted_log = 0.0, -math.inf
    for tick in range(chain.horizon + 1):
        each = zip(tables, parts.T, letters, strict=True)
        parts = np.stack([table.delta[part, letter[state]] for table, part, letter in each], axis=1)
        verdicts = np.stack([table.verdict[part] for table, part in zip(tables, parts.T, strict=True)], axis=1)
        known = np.stack([verdicts[:, low:high].max(axis=1) for low, high in pairwise(bounds)], axis=1)
        over = (known != Verdict.UNKNOWN).all(axis=1) | (tick == chain.horizon)
        # which combination of satisfied formulas it is, as a number in binary
        satisfied = (known != Verdict.FALSE) @ (1 << np.arange(len(formulas))[::-1])
        counted = float((mass * chain.backward[tick, state])[over & wanted[satisfied]].sum())
        if counted > 0:
            counted_log = _log_add(counted_log, factor + math.log(counted))
        if over.all():
            break
        state, parts, mass = _step(chain, tick, state[~over], parts[~over], mass[~over])
        largest = mass.max()
        if largest <= 1e-100:  # take out a common factor where all mass is tiny
            mass, factor = mass / largest, factor + math.log(largest)
    return min(counted_log, 0.0)


def _step(
    chain: Chain, tick: int, state: NDArray[np.int64], parts: NDArray[np.int64], mass: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """The rows after a step of the chain, each combination once."""
    number = np.zeros(len(parts), dtype=np.int64)
    for part in parts.T:  # small numbers throughout, however many tables there are
        number = np.unique(number * (part.max() + 1) + part, return_inverse=True)[1].reshape(-1)
    degree = np.diff(chain.indptr)[state]
    origin = np.repeat(np.arange(len(state)), degree)
    edge = np.arange(len(origin)) - np.repeat(np.cumsum(degree) - degree, degree) + chain.indptr[state][origin]
    key = number[origin] * (len(chain.indptr) - 1) + chain.indices[edge]
    _, first, place = np.unique(key, return_index=True, return_inverse=True)
    arrived = np.zeros(len(first))
    np.add.at(arrived, place.reshape(-1), mass[origin] * chain.weights[edge] / chain.scale[tick])
    return chain.indices[edge][first], parts[origin][first], arrived


def probability(phi: Formula | SDNF, prior: Prior) -> float:
    """The probability that a trajectory of the prior satisfies a formula, exactly.

    Dynamic programming over (chain state x tick-table states), reachable part only. The view is weak: a trajectory
    counts where the verdict at the prior's horizon is not FALSE. Where the formula's end-effect time fits in the
    horizon, this is satisfaction.

    Args:
        phi: A formula that can be brought to SDNF, or an SDNF.
        prior: The prior distribution.

    Returns:
        The probability in [0, 1].

    Raises:
        FormulaError: If the formula has no SDNF.
        UnknownVariableError: If the formula names a variable that the prior does not have.
    """
    return math.exp(log_probability(phi, prior))


def information_gain(phi: Formula | SDNF, prior: Prior) -> float:
    """The information gain -log P / L of a formula (Proposition 1); 0 where P is 0.

    Args:
        phi: A formula that can be brought to SDNF, or an SDNF.
        prior: The prior distribution, with horizon L.

    Returns:
        The gain in nats per tick, at least 0.

    Raises:
        FormulaError: If the formula has no SDNF.
        UnknownVariableError: If the formula names a variable that the prior does not have.
    """
    logarithm = log_probability(phi, prior)
    return 0.0 if math.isinf(logarithm) else -logarithm / prior.horizon + 0.0


def _split(letters: NDArray[np.int64], widths: list[int]) -> list[NDArray[np.int64]]:
    """The letters of each table, from those of all predicates together."""
    starts = accumulate(widths, initial=0)
    return [letters >> start & ((1 << width) - 1) for start, width in zip(starts, widths, strict=False)]


def _log_add(a: float, b: float) -> float:
    high, low = max(a, b), min(a, b)
    return high + math.log1p(math.exp(low - high))
