"""Beginnings of formulas whose primitives are found together, and the ascent from them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from tickwise.inference.draft import Draft, Drafter, Structure, filled
from tickwise.inference.exact import TIE

COARSE = 12
"""Levels of continuous variables while beginnings are looked for."""

_LIMITS = 5  # ticks by which the first primitive of a beginning has to end, or from which on it has to start
_KEEP = 4.0  # while places are empty, an average positive trajectory counts as much as so many negative ones
_NEARLY = 0.98  # as much better than a trivial formula as the best beginning so far
_CLIMBED = 4  # beginnings that are improved, of all those of one size

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
    """Ascend from the best beginnings, up to one that makes no error; the best formula first."""
    ranked = sorted(dict.fromkeys(begun), key=lambda pair: -drafter.value(pair[0]))
    peaks: dict[Draft, float] = {}
    for draft, structure in ranked[:_CLIMBED]:
        peak, value = drafter.ascend(draft, structure)
        peaks.setdefault(peak, value)
        if drafter.rate(peak) >= 1.0 - TIE:
            break
    return sorted(((value, draft) for draft, value in peaks.items()), key=lambda pair: -pair[0])


def retimed(drafter: Drafter, structure: Structure, draft: Draft, j: int) -> Iterator[Draft]:
    """A draft, and the same box earlier, where places follow, or later, where places are before it."""
    primitive, horizon = draft[0][j], drafter.space.horizon
    assert primitive is not None
    box, seen = drafter.node(primitive), {primitive}
    yield draft
    for step in range(1, _LIMITS + 1):
        end = horizon * step // (_LIMITS + 1)
        for within in [(0, end)] * (j + 1 < len(draft[0])) + [(horizon - end, horizon)] * (j > 0):
            found = drafter.place(draft, structure, 0, j, positives=emphasis(drafter), within=within, box=box)
            if found is not None and found.primitive not in seen:
                seen.add(found.primitive)
                yield filled(draft, 0, j, found.primitive)


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
