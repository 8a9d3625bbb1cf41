"""How much two formulas of the same structure differ once they are laid over one another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import fmean, median, median_low

from tickwise.errors import FormulaError
from tickwise.logic.sdnf import SDNF, Primitive, SequentialConjunction, to_sdnf
from tickwise.logic.structure import structurally_transferable
from tickwise.logic.syntax import Box, Formula, Interval, Not


@dataclass(frozen=True, slots=True)
class Alignment:
    """The displacement between two formulas, and what remains of their difference after it.

    Attributes:
        shifts: By how much the target's regions lie further on, for each variable, in its unit.
        delay: By how much the target's windows come later, in ticks.
        regions: The mean absolute difference of the regions' sides after the shift, for each variable, in its unit;
            infinite where a side is open in one formula and not in the other.
        windows: The mean absolute difference of windows' starts, windows' ends and durations after the delay, in ticks.
    """

    shifts: dict[str, float]
    delay: float
    regions: dict[str, float]
    windows: float


def align(source: Formula | SDNF, target: Formula | SDNF) -> Alignment:
    """Lay a target's formula over a source's, primitive by primitive.

    Shift and delay are those that leave the least absolute differences (medians), so that what remains is the same
    however a world's coordinates and an episode's beginning are chosen: among formulas of one structure whose regions
    are open to the same sides, it is a metric up to such displacements. Where the target has more disjuncts than the
    source, the source's are taken again and again (Definition 7).

    Args:
        source: A formula that can be brought to SDNF, or an SDNF.
        target: Another one, structurally transferable from it.

    Returns:
        The alignment.

    Raises:
        FormulaError: If the target is not structurally transferable from the source.
    """
    pairs = [pair for disjuncts in _pairs(source, target) for pair in disjuncts]
    shifts, regions = {}, {}
    for variable, differences in _distances(pairs).items():
        shifts[variable], regions[variable] = _displaced([each for each in differences if math.isfinite(each)])
        if not all(map(math.isfinite, differences)):
            regions[variable] = math.inf
    times = _delays(pairs)
    delay, _ = _displaced(times)
    durations = [second.duration - first.duration for first, second in pairs if first.operator.nested]
    return Alignment(shifts, delay, regions, fmean([abs(time - delay) for time in times] + [abs(d) for d in durations]))


def aligned(source: Formula | SDNF, target: Formula | SDNF) -> SDNF:
    """A source's formula moved onto a target's in space and time: the same requirement, only elsewhere and later.

    Each disjunct of the target gets the source's that stands for it (Definition 7), displaced as a whole: sizes of
    regions, lengths of windows, durations, and how regions and windows lie to one another remain the source's. Of
    displacements that leave equally little (see `align`) it is the least, so that whole cells stay whole cells. No
    window begins before tick 0; what lies beyond a world or an episode is left to the prior or world to judge.

    Args:
        source: A formula that can be brought to SDNF, or an SDNF.
        target: Another one, structurally transferable from it.

    Returns:
        The displaced formula, structurally equivalent to the target.

    Raises:
        FormulaError: If the target is not structurally transferable from the source.
    """
    return SDNF(tuple(_laid_over(pairs) for pairs in _pairs(source, target)))


def carried(source: Formula | SDNF, target: Formula | SDNF) -> SDNF:
    """A source's formula as Algorithm 2 carries it over: each region about the centroid of the target's, times kept.

    It is roughly what the greedy policy of transferred values aims at. Algorithm 2 compares states relative to the
    region of the primitive that is due, so that each region is displaced for itself, and takes clocks as they are, so
    that no window is. A side that is open, in either formula, has no part in a displacement.

    Args:
        source: A formula that can be brought to SDNF, or an SDNF.
        target: Another one, structurally transferable from it.

    Returns:
        The formula with its regions displaced, structurally equivalent to the target.

    Raises:
        FormulaError: If the target is not structurally transferable from the source.
    """
    return SDNF(tuple(SequentialConjunction(tuple(map(_recentred, pairs))) for pairs in _pairs(source, target)))


def _recentred(pair: tuple[Primitive, Primitive]) -> Primitive:
    shifts = {
        variable: fmean([*filter(math.isfinite, differences)] or [0.0])
        for variable, differences in _distances([pair]).items()
    }
    return _moved(pair[0], shifts, 0)


_Pairs = Sequence[tuple[Primitive, Primitive]]


def _pairs(source: Formula | SDNF, target: Formula | SDNF) -> list[_Pairs]:
    """For each disjunct of the target the pairs of a primitive of the source's and its own."""
    near, far = to_sdnf(source), to_sdnf(target)
    if not structurally_transferable(far, near):
        raise FormulaError(f"{far} cannot be laid over {near}: it is not structurally transferable (Definition 7)")
    return [
        list(zip(near.disjuncts[number % len(near.disjuncts)].primitives, disjunct.primitives, strict=True))
        for number, disjunct in enumerate(far.disjuncts)
    ]


def _laid_over(pairs: _Pairs) -> SequentialConjunction:
    """The source's disjunct, displaced."""
    shifts = {
        variable: median_low([*filter(math.isfinite, differences)] or [0.0])
        for variable, differences in _distances(pairs).items()
    }
    delay = max(median_low(_delays(pairs)), -pairs[0][0].start)
    return SequentialConjunction(tuple(_moved(primitive, shifts, delay) for primitive, _ in pairs))


def _moved(primitive: Primitive, shifts: dict[str, float], delay: int) -> Primitive:
    window = Interval(primitive.window.start + delay, primitive.window.end + delay)
    bounds = (
        replace(bound, lower=bound.lower + shifts[bound.variable], upper=bound.upper + shifts[bound.variable])
        for bound in primitive.box.bounds
    )
    box = Box(tuple(bounds))
    return replace(primitive, window=window, predicate=Not(box) if primitive.complemented else box)


def _distances(pairs: _Pairs) -> dict[str, list[float]]:
    """By how much the target's sides lie further on, by variable; infinite where one side only is open."""
    found: dict[str, list[float]] = {}
    for pair in pairs:
        for variable, difference in _sides(*pair):
            found.setdefault(variable, []).append(difference)
    return found


def _delays(pairs: _Pairs) -> list[int]:
    """By how many ticks the target's windows begin and end later."""
    return [
        theirs - ours
        for source, target in pairs
        for ours, theirs in (
            (source.window.start, target.window.start),
            (source.window.end, target.window.end),
        )
    ]


def _sides(source: Primitive, target: Primitive) -> Iterator[tuple[str, float]]:
    """The differences of the sides of two regions, by variable; infinite where one side is open and the other not."""
    near, far = ({bound.variable: (bound.lower, bound.upper) for bound in each.box.bounds} for each in (source, target))
    for variable in dict.fromkeys((*near, *far)):
        open_sides = (-math.inf, math.inf)
        for ours, theirs in zip(near.get(variable, open_sides), far.get(variable, open_sides), strict=True):
            if ours != theirs or math.isfinite(ours):  # sides that are open in both say nothing
                yield variable, theirs - ours


def _displaced(differences: Sequence[float]) -> tuple[float, float]:
    """The displacement that leaves least, and the mean of what it leaves."""
    if not differences:
        return 0.0, 0.0
    middle = float(median(differences))
    return middle, fmean(abs(difference - middle) for difference in differences)
