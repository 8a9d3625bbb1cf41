"""Algorithm 1 without its greed: formulas grow by one primitive at a time, and all of them are searched anew."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator

from tickwise.errors import DataError
from tickwise.inference.beginnings import COARSE, Bar, climb, completed, emphasis, retimed
from tickwise.inference.bounding import TIE
from tickwise.inference.draft import FREE, Draft, Drafter, Structure, coarser, formula_of
from tickwise.inference.exact import ExactSettings
from tickwise.inference.fit import Fit
from tickwise.inference.objective import trajectory_weights
from tickwise.inference.prior import Prior
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings

_BEAM = 3  # formulas of each size that are made larger

_ALONE: Draft = ((None,),)


def infer_jointly(
    data: LabelledTrajectories,
    prior: Prior,
    space: SearchSpace,
    settings: InferenceSettings,
    limits: ExactSettings,
) -> Fit:
    """The joint mode of Algorithm 1: the smallest formula that is satisfying (Problem 1), or the best of those found.

    The greedy tree never mends a primitive that was best alone. Here all primitives are searched anew, one at a time
    and exactly, whenever one is added. The depth of a tree plays no part.

    Args:
        data: Labelled trajectories S_L, with both labels.
        prior: The prior G_L of the information gain.
        space: What boxes and times may be chosen.
        settings: ζ, ϱ_th, λ and class weights.
        limits: The limits of each exact search.

    Returns:
        The formula and what it is worth. Ctrl-C, once there is a formula, leaves out the searches that are left.

    Raises:
        DataError: If a label is missing, or no formula tells the labels apart better than a trivial one.
    """
    data.require_both_classes()
    weights = trajectory_weights(data.labels, settings.class_weight)
    cost = settings.nesting_penalty(len(data), prior.horizon)
    drafter = Drafter(data, weights, prior, space, settings.information_weight, cost, limits)
    found = grow_jointly(drafter, settings.size, settings.rate)
    if drafter.interrupted and not found:
        raise KeyboardInterrupt
    if not found or drafter.rate(found[-1]) <= drafter.alike + TIE:
        raise DataError(
            "no formula tells the labels apart better than a trivial one; use other variables or a finer space"
        )
    return Fit.of(formula_of(found[-1]), *drafter.parts(found[-1]), settings, interrupted=drafter.interrupted)


def grow_jointly(drafter: Drafter, size: int, rate: float) -> list[Draft]:
    """Formulas of any structure, each the best found of its size, from one primitive on.

    A larger formula is a good smaller one with one more primitive, in any of its conjunctions or as a disjunct of its
    own, all of whose primitives are then searched anew.

    Args:
        drafter: The data and what counts.
        size: ϱ_th, the most primitives.
        rate: ζ: no other formula is looked for once one has this classification rate.

    Returns:
        The best formula found of each size, up to the first with the rate or, where none has it, up to the best.
    """
    single = drafter.place(_ALONE, ((FREE,),), 0, 0, least=rate - drafter.nesting_cost)
    if single is not None and drafter.rate(((single.primitive,),)) >= rate:
        return [((single.primitive,),)]
    rough = coarser(drafter, COARSE)
    best: list[Draft] = []
    for weight, least in (
        (emphasis(drafter), -math.inf),
        (1.0, drafter.trivial),
        (1.0 / emphasis(drafter), drafter.trivial),
    ):
        found = rough.place(_ALONE, ((FREE,),), 0, 0, positives=weight, least=least)
        if found is None:
            continue
        grown = _grown(drafter, rough, ((found.primitive,),), size, rate)
        best = [_better(drafter, rate, pair) for pair in itertools.zip_longest(best, grown)]
        enough = next((count for count, draft in enumerate(best, 1) if drafter.rate(draft) >= rate), None)
        if enough is not None:
            best, size = best[:enough], enough - 1  # from here on only smaller ones are looked for
            if size < 2:
                return best
    if best and drafter.rate(best[-1]) < rate:
        values = [drafter.value(draft) for draft in best]
        best = best[: 1 + next(k for k, value in enumerate(values) if value >= max(values) - TIE)]
    return best


def _better(drafter: Drafter, rate: float, drafts: Iterable[Draft | None]) -> Draft:
    """The best of some drafts, those with the rate first."""
    known = (draft for draft in drafts if draft is not None)
    return max(known, key=lambda draft: (drafter.rate(draft) >= rate, drafter.value(draft)))


def _grown(drafter: Drafter, rough: Drafter, seed: Draft, size: int, rate: float) -> list[Draft]:
    """The best formula of each size that comes of one primitive."""
    beam, best = [seed], [seed]
    while len(best) < size and drafter.rate(best[-1]) < rate and not drafter.interrupted:
        bar = Bar.of(rough)
        climbed = climb(drafter, (pair for draft in beam for pair in _extended(rough, draft, bar)))
        if not climbed:
            break
        beam = [draft for _, draft in climbed[:_BEAM]]
        best.append(beam[0])
    return best


def _extended(drafter: Drafter, draft: Draft, bar: Bar) -> Iterator[tuple[Draft, Structure]]:
    """A draft with one more primitive, wherever there is room for it."""
    for i, row in enumerate(draft):
        for j in range(len(row), -1, -1):
            wider: Draft = (*draft[:i], (*row[:j], None, *row[j:]), *draft[i + 1 :])
            structure = _free(wider)
            begun = retimed(wider, 1 - j) if len(draft) == len(row) == 1 else [wider]
            for one in begun:
                yield from ((full, structure) for full in completed(drafter, structure, one, i, [j], bar))
    more: Draft = (*draft, (None,))
    yield from ((full, _free(more)) for full in completed(drafter, _free(more), more, len(draft), [0], bar))


def _free(draft: Draft) -> Structure:
    return tuple((FREE,) * len(row) for row in draft)
