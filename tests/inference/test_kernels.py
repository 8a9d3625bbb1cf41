import numpy as np
from hypothesis import given, settings

from tests.strategies import VARIABLES, batches, primitives, sdnfs, trajectories
from tickwise.inference.kernels import satisfied
from tickwise.inference.space import to_arrays
from tickwise.logic.sdnf import SDNF, SequentialConjunction
from tickwise.logic.syntax import Verdict


def weak(formula, batch):
    values, lengths = batch
    return np.asarray(formula.formula.verdict(values, variables=VARIABLES, lengths=lengths)) != Verdict.FALSE


@settings(max_examples=400)
@given(primitive=primitives(longest=8), batch=batches())
def test_primitives_equal_the_semantics_on_ragged_batches(primitive, batch):
    formula = SDNF((SequentialConjunction((primitive,)),))
    assert (satisfied(*batch, *to_arrays(formula, VARIABLES)) == weak(formula, batch)).all()


@settings(max_examples=200)
@given(formula=sdnfs(longest=5), batch=batches())
def test_formulas_equal_the_semantics_on_ragged_batches(formula, batch):
    assert (satisfied(*batch, *to_arrays(formula, VARIABLES)) == weak(formula, batch)).all()


@settings(max_examples=200)
@given(formula=sdnfs(longest=3), states=trajectories(longest=25))
def test_at_every_prefix_the_weak_view_is_the_semantics(formula, states):
    """Every prefix, from a single state on: the weak view is the semantics, and what is violated stays violated."""
    ticks = len(states)
    prefixes = np.repeat(states[None], ticks, axis=0), np.arange(1, ticks + 1)
    found = satisfied(*prefixes, *to_arrays(formula, VARIABLES))
    assert (found == weak(formula, prefixes)).all()
    assert (np.diff(found.astype(int)) <= 0).all()


@settings(max_examples=200)
@given(primitive=primitives(), batch=batches())
def test_a_primitive_and_its_negation_are_both_satisfied_where_nothing_is_decided(primitive, batch):
    both = [
        satisfied(*batch, *to_arrays(SDNF((SequentialConjunction((one,)),)), VARIABLES))
        for one in (primitive, primitive.negation)
    ]
    values, lengths = batch
    verdicts = primitive.formula.verdict(values, variables=VARIABLES, lengths=lengths)
    assert (both[0] | both[1]).all()
    assert ((both[0] & both[1]) == (verdicts == Verdict.UNKNOWN)).all()


@settings(max_examples=100)
@given(formula=sdnfs(), batch=batches())
def test_each_trajectory_counts_for_itself_whatever_lies_past_its_end(formula, batch):
    values, lengths = batch
    arrays = to_arrays(formula, VARIABLES)
    together = satisfied(np.nan_to_num(values, nan=1.0), lengths, *arrays)
    for states, length, answer in zip(values, lengths, together, strict=True):
        assert satisfied(states[None, :length], np.array([length]), *arrays)[0] == answer
