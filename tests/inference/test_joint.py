"""Formulas of a given structure, all primitives together: valid, never above the best of all, rarely below it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_draft import any_draft, drafters, valid
from tests.inference.test_exact import Interrupter
from tests.inference.worlds import errand_data, grid_prior
from tickwise.inference.bounding import Bounds
from tickwise.inference.draft import Choice, Drafter, formula_of, structure_of
from tickwise.inference.exact import ExactSettings
from tickwise.inference.joint import fit_jointly
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_structure
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.sdnf import Operator

PLACES = st.builds(lambda operator, flag: Choice((operator,), (flag,)), st.sampled_from(Operator), st.booleans())
STRUCTURES = st.lists(st.lists(PLACES, min_size=1, max_size=3).map(tuple), min_size=1, max_size=2).map(tuple)


@settings(max_examples=12)
@given(drafter=drafters(9, 16), structure=STRUCTURES, seed=st.integers(0, 2**32 - 1))
def test_a_fit_is_valid_and_no_worse_than_its_start(drafter, structure, seed):
    start = any_draft(drafter, structure, np.random.default_rng(seed))
    found = fit_jointly(drafter, structure, start)
    assert (found is None) == (start is None)
    if found is not None:
        valid(drafter, found, structure)
        assert drafter.value(found) >= drafter.value(start) - 1e-9
        assert fit_jointly(drafter, structure, start) == found


G, Y = (1, 2, 1, 3), (3, 4, 2, 4)
STAY_THEN_REACH = structure_of([[(Operator.EVENTUALLY_ALWAYS, False), (Operator.EVENTUALLY, False)]])


def errands(seed: int) -> Drafter:
    data = errand_data(seed, 5, 20, G, 3, Y, 20, 40)
    return Drafter(data, np.ones(60), grid_prior(5, 20), SearchSpace.grid(5, 20), 0.01, 0.0, ExactSettings())


@pytest.mark.parametrize("seed", range(3))
def test_it_finds_a_rule_that_no_primitive_says_alone(seed):
    drafter = errands(seed)
    found = fit_jointly(drafter, STAY_THEN_REACH)
    assert drafter.rate(found) == 1
    quick = SwarmSettings(particles=30, iterations=40, restarts=1, stall=10)
    swarm = fit_structure(
        drafter.data, drafter.prior, drafter.space, (("FG", "F"),), InferenceSettings(), quick,
        np.random.default_rng(seed),
    )  # fmt: skip
    assert drafter.value(found) >= swarm.objective - 1e-12


@pytest.mark.parametrize("call", [2, 9, 30, 60])
def test_ctrl_c_ends_a_fit_with_the_best_so_far(monkeypatch, call):
    drafter = errands(0)
    interrupter = Interrupter(call)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    try:
        found = fit_jointly(drafter, STAY_THEN_REACH)
    except KeyboardInterrupt:
        assert call < 30
        return
    assert interrupter.left <= 0
    assert drafter.interrupted
    valid(drafter, found, STAY_THEN_REACH)
    assert formula_of(found).size == 2
