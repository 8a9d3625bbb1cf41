"""Ranges of boxes split without losing any; the first of them comes first."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import Choice, every_box, every_node
from tests.inference.test_scan import LEVELS, box_ranges, single_boxes
from tickwise.inference.boxes import (
    box_of,
    everywhere,
    first_key,
    outermost,
    ranges,
    root,
    single,
    split,
    split_between,
    tighter,
)
from tickwise.logic.sdnf import Operator

kinds = st.tuples(st.booleans(), st.booleans())
OPEN = (tuple(0 for _ in LEVELS.sides), tuple(len(sides) - 1 for sides in LEVELS.sides))


def names(boxes):
    return sorted(tuple(box.tolist()) for box in boxes)


@given(kinds)
def test_the_root_has_all_boxes(kind):
    whole = root(LEVELS, *kind)
    found = {(tuple(box[2:4].tolist()), tuple(box[6:8].tolist())) for box in every_node(whole)}
    # of the second variable no side is open, so that each box says something
    assert found == set(every_box(LEVELS))
    assert (tuple(outermost(whole)[2:4].tolist()), tuple(outermost(whole)[6:8].tolist())) == OPEN


@settings(max_examples=200)
@given(box_ranges())
def test_a_split_keeps_every_box_once(node):
    before = node.copy()
    if single(node):
        assert len(list(every_node(node))) == 1
        return
    halves = split(node)
    assert len(halves) > 1 or len(list(every_node(node))) == len(list(every_node(halves[0])))
    assert names(box for half in halves for box in every_node(half)) == names(every_node(node))
    assert names(halves) != names([node])
    np.testing.assert_array_equal(node, before)


@given(box_ranges())
def test_splitting_ends_with_the_single_boxes(node):
    waiting, found = [node], []
    while waiting:
        one = waiting.pop()
        (found if single(one) else waiting).extend([one] if single(one) else split(one))
    assert names(found) == names(every_node(node))


@settings(max_examples=200)
@given(box_ranges())
def test_the_first_key_comes_before_all(node):
    first = first_key(node, LEVELS, nested=False)
    operator = Operator.EVENTUALLY if node[0] else Operator.ALWAYS
    for box in every_node(node):
        choice = Choice(operator, bool(node[1]), (0, 1, 0), tuple(box[2:4].tolist()), tuple(box[6:8].tolist()))
        key = first_key(box, LEVELS, nested=False)
        assert key == choice.key(LEVELS)[: len(key)]
        assert first <= key


def holds(node, points):
    lower, upper = box_of(node, LEVELS.arrays()[0])
    return ((points >= lower) & (points <= upper)).all(axis=1) != bool(node[1])


POINTS = np.stack(np.meshgrid(np.arange(-2, 8) / 2 + 0.25, np.arange(-4, 16) / 2), axis=-1).reshape(-1, 2)


@given(single_boxes(), kinds)
def test_a_tighter_box_implies_the_box_and_comes_before_it(box, kind):
    node = np.array([*kind, *box[0], *box[0], *box[1], *box[1]], dtype=np.int64)
    for near in tighter(node, LEVELS):
        assert single(near)
        assert not (holds(near, POINTS) & ~holds(node, POINTS)).any()
        assert np.abs(near - node).sum() == 2
        assert first_key(near, LEVELS, nested=True) < first_key(node, LEVELS, nested=True)


@given(kinds, st.integers(0, 2**32 - 1))
def test_splits_between_levels_cover_all_sides(kind, seed):
    rng = np.random.default_rng(seed)
    node = everywhere(LEVELS, *kind)
    last = np.array([len(sides) - 1 for sides in LEVELS.sides])
    # sides anywhere, as numbers of levels with fractions
    sides = np.sort(rng.uniform(0, 1, (2, 2)) * last, axis=0)
    while halves := split_between(node):
        node, *others = [half for half in halves if covers(half, sides)]
        assert all(covers(other, sides) for other in others)
    assert (ranges(node)[:, 1] - ranges(node)[:, 0] <= 1).all()
    assert covers(node, sides)


def covers(node, sides):
    levels = ranges(node)
    return bool(((levels[:, 0] <= sides) & (sides <= levels[:, 1])).all())
