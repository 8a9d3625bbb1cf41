from __future__ import annotations

import gymnasium
import numpy as np
import pytest

from tickwise.envs import catalog
from tickwise.envs.catalog import (
    CASE_STUDY_1_SOURCE,
    CASE_STUDY_1_TARGET,
    CASE_STUDY_2_SOURCE,
    CASE_STUDY_2_TARGET,
    EnvironmentSpec,
)
from tickwise.errors import ConfigurationError


def cells(spec: EnvironmentSpec, mask: np.ndarray) -> set[tuple[int, int]]:
    return {spec.world.place(int(state))[:2] for state in np.flatnonzero(mask)}


@pytest.mark.parametrize(
    ("spec", "size", "deadline", "first", "second"),
    [
        (CASE_STUDY_1_SOURCE, 9, 40, {(3, 3), (3, 4)}, {(7, 5), (7, 6), (7, 7)}),
        (CASE_STUDY_1_TARGET, 9, 40, {(5, 6)}, {(i, j) for i in (4, 5, 6) for j in (0, 1)}),
        (CASE_STUDY_2_SOURCE, 5, 25, {(2, 2)}, set()),
        (CASE_STUDY_2_TARGET, 7, 40, {(2, 3)}, {(4, 3)}),
    ],
)
def test_regions_by_hand(
    spec: EnvironmentSpec, size: int, deadline: int, first: set[tuple[int, int]], second: set[tuple[int, int]]
):
    table = spec.task_table()
    assert (spec.world.size, spec.task.deadline, table.horizon) == (size, deadline, deadline)
    assert spec.mdp().n_states == len(table.letter) == size * size * 4
    assert cells(spec, table.letter & 1 > 0) == first
    assert cells(spec, table.letter & 2 > 0) == second


def test_task_states_by_hand():
    # runs of 0..stay, stayed, done
    assert CASE_STUDY_1_SOURCE.task_table().n_states == 5 + 2
    assert CASE_STUDY_1_TARGET.task_table().n_states == 6 + 2
    # 0..8 ticks away, broken
    assert CASE_STUDY_2_SOURCE.task_table().n_states == 10


@pytest.mark.parametrize(
    ("spec", "greens"),
    [
        (CASE_STUDY_2_SOURCE, {(0, 2), (4, 2)}),
        (CASE_STUDY_2_TARGET, {(2, 1), (2, 5), (4, 1), (4, 5)}),
    ],
)
def test_greens_by_hand(spec: EnvironmentSpec, greens: set[tuple[int, int]]):
    table = spec.task_table()
    assert cells(spec, table.reward[0] == 100) == greens
    assert set(np.unique(table.reward[0])) == {0, 100}
    assert (table.reward[table.terminated] == -800).all()


def test_the_paper_does_not_leave_the_dynamics_open():
    for spec in catalog.CATALOG.values():
        assert (spec.world.slip, spec.world.turn_failure) == (0.04, 0.03)


def test_ids_are_registered_once_without_warnings():
    catalog.register_all()
    before = dict(gymnasium.registry)
    catalog.register_all()
    assert gymnasium.registry == before
    for name in ("CaseStudy1Source", "CaseStudy1Target", "CaseStudy2Source", "CaseStudy2Target"):
        assert {f"{name}-v0", f"tickwise/{name}-v0"} <= gymnasium.registry.keys()


def test_an_unknown_name_is_refused():
    with pytest.raises(ConfigurationError, match="no environment 'CaseStudy3'; there are CaseStudy1Source, "):
        catalog.find("CaseStudy3")
