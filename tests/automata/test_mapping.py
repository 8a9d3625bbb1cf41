from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.automata.twins import CASE_STUDY, one, walk, words
from tests.strategies import equivalents, predicates, sequential_conjunctions
from tickwise.automata.build import build
from tickwise.automata.mapping import bijections
from tickwise.automata.model import Edge, TimedAutomaton
from tickwise.errors import AutomatonError
from tickwise.logic.sdnf import Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Box, Interval, Not


def operators(conjunction: SequentialConjunction) -> list[str]:
    return [primitive.operator.value for primitive in conjunction.primitives]


def images(automaton: TimedAutomaton, letters, locations, clocks) -> set[tuple[object, ...]]:
    """The edges as (ξ_Q(q), ξ_Σ(σ), ξ_Q(q'), compared clocks, ξ_C[r]), one for each letter."""
    return {
        (
            int(locations[edge.source]),
            int(letters[letter]),
            int(locations[edge.target]),
            frozenset((int(clocks[atom.clock]), atom.comparison) for atom in edge.guard),
            frozenset(int(clocks[clock]) for clock in edge.resets),
        )
        for edge in automaton.edges
        for letter in automaton.letters(edge)
    }


@settings(max_examples=200)
@given(st.data())
def test_the_bijections_preserve_the_structure(data):
    conjunction = data.draw(sequential_conjunctions())
    target, source = build(data.draw(equivalents(conjunction))), build(conjunction)
    xi = bijections(target, source)
    for found, size in (
        (xi.letters, 2 ** len(source.predicates)),
        (xi.locations, len(source.locations)),
        (xi.clocks, len(source.clocks)),
    ):
        assert sorted(found.tolist()) == list(range(size))
        with pytest.raises(ValueError, match="read-only"):
            found[0] = 1
    assert xi.locations[target.initial] == source.initial
    assert set(xi.locations[sorted(target.accepting)]) == source.accepting
    assert set(xi.locations[sorted(target.rejecting)]) == source.rejecting
    assert [source.stages[q] for q in xi.locations] == list(target.stages)
    every = [np.arange(size) for size in (len(xi.letters), len(xi.locations), len(xi.clocks))]
    assert images(target, xi.letters, xi.locations, xi.clocks) == images(source, *every)


@settings(max_examples=100)
@given(st.data())
def test_the_image_of_a_run_is_a_run_where_the_numbers_are_the_same(data):
    """A target whose predicates alone differ, complements included, goes where the source goes under ξ."""
    conjunction = data.draw(sequential_conjunctions())
    others = (replace(primitive, predicate=data.draw(predicates())) for primitive in conjunction.primitives)
    target, source = build(SequentialConjunction(tuple(others))), build(conjunction)
    xi = bijections(target, source)
    word = data.draw(words(conjunction))
    for (q, v), (image, valuation) in zip(walk(target, word), walk(source, xi.letters[word].tolist()), strict=True):
        assert xi.locations[q] == image
        assert [v[clock] for clock in np.argsort(xi.clocks)] == list(valuation)


@pytest.mark.parametrize("operator", Operator)
@pytest.mark.parametrize("polarity", [Box.of(x=(0, 1)), Not(Box.of(x=(0, 1)))], ids=["box", "complement"])
def test_a_negation_maps_to_its_dual_and_to_nothing_else(operator, polarity):
    """¬◇ρ is transferable from □σ, whichever of the two is a complement (Definition 6 compares operators)."""
    duration = 2 if operator.nested else 0
    primitive = Primitive(operator, Interval(1, 3), duration, polarity)
    negated = build(SequentialConjunction((primitive.negation,)))
    for other in Operator:
        source = build(one(other.value, 0, 4, 3 if other.nested else 0))
        if other is operator.dual:
            assert bijections(negated, source).locations.tolist() == list(range(len(source.locations)))
        else:
            with pytest.raises(AutomatonError, match="not isomorphic"):
                bijections(negated, source)


@settings(max_examples=150)
@given(sequential_conjunctions(), sequential_conjunctions())
def test_other_structures_are_refused(first, second):
    assume(operators(first) != operators(second))
    with pytest.raises(AutomatonError, match="not isomorphic") as caught:
        bijections(build(first), build(second))
    assert "\n" not in str(caught.value)


def test_the_difference_is_named():
    target = build(one("F", 1, 2))
    with pytest.raises(AutomatonError, match="number of clocks is 1 in the target's and 2 in the source's"):
        bijections(target, build(one("FG", 1, 2, 3)))
    with pytest.raises(AutomatonError, match=r"the edge is 'q0: .* in the target's and 'q0: any letter, c1 < 1"):
        bijections(target, build(one("G", 1, 2)))
    with pytest.raises(AutomatonError, match="number of predicates is 1"):
        bijections(target, build(CASE_STUDY))


def test_every_part_counts():
    source = build(CASE_STUDY)
    none: frozenset[int] = frozenset()
    for changes, what in (
        ({"initial": 1}, "initial location"),
        ({"accepting": none}, "accepting locations"),
        ({"rejecting": frozenset({4})}, "rejecting locations"),
        ({"stages": (0, 1, 1, 1, 0, 1)}, "stages"),
        ({"edges": source.edges[:-1]}, "edge is missing"),
        ({"edges": (*source.edges[:-1], Edge(5, ((0, True),), 5))}, "edge"),
    ):
        with pytest.raises(AutomatonError, match=what):
            bijections(replace(source, **changes), source)
    bijections(replace(source, edges=source.edges[::-1]), source)
