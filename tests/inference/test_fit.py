"""What a fit says of how good it is: its gap is never less than what an enumeration finds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_certificate import best_value, drafter_of, every_draft, pairs, searches, structure_from
from tests.inference.test_exact import Interrupter, cells, numbers
from tests.inference.worlds import grid_prior
from tickwise.errors import ConfigurationError
from tickwise.inference.bounding import Bounds
from tickwise.inference.draft import Drafter, formula_of, structure_of
from tickwise.inference.exact import ExactSettings
from tickwise.inference.fit import Fit
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_structure
from tickwise.inference.tree import InferenceSettings
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf

QUICK = SwarmSettings(particles=8, iterations=3, restarts=1, stall=2, climbers=1)


def refit(drafter: Drafter, source: SDNF, search: ExactSettings | SwarmSettings, class_weight=None, start=None) -> Fit:
    """Step 2 on a drafter's data."""
    chosen = InferenceSettings(information_weight=drafter.information_weight, class_weight=class_weight)
    rng = np.random.default_rng(0)
    return fit_structure(drafter.data, drafter.prior, drafter.space, source, chosen, search, rng, start=start)


@settings(max_examples=10)
@given(**searches, seconds=st.sampled_from((1e-9, 60.0)))
def test_a_fit_of_two_primitives_knows_what_it_may_have_missed(
    seed, two, kind, weight, class_weight, ragged, seconds
):  # fmt: skip
    data = cells(seed, 2, 6, 10, ragged=ragged)
    space = SearchSpace.grid(2, 5 if kind == "conjunction" else 3)
    drafter = drafter_of(data, grid_prior(2, 5), space, weight, class_weight)
    structure = structure_from(two, kind)
    source = formula_of(next(every_draft(drafter, structure)))
    best = best_value(drafter, structure)
    fit = refit(drafter, source, ExactSettings(certificate=seconds), class_weight)
    assert fit.objective <= best + 1e-12 <= fit.bound + 2e-12
    assert fit.gap >= best - fit.objective - 1e-12
    assert fit.proved == (fit.gap <= 1e-12)
    if seconds > 1:
        assert fit.proved
        assert fit.objective == pytest.approx(best, abs=1e-12)
        swarm = refit(drafter, source, QUICK, class_weight)
        assert swarm.objective <= fit.objective + 1e-12
        assert (swarm.bound, swarm.gap, swarm.proved) == (None, None, False)
    unproved = refit(drafter, source, ExactSettings(), class_weight)
    assert (unproved.bound, unproved.gap, unproved.proved) == (None, None, False)
    assert unproved.objective <= best + 1e-12


@settings(max_examples=15)
@given(seed=st.integers(0, 2**32 - 1), pair=pairs, weight=st.sampled_from((0.0, 0.01)), grid=st.booleans())
def test_a_fit_of_one_primitive_is_always_proved(seed, pair, weight, grid):
    if grid:
        data, space, prior = cells(seed, 2, 6, 12, ragged=True), SearchSpace.grid(2, 5), grid_prior(2, 5)
    else:
        data, prior = numbers(seed, 6, 12, 1), BoxPrior({"x": (-0.5, 4.5)}, 5)
        space = SearchSpace.from_data(data)
    drafter = drafter_of(data, prior, space, weight)
    structure = structure_of([[pair]])
    every = [formula_of(draft) for draft in every_draft(drafter, structure)]
    best = max(drafter.value(draft) for draft in every_draft(drafter, structure))
    fit = refit(drafter, every[0], ExactSettings())
    assert fit.proved
    assert fit.objective == pytest.approx(best, abs=1e-12)
    again = refit(drafter, every[0], ExactSettings(), start=fit.formula)
    assert again == fit


def test_a_start_whose_sides_are_no_levels_may_be_the_best():
    data = numbers(0, 6, 30, 1)
    drafter = drafter_of(data, BoxPrior({"x": (-0.5, 4.5)}, 5), SearchSpace.from_data(data), 0.0)
    coarse = ExactSettings(levels=1)
    fine = refit(drafter, to_sdnf(parse("F[0,1] (x >= 1)")), ExactSettings())
    fit = refit(drafter, fine.formula, coarse, start=fine.formula)
    assert refit(drafter, fine.formula, coarse).objective < fine.objective
    assert fit.formula == fine.formula
    assert fit.bound >= fit.objective


@pytest.mark.parametrize("structure", ["F[0,1] (x >= 1)", "F[0,1] (x >= 1) & F[3,4] (x >= 1)"])
def test_ctrl_c_keeps_the_best_so_far_and_proves_nothing(monkeypatch, structure):
    data = cells(5, 3, 6, 40)
    drafter = drafter_of(data, grid_prior(3, 5), SearchSpace.grid(3, 5))
    source, limits = to_sdnf(parse(structure)), ExactSettings(certificate=60)
    best = refit(drafter, source, limits)
    assert best.proved
    fits = []
    for call in range(1, 14, 3):
        interrupter = Interrupter(call)
        monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes, stop=interrupter: stop(bounds, nodes))
        try:
            fits.append(refit(drafter, source, limits))
        except KeyboardInterrupt:
            assert not fits  # only before there is a formula
    for fit in fits:
        assert fit.objective <= best.objective
        assert fit.bound is None or fit.bound >= best.objective


def test_no_time_below_zero():
    with pytest.raises(ConfigurationError, match=r"exact setting certificate is -1; use 0 seconds or more$"):
        ExactSettings(certificate=-1)
    with pytest.raises(ConfigurationError, match=r"exact setting certificate is nan; use 0 seconds or more$"):
        ExactSettings(certificate=float("nan"))
