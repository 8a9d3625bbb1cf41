"""How much two formulas of the same structure differ once they are laid over one another."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import fmean, median

from tickwise.errors import FormulaError
from tickwise.logic.sdnf import SDNF, Primitive, to_sdnf
from tickwise.logic.structure import structurally_transferable
from tickwise.logic.syntax import Formula


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
    near, far = to_sdnf(source), to_sdnf(target)
    if not structurally_transferable(far, near):
        raise FormulaError(f"{far} cannot be laid over {near}: it is not structurally transferable (Definition 7)")
    pairs = list(_pairs(near, far))
    sides = [side for pair in pairs for side in _sides(*pair)]
    shifts, regions = {}, {}
    for variable in dict.fromkeys(name for name, _ in sides):
        differences = [difference for name, difference in sides if name == variable]
        shifts[variable], regions[variable] = _displaced([each for each in differences if math.isfinite(each)])
        if not all(map(math.isfinite, differences)):
            regions[variable] = math.inf
    times = [
        theirs - ours for first, second in pairs for ours, theirs in zip(_times(first), _times(second), strict=True)
    ]
    delay, _ = _displaced(times)
    durations = [second.duration - first.duration for first, second in pairs if first.operator.nested]
    return Alignment(shifts, delay, regions, fmean([abs(time - delay) for time in times] + [abs(d) for d in durations]))


def _pairs(source: SDNF, target: SDNF) -> Iterator[tuple[Primitive, Primitive]]:
    for number, disjunct in enumerate(target.disjuncts):
        near = source.disjuncts[number % len(source.disjuncts)]
        yield from zip(near.primitives, disjunct.primitives, strict=True)


def _times(primitive: Primitive) -> tuple[int, int]:
    return primitive.window.start, primitive.window.end


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
