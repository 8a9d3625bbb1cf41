"""One primitive of a formula is searched while the others are held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.exhaustive import best_of_all, problem_of
from tests.inference.test_exact import WEIGHTS, cells, markov_prior
from tests.inference.twins import box_prior
from tests.inference.worlds import grid_prior
from tickwise.inference.counting import log_probability
from tickwise.inference.exact import ExactProblem, ExactSettings, exact_search
from tickwise.inference.information import log_probability as reference
from tickwise.inference.kernels import Shape
from tickwise.inference.objective import formula_signature, trajectory_weights
from tickwise.inference.prior import BoxPrior, Prior
from tickwise.inference.slot import Slot
from tickwise.inference.space import SearchSpace, to_arrays, to_formula
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, SequentialConjunction, to_sdnf

# the primitive over the ticks 3 to 6 is the one that is searched
FORMULAS = (
    "F[0,2] (0 <= x <= 1 & 0 <= y <= 2) & G[3,4] (x <= 1)",
    "G[3,4] (x <= 1) & F[7,8] (y >= 1)",
    "F[0,1] (x >= 1) & F[3,4] G[0,1] (x <= 1) & G[7,8] (y >= 1)",
    "F[3,4] (x <= 1) | G[0,6] F[0,2] (x >= 1)",
    "F[0,2] (y >= 1) & F[3,4] (x <= 1) | F[0,4] (y <= 1) & G[6,8] !(0 <= x <= 1 & 0 <= y <= 1)",
    "F[0,2] (x >= 5) & F[3,4] (x <= 1) | F[0,8] G[0,2] (y <= 1)",
    "F[0,2] (x >= 5) & F[3,4] (x <= 1)",
)
GAP = ((3, 6),)


def slot_of(text: str) -> Slot:
    """The slot of the primitive whose window starts at tick 3."""
    shape, times, lower, upper = to_arrays(to_sdnf(parse(text)), ("x", "y"))
    return Slot(shape, times, lower, upper, int(np.flatnonzero(times[:, 0] == 3)[0]))


def within(problem: ExactProblem, slot: Slot, data: LabelledTrajectories, weights: np.ndarray) -> ExactProblem:
    """The same search for a primitive in a formula: it decides where the others of its disjunct hold alone."""
    whole = to_formula(data.variables, slot.shape, slot.times, slot.lower, slot.upper)
    disjunct = int(np.searchsorted(slot.shape.starts, slot.index, side="right")) - 1
    held = list(whole.disjuncts[disjunct].primitives)
    del held[slot.index - slot.shape.starts[disjunct]]
    others = [one for number, one in enumerate(whole.disjuncts) if number != disjunct]
    ready = np.ones(len(data), dtype=bool)
    if held:
        ready = formula_signature(SDNF((SequentialConjunction(tuple(held)),)), data)
    said = formula_signature(SDNF(tuple(others)), data) if others else np.zeros(len(data), dtype=bool)
    decides = ready & ~said
    base = float(weights[~decides][said[~decides] == (data.labels[~decides] == 1)].sum())
    worth = problem.worth._replace(base=base, total=float(weights.sum()))
    return replace(problem, coded=problem.coded.select(decides), worth=worth, slot=slot)


@settings(max_examples=40)
@given(
    text=st.sampled_from(FORMULAS),
    seed=st.integers(0, 2**32 - 1),
    kind=st.sampled_from(("paths", "chain", "draws")),
    information_weight=st.sampled_from((0.0, 0.01, 0.3)),
    cost=st.sampled_from((0.0, 0.02)),
    class_weight=st.sampled_from(WEIGHTS),
    ragged=st.booleans(),
)
def test_the_best_primitive_of_a_formula(text, seed, kind, information_weight, cost, class_weight, ragged):
    data = cells(seed, 2, 9, 16, ragged=ragged)
    prior: Prior = {
        "paths": grid_prior(2, 8), "chain": markov_prior(seed, 2, 8), "draws": BoxPrior({"x": (0, 2), "y": (0, 2)}, 8)
    }[kind]  # fmt: skip
    weights = trajectory_weights(data.labels, class_weight)
    problem = problem_of(
        data, prior, SearchSpace.grid(2, 8), gaps=GAP, information_weight=information_weight, nesting_cost=cost,
        class_weight=class_weight,
    )  # fmt: skip
    problem = within(problem, slot_of(text), data, weights)
    value, primitive = best_of_all(problem, data, weights)
    result = exact_search(problem, ExactSettings())
    assert result.value == pytest.approx(value, abs=1e-12)
    assert result.primitive == primitive
    assert result.proved


@pytest.mark.parametrize("text", FORMULAS)
@pytest.mark.parametrize("prior", [grid_prior(2, 8), BoxPrior({"y": (0, 2), "x": (0, 2)}, 8)])
def test_the_probability_is_that_of_the_whole_formula(text, prior):
    slot, whole = slot_of(text), to_sdnf(parse(text))
    shape, times, lower, upper = to_arrays(whole, ("x", "y"))
    one = slot.index
    arguments = (int(shape.operators[one]), bool(shape.complemented[one]), times[one], lower[one], upper[one])
    empty = Slot(shape, np.zeros_like(times), np.zeros_like(lower), np.zeros_like(upper), one)
    for array, rows in ((empty.times, times), (empty.lower, lower), (empty.upper, upper)):
        array[:] = np.where(np.arange(len(times))[:, None] == one, 0, rows)
    for found in (slot, empty):  # what the arrays say of the searched primitive is not read
        assert found.log_probability(prior.arrays(("x", "y")), *arguments) == pytest.approx(
            reference(whole, prior), abs=1e-12
        )


def test_a_primitive_alone():
    prior = box_prior(4).arrays(("x",))
    lower, upper, times = np.array([1.0]), np.array([2.0]), np.array([0, 2, 1])
    shape = Shape(np.array([0, 1]), np.array([2]), np.array([True]))
    assert Slot.alone(1).log_probability(prior, 2, True, times, lower, upper) == log_probability(
        prior, shape, times[None], lower[None], upper[None]
    )
