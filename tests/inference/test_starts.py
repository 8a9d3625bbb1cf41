import numpy as np
import pytest

from tests.inference.starts_twin import plain_starts
from tests.inference.worlds import errand_data
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.starts import sampled_starts
from tickwise.inference.tree import STRUCTURES
from tickwise.logic.semantics import holds

DATA = errand_data(3, 4, 10, (0, 1, 0, 2), 2, (2, 4, 2, 4), 8, 20)


@pytest.mark.parametrize("space", [SearchSpace.grid(4, 10), SearchSpace.from_data(DATA)])
@pytest.mark.parametrize("structure", [[[pair]] for pair in STRUCTURES[:4]] + [[[STRUCTURES[2], STRUCTURES[0]]] * 2])
def test_starts_are_boxes_around_states_that_were_visited(space, structure):
    shape = shape_of(structure)
    starts = sampled_starts(DATA, space, shape, 30, np.random.default_rng(0))
    assert starts.shape == (30, len(space.units(shape)))
    for position in starts:
        for disjunct in space.decode(position, shape).disjuncts:
            for primitive in disjunct.primitives:
                assert holds(primitive.box, DATA.values, DATA.variables).any()


def test_no_starts():
    shape = shape_of([[STRUCTURES[0]]])
    assert sampled_starts(DATA, SearchSpace.grid(4, 10), shape, 0, np.random.default_rng(0)).shape[0] == 0


@pytest.mark.parametrize("space", [SearchSpace.grid(4, 10), SearchSpace.grid(4, 6), SearchSpace.from_data(DATA)])
@pytest.mark.parametrize("structure", [[[pair]] for pair in STRUCTURES] + [[[STRUCTURES[2], STRUCTURES[3]]] * 2])
@pytest.mark.parametrize("labels", ["both", "one"])
def test_the_kernel_draws_what_its_twin_draws(space, structure, labels):
    data = DATA if labels == "both" else DATA.select(DATA.labels == -1)
    shape, ours, theirs = shape_of(structure), np.random.default_rng(7), np.random.default_rng(7)
    for count in (40, 3):
        found, wanted = (
            draw(data, space, shape, count, rng) for draw, rng in ((sampled_starts, ours), (plain_starts, theirs))
        )
        np.testing.assert_array_equal(found, wanted)
    assert ours.bit_generator.state == theirs.bit_generator.state
