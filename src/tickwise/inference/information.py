"""Exact probability and information gain of a formula under a prior (Definitions 2 and 3, Proposition 1).

This is the reference computation over tick tables; the search uses the compiled `tickwise.inference.kernels`, which
agree with it.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from itertools import accumulate, pairwise

from tickwise.automata.build import timed_automata
from tickwise.inference.prior import BoxPrior, MarkovPrior, PathPrior, Prior
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
    deltas = [table.delta.tolist() for table in tables]
    verdicts = [table.verdict.tolist() for table in tables]
    widths = [len(disjunct.primitives) for disjunct in disjuncts]
    letters = [_split(int(letter), widths) for letter in chain.letters]
    steps = [
        list(zip(chain.indices[low:high].tolist(), chain.weights[low:high].tolist(), strict=True))
        for low, high in zip(chain.indptr[:-1].tolist(), chain.indptr[1:].tolist(), strict=True)
    ]

    def said(u: tuple[int, ...]) -> tuple[int, ...]:
        each = [verdict[part] for verdict, part in zip(verdicts, u, strict=True)]
        return tuple(max(each[low:high]) for low, high in pairwise(bounds))

    # mass[state, u]: weight of the paths to a chain state that bring the tables to the tuple u before reading it
    start = (0,) * len(tables)
    mass = {(state, start): weight for state, weight in enumerate(chain.initial.tolist()) if weight > 0}
    factor, counted_log = 0.0, -math.inf
    for tick in range(chain.horizon + 1):
        counted = 0.0
        moved: defaultdict[tuple[int, tuple[int, ...]], float] = defaultdict(float)
        for (state, u), weight in mass.items():
            after = tuple(delta[part][letter] for delta, part, letter in zip(deltas, u, letters[state], strict=True))
            known = said(after)
            if Verdict.UNKNOWN in known and tick < chain.horizon:
                for successor, step in steps[state]:
                    moved[successor, after] += weight * step / float(chain.scale[tick])
            elif counts(tuple(verdict != Verdict.FALSE for verdict in known)):
                counted += weight * float(chain.backward[tick, state])
        if counted > 0:
            counted_log = _log_add(counted_log, factor + math.log(counted))
        mass, shift = _rescaled(moved)
        factor += shift
    return min(counted_log, 0.0)


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


def _split(letter: int, widths: list[int]) -> tuple[int, ...]:
    parts = []
    for width in widths:
        parts.append(letter & ((1 << width) - 1))
        letter >>= width
    return tuple(parts)


def _log_add(a: float, b: float) -> float:
    high, low = max(a, b), min(a, b)
    return high + math.log1p(math.exp(low - high))


def _rescaled(
    mass: dict[tuple[int, tuple[int, ...]], float],
) -> tuple[dict[tuple[int, tuple[int, ...]], float], float]:
    """Take out a common factor where all mass is tiny."""
    largest = max(mass.values(), default=1.0)
    if largest > 1e-100 or largest == 0:
        return mass, 0.0
    return {key: weight / largest for key, weight in mass.items()}, math.log(largest)
