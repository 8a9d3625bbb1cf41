"""The certificate of a fit: its bound is never below the best formula of an enumeration, and is it where proved."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import Choice, every_box, every_time
from tests.inference.test_exact import cells, markov_prior, numbers
from tests.inference.worlds import grid_prior
from tickwise.inference.certificate import certify
from tickwise.inference.draft import Choice as Place
from tickwise.inference.draft import Draft, Drafter, Structure, structure_of
from tickwise.inference.exact import ExactSettings
from tickwise.inference.objective import trajectory_weights
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace
from tickwise.logic.sdnf import Operator, Primitive

DISJUNCTION, CONJUNCTION = "disjunction", "conjunction"


def drafter_of(data, prior, space, weight=0.01, class_weight=None, **limits) -> Drafter:
    """What fits a structure to data."""
    weights = trajectory_weights(data.labels, class_weight)
    return Drafter(data, weights, prior, space, weight, 0.0, ExactSettings(**limits))


def every_draft(drafter: Drafter, structure: Structure) -> Iterator[Draft]:
    """All formulas of a structure of one or two primitives."""
    places = [(i, choice) for i, row in enumerate(structure) for choice in row]
    rows = [list(every_primitive(drafter, choice)) for _, choice in places]
    if len(rows) == 1:
        yield from (((primitive,),) for primitive in rows[0])
        return
    for first, second in itertools.product(*rows):
        if places[0][0] != places[1][0]:
            yield ((first,), (second,))
        elif second.start > first.end:
            yield ((first, second),)


def every_primitive(drafter: Drafter, choice: Place) -> Iterator[Primitive]:
    """All primitives of the operator and the polarity of a place."""
    (operator,), (complemented,) = choice.operators, choice.polarities
    for box in every_box(drafter.levels):
        for times in every_time(((0, drafter.space.horizon),), operator):
            yield Choice(operator, complemented, times, *box).primitive(drafter.levels)


def best_value(drafter: Drafter, structure: Structure) -> float:
    """The greatest worth of all formulas, gains looked at only where they can matter."""
    best, most = -math.inf, drafter.information_weight * 20
    for draft in every_draft(drafter, structure):
        if drafter.information_weight == 0 or drafter.rate(draft) + most > best:
            best = max(best, drafter.value(draft))
    return best


pairs = st.tuples(st.sampled_from(Operator), st.booleans())


def structure_from(two, kind: str) -> Structure:
    return structure_of([two] if kind == CONJUNCTION else [[pair] for pair in two])


def check(drafter: Drafter, structure: Structure) -> None:
    """A certificate without limits is the best of all; one that is stopped says rightly what it may have missed."""
    best = best_value(drafter, structure)
    start = next(every_draft(drafter, structure))
    proof = certify(drafter, structure, start)
    assert proof.proved
    assert proof.value == pytest.approx(best, abs=1e-12)
    assert drafter.value(proof.draft) == proof.value
    assert proof.bound == pytest.approx(best, abs=1e-12)
    for nodes in (1, 30, 300):
        limited = replace(drafter, settings=replace(drafter.settings, nodes=nodes))
        stopped = certify(limited, structure, start)
        assert stopped.bound >= best - 1e-12
        assert best + 1e-12 >= stopped.value >= drafter.value(start)
        assert stopped.gap >= best - stopped.value - 1e-12


searches = {
    "seed": st.integers(0, 2**32 - 1),
    "two": st.lists(pairs, min_size=2, max_size=2),
    "kind": st.sampled_from((DISJUNCTION, CONJUNCTION)),
    "weight": st.sampled_from((0.0, 0.01, 0.3)),
    "class_weight": st.sampled_from((None, "balanced")),
    "ragged": st.booleans(),
}


@settings(max_examples=12)
@given(markov=st.booleans(), **searches)
def test_gridworlds(seed, two, kind, weight, class_weight, ragged, markov):
    data = cells(seed, 2, 6, 10, ragged=ragged)
    horizon = 5 if kind == CONJUNCTION else 3
    prior = markov_prior(seed, 2, 5) if markov else grid_prior(2, 5)
    drafter = drafter_of(data, prior, SearchSpace.grid(2, horizon), weight, class_weight)
    check(drafter, structure_from(two, kind))


@settings(max_examples=12)
@given(**searches)
def test_a_continuous_variable(seed, two, kind, weight, class_weight, ragged):
    data = numbers(seed, 6, 10, 1, ragged=ragged)
    horizon = 5 if kind == CONJUNCTION else 3
    prior = BoxPrior({"x": (-0.5, 4.5)}, 5)
    space = SearchSpace(("x",), SearchSpace.from_data(data).edges, horizon, (True,))
    check(drafter_of(data, prior, space, weight, class_weight, levels=3), structure_from(two, kind))
