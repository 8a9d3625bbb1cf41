"""Upper bounds on the information gain of the primitives of many boxes at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.inference.kernels import PriorArrays
from tickwise.inference.levels import Levels
from tickwise.inference.slot import Slot

EXISTENTIAL, COMPLEMENTED, SIDES = 0, 1, 2
"""Where a node says ◇ or ◇□ rather than □ or □◇, the polarity, and where its sides begin."""


class GainBound(NamedTuple):
    """What bounds the information gain of a primitive.

    Attributes:
        independent: Whether ticks are independent draws, of which the measure of a box is known.
        horizon: The prior's last tick L.
        most: The bound where they are not.
        held: The gain of the primitives in conjunction with the searched one, at other ticks; 0 if there is none.
        beside: The gain of the other disjuncts, the most that the whole formula can gain; infinite if there is none.
        places: For each variable and level the share of the prior's range below it, shape ``(variables, levels)``.
        least: The least positive share between two levels of each variable, shape ``(variables,)``.
    """

    independent: bool
    horizon: int
    most: float
    held: float
    beside: float
    places: NDArray[np.float64]
    least: NDArray[np.float64]


def gain_bound(
    prior: PriorArrays,
    levels: Levels,
    slot: Slot | None = None,
    resolution: NDArray[np.float64] | None = None,
) -> GainBound:
    """What bounds the information gain of a primitive, and of the formula that it is part of.

    Args:
        prior: The prior's arrays.
        levels: The levels.
        slot: The formula that it is part of; None for the primitive alone.
        resolution: The least distance between the two sides of each variable; None for that of two levels.
    """
    sides, counts = levels.arrays()
    shares, least = np.zeros_like(sides), np.zeros(len(counts))
    if prior.independent:
        width = (prior.high - prior.low)[:, None]
        shares = np.clip((sides - prior.low[:, None]) / width, 0.0, 1.0)
        for variable, count in enumerate(counts):
            steps = np.diff(shares[variable, :count])
            least[variable] = steps[steps > 0].min() if (steps > 0).any() else 1.0
        if resolution is not None:
            least = np.minimum(least, resolution / width[:, 0])
    held, beside = slot.held_gains(prior) if slot else (0.0, np.inf)
    return GainBound(prior.independent, prior.horizon, prior.most, held, beside, shares, least)


@njit
def least_measure(node: NDArray[np.int64], prior: GainBound) -> tuple[float, bool]:
    """The least positive probability of the predicate at one tick, over the boxes of a node, or less.

    Returns:
        The bound, and whether there may be boxes whose predicate is impossible.
    """
    width = (len(node) - SIDES) // 4
    inner, outer, border, empty = 1.0, 1.0, 1.0, False
    for variable in range(width):
        lo_min, lo_max = node[SIDES + variable], node[SIDES + width + variable]
        hi_min, hi_max = node[SIDES + 2 * width + variable], node[SIDES + 3 * width + variable]
        places = prior.places[variable]
        share = places[hi_min] - places[lo_max] if hi_min > lo_max else 0.0
        inner *= share if share > 0 else prior.least[variable]
        empty = empty or share <= 0
        outer *= places[hi_max] - places[lo_min]
        border = min(border, prior.least[variable])
    if node[COMPLEMENTED] == 1:
        return (1.0 - outer, False) if outer < 1.0 else (border, True)
    return inner, empty


@njit
def run_begun(holds: float, duration: int, spans: int) -> NDArray[np.float64]:
    """The probability that in a window of b - a + 1 independent ticks, at ``[b - a]``, there begins a run that lasts.

    Args:
        holds: The probability that the predicate holds at a tick.
        duration: The ticks that a run goes on after its first.
        spans: How many windows.
    """
    needed = duration + 1
    run = holds**needed
    found = np.empty(spans)
    found[0] = run
    for span in range(1, spans):
        before = found[span - needed - 1] if span > needed else 0.0
        found[span] = found[span - 1] + (1.0 - holds) * run * (1.0 - before)
    return np.minimum(found, 1.0)


@njit
def never_begun(holds: float, span: int, duration: int) -> float:
    """At most -log of the probability that no run of violations begins in a window of independent ticks and lasts.

    It is enough that the predicate holds at every so many ticks, or somewhere in each block of half as many.
    """
    places, half = span + 1 + duration, (duration + 2) // 2
    block = -np.log1p(-((1.0 - holds) ** half))
    return float(min(-np.log(holds) * (places // (duration + 1)), block * ((places + half - 1) // half)))


@njit
def gain_bounds(node: NDArray[np.int64], prior: GainBound, ticks: int) -> NDArray[np.float64]:
    """Upper bounds on the information gain, for a window of b - a + 1 ticks and a duration c at ``[b - a, c]``."""
    bounds = np.full((ticks, ticks), min(prior.most, prior.beside))
    if not prior.independent:
        return bounds
    holds, impossible = least_measure(node, prior)
    if impossible and prior.beside < np.inf:  # where the primitive says nothing, the other disjuncts say all
        return bounds
    for duration in range(ticks):
        spans = ticks - duration
        if node[EXISTENTIAL] == 1:
            bounds[1:spans, duration] = -np.log(run_begun(holds, duration, spans)[1:]) / prior.horizon
        else:
            for span in range(1, spans):
                bounds[span, duration] = never_begun(holds, span, duration) / prior.horizon
    return np.minimum(bounds + prior.held, prior.beside)
