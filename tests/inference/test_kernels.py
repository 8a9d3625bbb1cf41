import numpy as np
from hypothesis import given, settings

from tests.strategies import VARIABLES, batches, primitives, sdnfs
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
