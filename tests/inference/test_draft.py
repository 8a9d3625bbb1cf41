"""A formula whose primitives are searched one at a time: against an enumeration of what each place may hold."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import Choice, every_box, every_time
from tests.inference.test_exact import Interrupter, cells, markov_prior, numbers
from tests.inference.worlds import grid_prior, weakly
from tickwise.inference import draft as drafts
from tickwise.inference.bounding import Bounds
from tickwise.inference.draft import FREE, Draft, Drafter, Structure, coarser, draft_of, filled, formula_of
from tickwise.inference.exact import ExactSettings, improve
from tickwise.inference.information import information_gain
from tickwise.inference.objective import Objective, trajectory_weights
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.logic.sdnf import Operator, Primitive

TIE = 1e-12
places = st.builds(
    drafts.Choice,
    st.sampled_from([tuple(Operator), *((operator,) for operator in Operator)]),
    st.sampled_from(((False, True), (False,), (True,))),
)
structures = st.lists(st.lists(places, min_size=1, max_size=2).map(tuple), min_size=1, max_size=2).map(tuple)


@st.composite
def drafters(draw: st.DrawFn, horizon: int = 6, count: int = 14) -> Drafter:
    """Walks over four cells, or one continuous variable, with any weights."""
    seed, ragged = draw(st.integers(0, 2**32 - 1)), draw(st.booleans())
    if draw(st.booleans()):
        data, space = cells(seed, 2, horizon + 1, count, ragged=ragged), SearchSpace.grid(2, horizon)
        prior = markov_prior(seed, 2, horizon) if draw(st.booleans()) else grid_prior(2, horizon)
    else:
        data = numbers(seed, horizon + 1, count, 1, ragged=ragged)
        space = SearchSpace(("x",), SearchSpace.from_data(data, horizon).edges, horizon, (True,))
        prior = BoxPrior({"x": (-0.5, 4.5)}, horizon)
    weights = trajectory_weights(data.labels, draw(st.sampled_from((None, "balanced"))))
    gain, cost = draw(st.sampled_from((0.0, 0.01, 0.3))), draw(st.sampled_from((0.0, 0.02)))
    return Drafter(data, weights, prior, space, gain, cost, ExactSettings(levels=3))


def any_draft(drafter: Drafter, structure: Structure, rng: np.random.Generator) -> Draft | None:
    """Some formula of the structure, its box sides among the levels; None where there is no room."""
    pairs = [[(rng.choice(place.operators), bool(rng.choice(place.polarities))) for place in row] for row in structure]
    pairs = [[(Operator(operator), flag) for operator, flag in row] for row in pairs]
    shape, horizon = shape_of(pairs), drafter.space.horizon
    if not drafter.space.room(shape, ((0, horizon),)):
        return None
    boxes = list(every_box(drafter.levels))
    timed = drafter.space.decode(rng.uniform(*drafter.space.bounds(shape)), shape)
    return tuple(
        tuple(
            Choice(p.operator, p.complemented, (*times_of(p),), *boxes[rng.integers(len(boxes))]).primitive(
                drafter.levels
            )
            for p in disjunct.primitives
        )
        for disjunct in timed.disjuncts
    )


def times_of(primitive: Primitive) -> tuple[int, int, int]:
    return primitive.window.start, primitive.window.end, primitive.duration


def every_primitive(drafter: Drafter, place: drafts.Choice, first: int, last: int):
    """All that a place may hold within some ticks."""
    for operator, flag in itertools.product(place.operators, place.polarities):
        for box in every_box(drafter.levels):
            for times in every_time(((first, last),), operator):
                yield Choice(operator, flag, times, *box).primitive(drafter.levels)


def neighbours(drafter: Drafter, row: tuple[Primitive, ...], j: int) -> tuple[int, int]:
    """The ticks between the primitives before and after a place."""
    first = row[j - 1].end + 1 if j else 0
    return first, row[j + 1].start - 1 if j + 1 < len(row) else drafter.space.horizon


@settings(max_examples=20)
@given(drafter=drafters(), structure=structures, seed=st.integers(0, 2**32 - 1), data=st.data())
def test_a_place_gets_the_best_of_all_primitives(drafter, structure, seed, data):
    draft = any_draft(drafter, structure, np.random.default_rng(seed))
    if draft is None:
        return
    i = data.draw(st.integers(0, len(draft) - 1))
    j = data.draw(st.integers(0, len(draft[i]) - 1))
    values = {
        primitive: drafter.value(filled(draft, i, j, primitive))
        for primitive in every_primitive(drafter, structure[i][j], *neighbours(drafter, draft[i], j))
    }
    best = max(values.values())
    held = drafter.cost(filled(draft, i, j, None))
    found = drafter.place(draft, structure, i, j)
    assert found.proved
    assert found.value - held == pytest.approx(best, abs=TIE)
    assert values[found.primitive] == pytest.approx(best, abs=TIE)
    assert drafter.place(draft, structure, i, j, least=best - 1e-9).primitive == found.primitive
    assert drafter.place(draft, structure, i, j, least=best + 1e-9) is None


@settings(max_examples=40)
@given(drafter=drafters(), structure=structures, seed=st.integers(0, 2**32 - 1))
def test_value_is_the_objective_less_what_nesting_costs(drafter, structure, seed):
    draft = any_draft(drafter, structure, np.random.default_rng(seed))
    if draft is None:
        return
    formula = formula_of(draft)
    assert draft_of(formula) == draft
    shape = shape_of([[(p.operator, p.complemented) for p in row] for row in draft])
    gaps = drafter.space.gaps()
    objective = Objective(drafter.data, drafter.weights, drafter.prior, drafter.space, shape, gaps, 0.01)
    rate, gain = drafter.parts(draft)
    assert (rate, gain) == pytest.approx(objective.parts(formula), abs=TIE)
    assert gain == pytest.approx(information_gain(formula, drafter.prior), abs=1e-9)
    np.testing.assert_array_equal(drafter.satisfied(draft), weakly(formula, drafter.data))
    nested = sum(primitive.operator.nested for row in draft for primitive in row)
    worth = rate + drafter.information_weight * gain - drafter.nesting_cost * nested
    assert drafter.value(draft) == pytest.approx(worth, abs=TIE)


def valid(drafter: Drafter, draft: Draft, structure: Structure) -> None:
    """Each primitive is one that its place may hold, and formulas are sequential, or would not be there."""
    assert all(disjunct.primitives[-1].end <= drafter.space.horizon for disjunct in formula_of(draft).disjuncts)
    for row, choices in zip(draft, structure, strict=True):
        for primitive, place in zip(row, choices, strict=True):
            assert primitive.operator in place.operators
            assert primitive.complemented in place.polarities
            assert primitive.window.start < primitive.window.end


@settings(max_examples=20)
@given(drafter=drafters(8, 20), structure=structures, seed=st.integers(0, 2**32 - 1))
def test_an_ascent_makes_nothing_worse(drafter, structure, seed):
    draft = any_draft(drafter, structure, np.random.default_rng(seed))
    if draft is None:
        return
    value = drafter.value(draft)
    peak, most = drafter.ascend(draft, structure)
    valid(drafter, peak, structure)
    assert most == pytest.approx(drafter.value(peak), abs=1e-9)
    assert most >= value - 1e-9
    assert drafter.ascend(peak, structure)[0] == peak
    for i, row in enumerate(peak):  # no one primitive can be better
        for j in range(len(row)):
            found = drafter.place(peak, structure, i, j)
            better = drafter.value(filled(peak, i, j, found.primitive))
            assert better <= max(most, drafter.trivial) + 1e-9


def walks(seed: int = 3) -> Drafter:
    data = cells(seed, 3, 9, 40)
    return Drafter(data, np.ones(40), grid_prior(3, 8), SearchSpace.grid(3, 8), 0.01, 0.0, ExactSettings())


TWO: Structure = ((FREE, FREE),)


@pytest.mark.parametrize("call", range(1, 12))
def test_ctrl_c_keeps_the_draft_and_leaves_out_what_follows(monkeypatch, call):
    drafter = walks()
    draft = any_draft(drafter, TWO, np.random.default_rng(0))
    interrupter = Interrupter(call)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    peak, value = drafter.ascend(draft, TWO)
    assert interrupter.left == 0
    assert drafter.interrupted
    assert value >= drafter.value(draft)
    assert value == pytest.approx(drafter.value(peak), abs=TIE)
    assert drafter.place(peak, TWO, 0, 0) is None
    assert coarser(drafter, 2).interrupted
    assert drafter.part(drafter.data.labels == 1, 1.0).interrupted


def test_ctrl_c_without_a_primitive_that_is_good_enough_is_not_lost(monkeypatch):
    interrupter = Interrupter(1)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    problems = []
    monkeypatch.setattr(drafts, "improve", lambda *arguments: problems.append(arguments) or improve(*arguments))
    drafter = walks()
    assert drafter.place(((None,),), ((FREE,),), 0, 0, least=0.9) is None
    assert drafter.interrupted
    interrupter.left = 1
    with pytest.raises(KeyboardInterrupt):
        improve(*problems[0])


def test_an_empty_place_leaves_room_for_those_between():
    drafter = walks()
    found = drafter.place(((None, None, None),), ((FREE, FREE, FREE),), 0, 1)
    assert found.primitive.start >= 2
    assert found.primitive.end <= 6
    nested = drafts.Choice((Operator.EVENTUALLY_ALWAYS,), (False,))
    assert drafter.place(((None,) * 3,), ((nested,) * 3,), 0, 1) is not None
    assert drafter.place(((None,) * 4,), ((nested,) * 4,), 0, 1) is None


def test_a_part_weighs_an_error_and_a_gain_as_the_whole_does():
    drafter = walks()
    mask = np.arange(40) < 30
    part = drafter.part(mask, 3.0)
    lost = part.weights.sum() / drafter.weights.sum()
    assert part.information_weight * lost == pytest.approx(drafter.information_weight)
    assert set(part.weights) == {1.0, 3.0}


def test_trivial_formulas():
    drafter = walks()
    good = (drafter.data.labels == 1).mean()
    most = drafter.prior.arrays(("x", "y")).most
    assert drafter.trivial == pytest.approx(max(good, 1 - good) + 0.01 * most, abs=1e-9)
    assert math.isfinite(most)
