"""Beginnings of formulas whose primitives are found together, and the ascent from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from tickwise.inference.bounding import TIE
from tickwise.inference.draft import Draft, Drafter, Structure, filled
from tickwise.logic.syntax import Interval

COARSE = 10
"""Levels of continuous variables while beginnings are looked for."""

_CUTS = 8  # parts of the first primitive's window, at the ends of which it may end, or start, too
_KEEP = 4.0  # while places are empty, an average positive trajectory counts as much as so many negative ones
_NEARLY = 0.98  # as much better than a trivial formula as the best beginning so far
_CLIMBED = 8  # beginnings that are improved, of all those of one size

Scored = tuple[float, Draft]


@dataclass(slots=True)
class Bar:
    """What a beginning has to be worth: better than a trivial formula, by nearly as much as the best so far."""

    trivial: float
    least: float

    @classmethod
    def of(cls, drafter: Drafter) -> Bar:
        """The bar before there is a beginning."""
        return cls(drafter.trivial, drafter.trivial)

    def met(self, value: float) -> None:
        """Take note of a beginning."""
        self.least = max(self.least, self.trivial + _NEARLY * (value - self.trivial))


def emphasis(drafter: Drafter) -> float:
    """What trajectories with label 1 count more while a conjunction is not complete."""
    good = drafter.data.labels == 1
    return float(_KEEP * max(drafter.weights[~good].sum() / drafter.weights[good].sum(), 1.0))


def climb(drafter: Drafter, begun: Iterable[tuple[Draft, Structure]]) -> list[Scored]:
    """Ascend from the best beginnings, up to one that cannot be better; the best formula first."""
    ranked = sorted(dict.fromkeys(begun), key=lambda pair: -drafter.value(pair[0]))
    peaks: dict[Draft, float] = {}
    for draft, structure in ranked[:_CLIMBED]:
        peak, value = drafter.ascend(draft, structure)
        peaks.setdefault(peak, value)
        if drafter.information_weight == 0 and drafter.rate(peak) >= 1.0 - TIE:
            break
    return sorted(((value, draft) for draft, value in peaks.items()), key=lambda pair: -pair[0])


def retimed(draft: Draft, j: int) -> Iterator[Draft]:
    """A draft, and its primitive in place j with less of its window, to leave time for places after or before it."""
    primitive = draft[0][j]
    assert primitive is not None
    yield draft
    start, end = primitive.window.start, primitive.window.end
    for cut in dict.fromkeys(start + (end - start) * step // _CUTS for step in range(1, _CUTS)):
        if j + 1 < len(draft[0]) and cut > start:
            yield filled(draft, 0, j, replace(primitive, window=Interval(start, cut)))
        if j > 0 and cut < end:
            yield filled(draft, 0, j, replace(primitive, window=Interval(cut, end)))


def completed(
    drafter: Drafter, structure: Structure, draft: Draft, i: int, rest: Iterable[int], bar: Bar | None
) -> Iterator[Draft]:
    """The draft with the rest of disjunct i filled, one place after the other; nothing if it does not meet the bar."""
    left = list(rest)
    for k, j in enumerate(left):
        weight, least = emphasis(drafter), -math.inf
        if bar is not None and k + 1 == len(left):
            weight, least = 1.0, bar.least
        found = drafter.place(draft, structure, i, j, positives=weight, least=least)
        if found is None:
            return
        draft = filled(draft, i, j, found.primitive)
    if bar is not None and left:
        bar.met(drafter.value(draft))
    yield draft
