"""Formulas of a given structure whose primitives are found together: Step 2 of Section IV-B, exactly where it can be.

One primitive at a time is searched exactly with the others held, from many beginnings, until no single one can be
changed for the better. `certificate` bounds how much better a formula can be of which several are changed.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from tickwise.inference.beginnings import COARSE, Bar, climb, completed, emphasis, retimed
from tickwise.inference.draft import Choice, Draft, Drafter, Structure, coarser, filled

_MOST_ORDERS = 3  # primitives of a conjunction that are begun with in every order


def fit_jointly(drafter: Drafter, structure: Structure, start: Draft | None = None) -> Draft | None:
    """The best formula of a structure that the ascents from all beginnings find.

    Args:
        drafter: The data and what counts.
        structure: What each place may hold.
        start: Disjuncts that are a good guess for the first ones.

    Returns:
        The formula; None if there is no room for the structure. Ctrl-C, once there is a formula, leaves out the
        searches that are left.
    """
    rough = coarser(drafter, COARSE)
    begun = list(_conjunctions(rough, structure[0]) if len(structure) == 1 else _coverings(rough, structure, ()))
    if start is not None and len(start) <= len(structure):
        begun += _coverings(rough, structure, start)
    found = climb(drafter, [(draft, structure) for draft in begun])
    if drafter.interrupted and not found:
        raise KeyboardInterrupt
    return found[0][1] if found else None


def _conjunctions(drafter: Drafter, row: tuple[Choice, ...]) -> Iterator[Draft]:
    """Beginnings of one conjunction: its primitives one after the other, in many orders."""
    structure, places = (row,), range(len(row))
    orders = list(itertools.permutations(places) if len(row) <= _MOST_ORDERS else (places, reversed(places)))
    met = False
    for bar in (Bar.of(drafter), None):  # without a bar where no beginning meets it
        for first, *rest in orders:
            for draft in _firsts(drafter, structure, ((None,) * len(row),), first):
                for full in completed(drafter, structure, draft, 0, rest, bar):
                    met = True
                    yield full
        if met:
            break


def _firsts(drafter: Drafter, structure: Structure, draft: Draft, j: int) -> Iterator[Draft]:
    """The first primitive of a conjunction in place j."""
    if len(structure[0]) == 1:
        weights = [(1.0, -math.inf)]
    else:
        weights = [(emphasis(drafter), -math.inf), (1.0, drafter.trivial)]
    for weight, least in weights:
        found = drafter.place(draft, structure, 0, j, positives=weight, least=least)
        if found is not None:
            yield from retimed(filled(draft, 0, j, found.primitive), j)


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
            found = climb(part, [(begun, (row,)) for begun in _conjunctions(part, row)])
            if not found:
                return
            draft.append(found[0][1][0])
        rest = left & ~(drafter.satisfied((draft[i],)) & good)
        left = rest if (rest & good).any() else left
    yield tuple(draft)
