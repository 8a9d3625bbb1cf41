"""Tests of the sample of formulas that agree best with what was seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.inference.worlds import grid_prior, walk
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.hypotheses import Hypotheses, structure_shape
from tickwise.inference.objective import formula_signature
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Operator, to_sdnf
from tickwise.logic.structure import structurally_transferable, structure

SIZE, HORIZON = 4, 12
GRID = SearchSpace.grid(SIZE, HORIZON)
CONTINUOUS = SearchSpace(("x", "y"), ((0.0, 4.0), (0.0, 4.0)), HORIZON, (True, True))
MIXED = SearchSpace(("x", "y"), ((0.0, 1.0, 2.0, 3.0, 4.0), (0.0, 4.0)), HORIZON, (False, True))
SPACES = {"grid": GRID, "continuous": CONTINUOUS, "mixed": MIXED}

ERRAND = "F[0,4] G[0,2] (1 <= x <= 2 & 0 <= y <= 2) & F[8,12] (2 <= x <= 4 & 2 <= y <= 4)"
SOURCES = {
    "one primitive": "F[2,5] (1 <= x <= 2 & 1 <= y <= 3)",
    "a conjunction": ERRAND,
    "all operators": "F[0,1] (x >= 1) & G[2,3] (y <= 3) & F[4,5] G[0,1] (x <= 2) & G[7,8] F[0,2] (y >= 1)",
    "complements": "G[0,3] !(1 <= x <= 3 & 0 <= y <= 3) & F[5,7] G[0,2] !(0 <= x <= 4 & 1 <= y <= 4)",
    "two disjuncts": "F[0,4] G[0,2] (x <= 1) & F[8,12] (y >= 3) | G[0,9] F[0,3] !(x >= 1)",
    "beyond the horizon": "F[10,20] (1 <= x <= 2) & G[22,40] F[0,20] (y >= 2)",
    "outside the world": "F[0,4] (9 <= x <= 12 & -5 <= y <= -3) & G[6,8] (x >= 20)",
    "other variables": "F[0,4] (speed >= 3) & F[6,8] (x <= 2)",
}


def sdnf(text: str) -> SDNF:
    return to_sdnf(parse(text))


def hypotheses(text: str, space: SearchSpace = GRID, count: int = 60, seed: int = 0, copies: int = 1) -> Hypotheses:
    prior = grid_prior(SIZE, HORIZON)
    return Hypotheses(sdnf(text), space, prior, count, np.random.default_rng(seed), copies)


def walks(rule: str, count: int = 120, seed: int = 0, positives: int | None = None) -> LabelledTrajectories:
    """Random walks, some cut short, with a rule's labels; as many good ones as asked for."""
    rng = np.random.default_rng(seed)
    values = np.stack([walk(rng, SIZE, HORIZON) + 0.5 for _ in range(count)])
    lengths = rng.choice([HORIZON + 1, HORIZON - 4], count, p=[0.8, 0.2])
    data = LabelledTrajectories.from_arrays(values, np.ones(count, int), ("x", "y"), lengths)
    good = formula_signature(sdnf(rule), data)
    kept = np.ones(count, bool) if positives is None else ~good | (np.cumsum(good) <= positives)
    labels = np.where(good, 1, -1)[kept]
    return LabelledTrajectories.from_arrays(values[kept], labels, ("x", "y"), lengths[kept])


def plain_errors(found: Hypotheses, data: LabelledTrajectories, weights: NDArray[np.float64]) -> list[float]:
    """The weighted share of trajectories that each formula is wrong about, one after the other."""
    wrong = [formula_signature(found.formula(row), data) != (data.labels == 1) for row in found.positions]
    return [float(weights[each].sum() / weights.sum()) for each in wrong]


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("copies", [1, 3])
def test_draws_are_valid_and_have_the_structure(source: str, space: str, copies: int):
    found = hypotheses(SOURCES[source], SPACES[space], copies=copies)
    assert found.positions.shape == (60, len(SPACES[space].units(found.shape)))
    assert (found.errors == 0).all()
    for position in found.positions:
        formula = found.formula(position)  # whose parts check themselves
        assert structure(formula) == structure(found.source) * copies
        assert structurally_transferable(formula, found.source)
        for primitive in (primitive for disjunct in formula.disjuncts for primitive in disjunct.primitives):
            assert primitive.start >= 0
            assert primitive.end <= HORIZON
            for bound in primitive.box.bounds:
                sides = {side for side in (bound.lower, bound.upper) if np.isfinite(side)}
                assert bound.lower < bound.upper
                assert all(0 <= side <= SIZE for side in sides)
                assert SPACES[space].continuous["xy".index(bound.variable)] or sides <= set(range(SIZE + 1))


def test_the_shape_is_the_structure():
    shape = structure_shape(sdnf(SOURCES["two disjuncts"]), 2)
    stay, reach, visits = (
        (Operator.EVENTUALLY_ALWAYS, False), (Operator.EVENTUALLY, False), (Operator.ALWAYS_EVENTUALLY, True),
    )  # fmt: skip
    expected = shape_of([[stay, reach], [visits]] * 2)
    for one, other in zip(shape, expected, strict=True):
        np.testing.assert_array_equal(one, other)


def test_draws_are_mostly_near_the_source():
    source = "F[3,5] G[0,2] (1 <= x <= 3 & 0 <= y <= 2)"
    found = hypotheses(source, count=2_000)
    primitives = [found.formula(position).disjuncts[0].primitives[0] for position in found.positions]
    near = [abs(p.window.start - 3) <= 3 and abs(p.window.end - 5) <= 3 for p in primitives]
    assert 0.8 <= np.mean(near) < 1
    assert all(p.duration <= 4 for p in primitives)
    sides = np.array([[bound.upper - bound.lower for bound in p.box.bounds] for p in primitives])
    assert set(sides.flat) == {1, 2, 3}
    assert np.mean(sides == 1) > 0.5
    # anywhere in the world
    assert {(bound.lower, bound.upper) for p in primitives for bound in p.box.bounds} >= {(0, 1), (3, 4), (1, 4)}


def test_complements_are_drawn_as_large_as_the_source():
    found = hypotheses("G[3,5] !(0 <= x <= 3 & 0 <= y <= 3)", count=2_000)
    boxes = [found.formula(position).disjuncts[0].primitives[0].box for position in found.positions]
    assert {bound.upper - bound.lower for box in boxes for bound in box.bounds} == {1, 2, 3, 4}
    assert np.mean([bound.upper - bound.lower == 1 for box in boxes for bound in box.bounds]) < 0.4


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("source", ["a conjunction", "complements", "two disjuncts"])
def test_errors_are_those_of_a_plain_count(source: str, space: str):
    found = hypotheses(SOURCES[source], SPACES[space])
    data = walks(ERRAND)
    weights = np.random.default_rng(1).random(len(data))
    bad = data.labels < 0
    found.update(data.select(bad), weights[bad])
    assert len(found.positions) == len(found.errors) == 60
    np.testing.assert_allclose(found.errors, plain_errors(found, data.select(bad), weights[bad]), atol=2e-9)
    for rounds in (1, 2):
        found.update(data, weights, rounds)
        # a tenth, since some were good
        assert len(found.positions) == len(found.errors) == 6
        np.testing.assert_allclose(found.errors, plain_errors(found, data, weights), atol=2e-9)
        assert (np.diff(found.errors) >= 0).all()
        np.testing.assert_array_equal(found.best, found.positions[found.errors == found.errors[0]])


def test_without_positives_only_draws_that_nothing_contradicts_survive(monkeypatch: pytest.MonkeyPatch):
    # all are kept as long as none was good
    drawn: list[NDArray[np.float64]] = []
    draw = Hypotheses._drawn

    def remembered(self: Hypotheses, count: int) -> NDArray[np.float64]:
        drawn.append(draw(self, count))
        return drawn[-1]

    monkeypatch.setattr(Hypotheses, "_drawn", remembered)
    found = hypotheses("F[2,5] (1 <= x <= 2 & 1 <= y <= 3)", count=100)
    everything = walks("F[3,7] (x >= 3 & y >= 3)", 300, positives=0)
    before = 100
    for few in (5, 20, 60):
        data = everything.select(np.arange(len(everything)) < few)
        found.update(data, np.ones(len(data)))
        assert {tuple(row) for row in found.positions} <= {tuple(row) for part in drawn for row in part}
        assert len(found.positions) == 100
        assert found.errors[0] == 0
        for position in found.best:
            assert not formula_signature(found.formula(position), data).any()
        assert len(found.best) <= before
        before = len(found.best)
    assert len(drawn) == 4


@pytest.mark.parametrize("source", ["one primitive", "a conjunction", "complements", "two disjuncts"])
def test_an_update_never_makes_the_best_worse(source: str):
    found = hypotheses(SOURCES[source], count=30)
    everything = walks("F[3,7] (x >= 3 & y >= 2) | G[0,3] (x <= 1)", 80)
    noisy = np.where(np.random.default_rng(0).random(80) < 0.2, -everything.labels, everything.labels)
    everything = LabelledTrajectories.from_arrays(everything.values, noisy, ("x", "y"), everything.lengths)
    for few in (40, 40, 80, 80, 80):
        data = everything.select(np.arange(80) < few)
        weights = np.linspace(1, 3, few)
        before = min(plain_errors(found, data, weights))
        found.update(data, weights)
        assert found.errors[0] <= before + 1e-9


@pytest.mark.parametrize("space", SPACES)
def test_a_rule_of_the_structure_is_found(space: str):
    data = walks("F[3,7] G[0,1] (2 <= x <= 3 & 1 <= y <= 3)", 300)
    found = hypotheses("F[2,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 1)", SPACES[space], 2_000)
    for _ in range(4):
        found.update(data, np.ones(len(data)), 3)
    assert found.errors[0] <= 0.02


def test_growing_gives_disjunctions_of_the_structure():
    data = walks("F[1,4] G[0,1] (x <= 1 & y <= 1) | F[1,4] G[0,1] (x >= 3 & y >= 3)", 300)
    found = hypotheses("F[2,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 1)", count=600)
    weights = np.where(data.labels > 0, 1 / data.positives, 1 / data.negatives)
    found.update(data, weights, 6)
    single = found.errors[0]
    for copies in (2, 3):
        found.grow(data, weights)
        assert found.copies == copies
        assert found.positions.shape == (60, 7 * copies)
        for position in found.positions:
            assert structure(found.formula(position)) == structure(found.source) * copies
            assert structurally_transferable(found.formula(position), found.source)
        np.testing.assert_allclose(found.errors, plain_errors(found, data, weights), atol=2e-9)
        found.update(data, weights, 6)
        assert found.positions.shape == (60, 7 * copies)
    assert found.errors[0] < single / 4


@pytest.mark.parametrize("seed", range(3))
def test_growing_finds_what_the_first_copies_leave(seed: int):
    # one disjunct says most of it, so that the best of a single copy are all much the same
    data = walks("F[0,9] G[0,1] (x <= 2 & y <= 1) | F[8,10] G[0,1] (x >= 3 & y >= 3)", 300, seed)
    weights = np.where(data.labels > 0, 1 / data.positives, 1 / data.negatives)
    found = hypotheses("F[2,5] G[0,2] (1 <= x <= 2 & 0 <= y <= 1)", count=1_000, seed=seed)
    found.update(data, weights, 4)
    single = found.errors[0]
    found.grow(data, weights)
    assert found.errors[0] < single / 2
    found.update(data, weights, 12)
    assert found.errors[0] < 0.005


def test_growing_a_source_of_several_disjuncts_copies_all_of_them():
    data = walks(ERRAND + " | G[0,9] (x >= 2)", 100)
    found = hypotheses(SOURCES["two disjuncts"], count=50)
    found.update(data, np.ones(100))
    found.grow(data, np.ones(100))
    assert structure(found.formula(found.best[0])) == structure(found.source) * 2
    assert structurally_transferable(found.formula(found.best[0]), found.source)


def test_copies_that_say_nothing_are_left_out():
    data = walks("F[0,5] (x >= 3 & y >= 3)", positives=20)
    weights = np.full(len(data), 1 / len(data))
    found = hypotheses("F[0,6] (x >= 3 & y >= 2)", copies=3)
    found.update(data, weights, 4)
    before = found.errors.min()
    found.shrink(data, weights, 4)
    assert found.copies == 1
    assert found.errors.min() <= before + 1e-9
    assert found.errors.tolist() == pytest.approx(plain_errors(found, data, weights))
    assert len(found.formula(found.best[0]).disjuncts) == 1


def test_copies_that_are_needed_stay():
    data = walks("F[0,6] (x >= 3 & y >= 3) | F[0,6] (x <= 1 & y <= 1)")
    weights = np.full(len(data), 1 / len(data))
    found = hypotheses("F[0,6] (x >= 3 & y >= 3)", copies=2, count=200)
    found.positions[0] = found.space.encode(sdnf("F[0,6] (x >= 3 & y >= 3) | F[0,6] (x <= 1 & y <= 1)"))
    found.update(data, weights, 2)
    assert found.errors.min() == 0.0
    positions = found.positions.copy()
    found.shrink(data, weights, 2)
    assert found.copies == 2
    np.testing.assert_array_equal(found.positions, positions)


@pytest.mark.parametrize("label", [1, -1])
def test_growing_needs_both_labels(label: int):
    data = walks(ERRAND, 20)
    data = LabelledTrajectories.from_arrays(data.values, np.full(20, label), ("x", "y"), data.lengths)
    found = hypotheses(ERRAND)
    found.update(data, np.ones(20))
    with pytest.raises(DataError, match=f"no trajectory has label {-label}"):
        found.grow(data, np.ones(20))
    assert found.copies == 1


def test_without_negatives_what_accepts_everything_is_best():
    data = walks("F[0,12] (x >= 0)", 30)
    found = hypotheses("F[2,5] (1 <= x <= 2 & 1 <= y <= 3)", count=100)
    found.update(data, np.ones(30), 8)
    assert found.errors[0] == 0
    assert formula_signature(found.formula(found.best[0]), data).all()


def test_the_mass_is_the_mean_share_of_formulas_that_accept():
    space = SearchSpace(("x",), ((0.0, 1.0, 2.0, 3.0),), 2, (False,))
    prior = PathPrior(np.ones((3, 3)), [[0.5], [1.5], [2.5]], ("x",), 2)
    found = Hypotheses(sdnf("F[0,1] (x <= 1)"), space, prior, 5, np.random.default_rng(0))
    # F[0,1] (0 <= x <= 1), F[0,1] (2 <= x <= 3) and F[1,2] (1 <= x <= 3)
    among = np.array([[0.0, 1, 0, 1], [2, 3, 0, 1], [1, 3, 1, 2]])
    paths = np.array([[0.5, 0.5, 0.5], [0.5, 2.5, 0.5], [2.5, 0.5, 1.5], [1.5, 1.5, 0.5]])[..., None]
    data = LabelledTrajectories.from_arrays(paths, np.ones(4, int), ("x",))
    # the first accepts three of the paths, the second two, the third three
    assert found.mass(data, among) == pytest.approx((3 + 2 + 3) / 12)
    assert found.mass(data, among[1:2]) == pytest.approx(1 / 2)
    # an end that comes too early decides nothing against the third
    short = LabelledTrajectories.from_arrays(paths[:1], np.ones(1, int), ("x",), [2])
    assert found.mass(short, among) == pytest.approx(2 / 3)


@pytest.mark.parametrize("space", SPACES)
def test_the_same_seed_gives_the_same(space: str):
    data = walks(ERRAND, 60)
    results = []
    for seed in (5, 5, 6):
        found = hypotheses(ERRAND, SPACES[space], seed=seed)
        found.update(data, np.ones(60), 2)
        found.grow(data, np.ones(60))
        results.append((found.positions.tobytes(), found.errors.tobytes()))
    assert results[0] == results[1] != results[2]


def test_a_space_of_few_formulas():
    space = replace(GRID, horizon=1)
    found = Hypotheses(sdnf("G[0,9] (x >= 3)"), space, grid_prior(SIZE, 1), 500, np.random.default_rng(0))
    data = walks("G[0,1] (x >= 2)")
    data = LabelledTrajectories.from_arrays(data.values[:, :2], data.labels, ("x", "y"))
    for _ in range(3):
        found.update(data, np.ones(len(data)))
    assert found.errors[0] == 0
    assert found.formula(found.best[0]).disjuncts[0].primitives[0].window.end == 1


def test_a_structure_that_the_horizon_has_no_room_for_is_refused():
    with pytest.raises(ConfigurationError, match="2 primitives one after the other do not fit into 3 ticks; use a lon"):
        hypotheses(ERRAND, replace(GRID, horizon=3))
    hypotheses(ERRAND, replace(GRID, horizon=4))
