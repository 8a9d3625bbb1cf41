"""Formulas whose primitives are found together: Step 2 of Section IV-B and Algorithm 1 without its greed.

One primitive at a time is searched exactly with the others held, from many beginnings, until no single one can be
changed for the better. `certificate` bounds how much better a formula can be of which several are changed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from tickwise.inference.draft import FREE, Choice, Draft, Drafter, Structure, coarser, filled

_COARSE = 12  # levels of continuous variables while beginnings are looked for
_LIMITS = 5  # ticks by which the first primitive of a beginning has to end, or from which on it has to start
_MOST_ORDERS = 3  # primitives of a conjunction that are begun with in every order
_KEEP = 4.0  # while places are empty, an average positive trajectory counts as much as so many negative ones
_BEAM = 3  # formulas of each size that are made larger
_CLIMBED = 4  # beginnings that are improved, of all those of one size

_ALONE: Draft = ((None,),)

Scored = tuple[float, Draft]


@dataclass(slots=True)
class _Bar:
    """What a beginning has to be worth: better than a trivial formula, by half of what the best so far is better."""

    trivial: float
    least: float

    @classmethod
    def of(cls, drafter: Drafter) -> _Bar:
        return cls(drafter.trivial, drafter.trivial)

    def met(self, value: float) -> None:
        """Take note of a beginning."""
        self.least = max(self.least, self.trivial + (value - self.trivial) / 2)


def fit_jointly(drafter: Drafter, structure: Structure, start: Draft | None = None) -> Draft | None:
    """The best formula of a structure that the ascents from all beginnings find.

    Args:
        drafter: The data and what counts.
        structure: What each place may hold.
        start: Disjuncts that are a good guess for the first ones.

    Returns:
        The formula; None if there is no room for the structure.
    """
    rough = coarser(drafter, _COARSE)
    begun = list(_conjunctions(rough, structure[0]) if len(structure) == 1 else _coverings(rough, structure, ()))
    if start is not None and len(start) <= len(structure):
        begun += _coverings(rough, structure, start)
    found = _climb(drafter, [(draft, structure) for draft in begun])
    return found[0][1] if found else None


def grow_jointly(drafter: Drafter, size: int, rate: float) -> list[Draft]:
    """Formulas of any structure, each the best found of its size, from one primitive on.

    A larger formula is a good smaller one with one more primitive, in any of its conjunctions or as a disjunct of its
    own, all of whose primitives are then searched anew.

    Args:
        drafter: The data and what counts.
        size: ϱ_th, the most primitives.
        rate: ζ: no other formula is looked for once one has this classification rate.

    Returns:
        The best formula found of each size, up to the first with the rate.
    """
    single = drafter.place(_ALONE, ((FREE,),), 0, 0, least=rate - drafter.nesting_cost)
    if single is not None and drafter.rate(((single.primitive,),)) >= rate:
        return [((single.primitive,),)]
    rough = coarser(drafter, _COARSE)
    best: list[Draft] = []
    for weight, least in ((_keep(drafter), -math.inf), (1.0, drafter.trivial), (1.0 / _keep(drafter), drafter.trivial)):
        found = rough.place(_ALONE, ((FREE,),), 0, 0, positives=weight, least=least)
        if found is None or drafter.interrupted:
            continue
        grown = _grown(drafter, rough, ((found.primitive,),), size, rate)
        best = [max(pair, key=drafter.value) for pair in zip(best, grown, strict=False)] or grown
        if drafter.rate(grown[-1]) >= rate:
            return grown
    return best


def _grown(drafter: Drafter, rough: Drafter, seed: Draft, size: int, rate: float) -> list[Draft]:
    """The best formula of each size that comes of one primitive."""
    beam, best = [seed], [seed]
    while len(best) < size and drafter.rate(best[-1]) < rate and not drafter.interrupted:
        bar = _Bar.of(rough)
        climbed = _climb(drafter, (pair for draft in beam for pair in _extended(rough, draft, bar)), rate)
        if not climbed:
            break
        beam = [draft for _, draft in climbed[:_BEAM]]
        best.append(beam[0])
    return best


def _keep(drafter: Drafter) -> float:
    """What trajectories with label 1 count more while a conjunction is not complete."""
    good = drafter.data.labels == 1
    return float(_KEEP * max(drafter.weights[~good].sum() / drafter.weights[good].sum(), 1.0))


def _climb(drafter: Drafter, begun: Iterable[tuple[Draft, Structure]], enough: float = math.inf) -> list[Scored]:
    """Ascend from the best beginnings, up to one with a rate that is enough; the best formula first."""
    ranked = sorted(dict.fromkeys(begun), key=lambda pair: -drafter.value(pair[0]))
    peaks: dict[Draft, float] = {}
    for draft, structure in ranked[:_CLIMBED]:
        peak, value = drafter.ascend(draft, structure)
        peaks.setdefault(peak, value)
        if drafter.rate(peak) >= enough:
            break
    return sorted(((value, draft) for draft, value in peaks.items()), key=lambda pair: -pair[0])


def _conjunctions(drafter: Drafter, row: tuple[Choice, ...]) -> Iterator[Draft]:
    """Beginnings of one conjunction: its primitives one after the other, in many orders."""
    structure, places = (row,), range(len(row))
    orders = list(itertools.permutations(places) if len(row) <= _MOST_ORDERS else (places, reversed(places)))
    met = False
    for bar in (_Bar.of(drafter), None):  # without a bar where no beginning meets it
        for first, *rest in orders:
            for draft in _firsts(drafter, structure, ((None,) * len(row),), first):
                for full in _filled(drafter, structure, draft, 0, rest, bar):
                    met = True
                    yield full
        if met:
            break


def _firsts(drafter: Drafter, structure: Structure, draft: Draft, j: int) -> Iterator[Draft]:
    """The first primitive of a conjunction in place j."""
    alone = len(structure[0]) == 1
    found = drafter.place(draft, structure, 0, j, positives=1.0 if alone else _keep(drafter))
    if found is not None:
        yield from _retimed(drafter, structure, filled(draft, 0, j, found.primitive), j)


def _retimed(drafter: Drafter, structure: Structure, draft: Draft, j: int) -> Iterator[Draft]:
    """A draft, and the same box earlier, where places follow, or later, where places are before it."""
    primitive, horizon = draft[0][j], drafter.space.horizon
    assert primitive is not None
    box, seen = drafter.node(primitive), {primitive}
    yield draft
    for step in range(1, _LIMITS + 1):
        end = horizon * step // (_LIMITS + 1)
        for within in [(0, end)] * (j + 1 < len(draft[0])) + [(horizon - end, horizon)] * (j > 0):
            found = drafter.place(draft, structure, 0, j, positives=_keep(drafter), within=within, box=box)
            if found is not None and found.primitive not in seen:
                seen.add(found.primitive)
                yield filled(draft, 0, j, found.primitive)


def _filled(
    drafter: Drafter, structure: Structure, draft: Draft, i: int, rest: Iterable[int], bar: _Bar | None
) -> Iterator[Draft]:
    """The draft with the rest of disjunct i filled, one place after the other; nothing if it does not meet the bar."""
    left = list(rest)
    for k, j in enumerate(left):
        weight, least = _keep(drafter), -math.inf
        if bar is not None and k + 1 == len(left):
            weight, least = 1.0, bar.least
        found = drafter.place(draft, structure, i, j, positives=weight, least=least)
        if found is None:
            return
        draft = filled(draft, i, j, found.primitive)
    if bar is not None and left:
        bar.met(drafter.value(draft))
    yield draft


def _coverings(drafter: Drafter, structure: Structure, known: Draft) -> Iterator[Draft]:
    """A beginning by covering: each disjunct is fitted to the positive trajectories that those before it leave.

    A negative trajectory that one disjunct lets through is lost, whereas a positive one that it misses may be
    another's: so negative ones weigh more, twice the number of disjuncts.
    """
    good = drafter.data.labels == 1
    left, draft = np.ones(len(good), dtype=np.bool_), list(known)
    for i, row in enumerate(structure):
        if i >= len(known):
            part = drafter.part(left, 2.0 * len(structure))
            found = _climb(part, [(begun, (row,)) for begun in _conjunctions(part, row)])
            if not found:
                return
            draft.append(found[0][1][0])
        rest = left & ~(drafter.satisfied((draft[i],)) & good)
        left = rest if (rest & good).any() else left
    yield tuple(draft)


def _extended(drafter: Drafter, draft: Draft, bar: _Bar) -> Iterator[tuple[Draft, Structure]]:
    """A draft with one more primitive, wherever there is room for it."""
    for i, row in enumerate(draft):
        for j in range(len(row), -1, -1):
            wider: Draft = (*draft[:i], (*row[:j], None, *row[j:]), *draft[i + 1 :])
            structure = _free(wider)
            begun = _retimed(drafter, structure, wider, 1 - j) if len(draft) == len(row) == 1 else [wider]
            for one in begun:
                yield from ((full, structure) for full in _filled(drafter, structure, one, i, [j], bar))
    more: Draft = (*draft, (None,))
    yield from ((full, _free(more)) for full in _filled(drafter, _free(more), more, len(draft), [0], bar))


def _free(draft: Draft) -> Structure:
    return tuple((FREE,) * len(row) for row in draft)
