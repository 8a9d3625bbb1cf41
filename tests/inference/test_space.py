import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickwise.errors import ConfigurationError, UnknownVariableError
from tickwise.inference.space import SearchSpace, shape_of, to_arrays
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import Operator, to_sdnf

GRID = SearchSpace.grid(4, 12)
MIXED = SearchSpace(("x", "y"), ((0.0, 1.0, 2.5), (-10.0, 30.0)), 12, (False, True))
spaces = st.sampled_from((GRID, MIXED))
pairs = st.tuples(st.sampled_from(Operator), st.booleans())
anything = st.floats(-60, 60)


def positions(space, shape):
    return st.lists(anything, min_size=len(space.units(shape)), max_size=len(space.units(shape))).map(np.array)


@st.composite
def occupied(draw):
    ends = sorted(draw(st.lists(st.integers(0, 12), max_size=6, unique=True)))
    return list(zip(ends[::2], ends[1::2], strict=False))


def check_boxes(space, formula):
    for disjunct in formula.disjuncts:
        for primitive in disjunct.primitives:
            for bound in primitive.box.bounds:
                column = space.variables.index(bound.variable)
                edges = space.edges[column]
                if space.continuous[column]:
                    assert all(edges[0] <= end <= edges[-1] or math.isinf(end) for end in (bound.lower, bound.upper))
                else:
                    assert bound.lower in edges
                    assert bound.upper in edges
                assert bound.lower < bound.upper


@settings(max_examples=500)
@given(space=spaces, pair=pairs, path=occupied(), data=st.data())
def test_no_position_leaves_upsilon(space, pair, path, data):
    shape, gaps = shape_of([[pair]]), space.gaps(path)
    if not space.room(shape, gaps):
        return
    formula = space.decode(data.draw(positions(space, shape)), shape, gaps)
    (primitive,) = formula.disjuncts[0].primitives
    assert (primitive.operator, primitive.complemented) == pair
    assert primitive.window.start < primitive.window.end
    assert primitive.start >= 0
    assert primitive.end <= space.horizon
    assert all(primitive.end < first or last < primitive.start for first, last in path)
    check_boxes(space, formula)


@settings(max_examples=300)
@given(
    space=spaces, structure=st.lists(st.lists(pairs, min_size=1, max_size=3), min_size=1, max_size=2), data=st.data()
)
def test_sequences_stay_sequential_and_within_the_horizon(space, structure, data):
    shape = shape_of(structure)
    assert space.room(shape, space.gaps())
    formula = space.decode(data.draw(positions(space, shape)), shape)  # SequentialConjunction checks Definition 5
    found = [[(p.operator, p.complemented) for p in disjunct.primitives] for disjunct in formula.disjuncts]
    assert found == structure
    assert all(disjunct.primitives[-1].end <= space.horizon for disjunct in formula.disjuncts)
    check_boxes(space, formula)


@settings(max_examples=200)
@given(space=spaces, pair=pairs, data=st.data())
def test_encode_is_the_inverse_of_decode(space, pair, data):
    shape = shape_of([[pair]])
    formula = space.decode(data.draw(positions(space, shape)), shape)
    assert space.decode(space.encode(formula), shape) == formula


@given(
    space=spaces,
    structure=st.lists(st.lists(pairs, min_size=1, max_size=2), min_size=1, max_size=2),
    seed=st.integers(0, 99),
)
def test_arrays_and_formulas_say_the_same(space, structure, seed):
    shape = shape_of(structure)
    lower, upper = space.bounds(shape)
    formula = space.decode(np.random.default_rng(seed).uniform(lower, upper), shape)
    again, times, low, high = to_arrays(formula, space.variables)
    assert all((a == b).all() for a, b in zip(shape, again, strict=True))
    first = formula.disjuncts[0].primitives[0]
    assert times[0].tolist() == [first.window.start, first.window.end, first.duration]
    assert low.shape == high.shape == (formula.size, 2)


def test_every_box_and_window_can_be_reached():
    space = SearchSpace.grid(2, 3, ("x",))
    shape = shape_of([[(Operator.EVENTUALLY, False)]])
    lower, upper = space.bounds(shape)
    rng = np.random.default_rng(0)
    found = {str(space.decode(rng.uniform(lower, upper), shape)) for _ in range(2000)}
    assert len(found) == 3 * 6  # boxes [0,1] [1,2] [0,2]; windows a < b in 0..3


def test_open_sides_are_found_in_continuous_ranges():
    space = SearchSpace(("x",), ((0.0, 10.0),), 5, (True,))
    shape = shape_of([[(Operator.ALWAYS, False)]])
    assert str(space.decode(np.array([-1.0, 3.14159, 0, 2]), shape)) == "G[0,2] (x <= 3.14)"
    assert str(space.decode(np.array([3.14159, 12.0, 0, 2]), shape)) == "G[0,2] (x >= 3.14)"
    assert str(space.decode(np.array([-1.0, 12.0, 0, 2]), shape)) == "G[0,2] (0 <= x <= 10)"


def test_gaps_by_hand():
    assert GRID.gaps() == ((0, 12),)
    assert GRID.gaps([(1, 10)]) == ((11, 12),)
    assert GRID.gaps([(2, 5)]) == ((0, 1), (6, 12))
    assert GRID.gaps([(8, 9), (2, 5)]) == ((0, 1), (6, 7), (10, 12))
    assert GRID.gaps([(0, 11)]) == ()  # Condition III: tick 12 alone holds no window
    nested = shape_of([[(Operator.EVENTUALLY_ALWAYS, False)]])
    assert not GRID.room(nested, GRID.gaps([(1, 10)]))
    assert GRID.room(nested, GRID.gaps([(1, 9)]))


def test_the_space_of_data_covers_it():
    X = [[[0.0123, 5.0], [1.6789, 5.0]], [[0.5, 5.0]]]
    space = SearchSpace.from_data(LabelledTrajectories.from_arrays(X, [1, -1], ("a", "b")))
    assert space.horizon == 1
    assert space.edges[0] == pytest.approx((0.012, 1.679))
    assert space.edges[1] == (4.5, 5.5)  # a constant still has a range


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((("x",), ((0.0,),), 5, (False,)), "two or more"),
        ((("x",), ((1.0, 0.0),), 5, (False,)), "increasing"),
        ((("x",), ((0.0, math.inf),), 5, (False,)), "finite"),
        ((("x",), ((0.0, 1.0, 2.0),), 5, (True,)), "two ends"),
        ((("x",), ((0.0, 1.0),), 0, (True,)), "holds no window"),
        ((("x", "y"), ((0.0, 1.0),), 5, (True,)), "for every variable"),
    ],
)
def test_wrong_spaces(arguments, message):
    with pytest.raises(ConfigurationError, match=message):
        SearchSpace(*arguments)


def test_unknown_variables_are_named():
    with pytest.raises(UnknownVariableError, match="'z'; the data has x, y"):
        to_arrays(to_sdnf(parse("F[0,1] (z > 0)")), ("x", "y"))
