"""Formulas that grow: planted rules are found, at the smallest size that satisfies."""

from __future__ import annotations

import numpy as np
import pytest

from tests.inference.test_exact import Interrupter
from tests.inference.worlds import grid_prior, weakly
from tickwise.errors import DataError
from tickwise.inference.bounding import Bounds
from tickwise.inference.exact import ExactSettings
from tickwise.inference.growth import infer_jointly
from tickwise.inference.information import information_gain
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings, classification_rate
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import to_sdnf
from tickwise.logic.structure import structure

TICKS = 10
PRIOR = BoxPrior({"x": (0, 10), "y": (0, 10)}, TICKS)


def planted(rule: str, seed: int = 0, count: int = 40, pool: int = 20_000) -> LabelledTrajectories:
    """As many draws that satisfy a rule as that do not, without noise."""
    values = np.random.default_rng(seed).integers(0, 11, (pool, TICKS + 1, 2)).astype(float)
    raw = LabelledTrajectories.from_arrays(values, np.resize([1, -1], pool), ("x", "y"))
    good = weakly(to_sdnf(parse(rule)), raw)
    chosen = np.concatenate([np.flatnonzero(good)[:count], np.flatnonzero(~good)[:count]])
    return LabelledTrajectories.from_arrays(values[chosen], np.where(good[chosen], 1, -1), ("x", "y"))


def infer(data: LabelledTrajectories, **constants):
    space = SearchSpace.from_data(data)
    return infer_jointly(data, PRIOR, space, InferenceSettings(rate=1.0, **constants), ExactSettings(levels=16))


SINGLE = "G[2,4] (x >= 6)"
CONJUNCTION = "G[0,3] (x >= 5) & G[6,9] (y <= 5)"
DISJUNCTION = "G[0,4] (x >= 5) | G[5,9] (y <= 4)"


@pytest.mark.parametrize(
    ("rule", "size", "seed"), [(SINGLE, 1, 0), (CONJUNCTION, 2, 0), (DISJUNCTION, 2, 1), (DISJUNCTION, 2, 2)]
)
def test_planted_rules_are_found_at_their_size(rule, size, seed):
    data = planted(rule, seed)  # the last is first met by a conjunction that is too long, beside the second disjunct
    fit = infer(data)
    assert fit.rate == classification_rate(fit.formula, data) == 1
    assert fit.satisfying
    assert fit.size == size
    assert fit.gain == pytest.approx(information_gain(fit.formula, PRIOR), abs=1e-9)
    assert fit.objective == pytest.approx(fit.rate + 0.01 * fit.gain)
    rows = structure(fit.formula)
    assert len(rows) == (2 if rule == DISJUNCTION else 1)


def test_it_stops_at_the_size_constraint():
    fit = infer(planted(CONJUNCTION), size=1)
    assert fit.size == 1
    assert fit.rate < 1
    assert not fit.satisfying


def test_a_lower_rate_is_met_by_a_smaller_formula():
    data = planted(CONJUNCTION)
    single = infer(data, size=1)
    space, chosen = SearchSpace.from_data(data), InferenceSettings(rate=single.rate - 0.01)
    fit = infer_jointly(data, PRIOR, space, chosen, ExactSettings(levels=16))
    assert fit.size == 1
    assert fit.satisfying


@pytest.mark.parametrize(("kept", "missing"), [(1, -1), (-1, 1)])
def test_a_label_that_is_missing(kept, missing):
    data = planted(SINGLE)
    with pytest.raises(DataError, match=f"no trajectory has label {missing}"):
        infer(data.select(data.labels == kept))


def test_nothing_to_tell_apart():
    values = np.full((12, 5, 2), 3.0)
    data = LabelledTrajectories.from_arrays(values, [1] * 6 + [-1] * 6, ("x", "y"))
    space, chosen = SearchSpace.grid(5, 4), InferenceSettings()
    with pytest.raises(DataError, match=r"no formula tells the labels apart better than a trivial one; use [^\n]+$"):
        infer_jointly(data, grid_prior(5, 4), space, chosen, ExactSettings())


@pytest.mark.parametrize("call", [1, 3, 20, 60, 150])
def test_ctrl_c_ends_the_growth_with_the_best_so_far(monkeypatch, call):
    data = planted(CONJUNCTION)
    interrupter = Interrupter(call)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    try:
        fit = infer(data)
    except KeyboardInterrupt:
        assert call < 60  # there is no formula yet
        return
    assert interrupter.left <= 0
    assert call > 1
    assert 1 <= fit.size <= 2
    assert fit.rate == classification_rate(fit.formula, data)
