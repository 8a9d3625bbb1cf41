from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_exact import Interrupter
from tests.strategies import VARIABLES, random_trajectories, sdnfs
from tickwise.automata.run import letters_of
from tickwise.errors import NotTransferableError
from tickwise.inference.bounding import Bounds
from tickwise.inference.exact import ExactSettings
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.template import fit_transferable
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import DecisionTree, InferenceSettings, classification_rate, is_satisfying
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.structure import structurally_equivalent, structurally_transferable
from tickwise.logic.syntax import Verdict
from tickwise.transfer.hypothesis import (
    PARTS,
    Task,
    require_transferable,
    source_formula,
    tick_tables,
    transfer_structure,
)

TICKS = 12
SWARM = SwarmSettings(particles=30, iterations=40, restarts=1)


def task(rng: np.random.Generator, rule: str, n: int = 60, wanted: int = 25, shortest: int = TICKS + 1) -> Task:
    """Random walks on a line of ten cells, some cut short, labelled by a rule's weak view; ``wanted`` of each label."""
    phi = parse(rule)
    found: dict[int, list[np.ndarray]] = {1: [], -1: []}
    while min(map(len, found.values())) < wanted:
        steps = rng.integers(-2, 3, size=(n, TICKS))
        start = rng.integers(0, 10, size=(n, 1))
        walks = np.clip(np.concatenate([start, start + np.cumsum(steps, axis=1)], axis=1), 0, 9) + 0.5
        for walk, length in zip(walks[..., None], rng.integers(shortest, TICKS + 2, size=n), strict=True):
            found[-1 if phi.verdict(walk[:length]) is Verdict.FALSE else 1].append(walk[:length])
    X = [walk for label in (1, -1) for walk in found[label][:wanted]]
    y = [label for label in (1, -1) for _ in range(wanted)]
    data = LabelledTrajectories.from_arrays(X, np.array(y), ("x",))
    return Task(data, BoxPrior({"x": (0.0, 10.0)}, TICKS), SearchSpace.grid(10, TICKS, ("x",)))


def outcome(source: Task, target: Task, settings: InferenceSettings, done: Callable[[str], None] | None = None):
    rngs = np.random.default_rng(1), np.random.default_rng(2)
    return transfer_structure(source, target, settings, SWARM, *rngs, done)


def test_the_target_may_have_settings_of_its_own():
    rng = np.random.default_rng(0)
    tasks = task(rng, "F[1,10] (7 <= x <= 8)"), task(rng, "G[2,6] (1 <= x <= 6)")
    found = {}
    for rate in (0.6, 1.0):
        rngs = np.random.default_rng(1), np.random.default_rng(2)
        settings, theirs = InferenceSettings(size=1, depth=1), InferenceSettings(size=1, depth=1, rate=rate)
        found[rate] = transfer_structure(*tasks, settings, SWARM, *rngs, target_settings=theirs)
    assert found[0.6].transferable
    assert not found[1.0].transferable
    assert found[0.6].source == found[1.0].source
    assert "below the 100.0% that are asked for" in found[1.0].reason


def test_labels_that_no_formula_tells_apart_are_not_transferable():
    walks = np.tile(np.linspace(0.5, 9.5, TICKS + 1)[None, :, None], (40, 1, 1))
    data = LabelledTrajectories.from_arrays(walks, np.array([1] * 20 + [-1] * 20), ("x",))
    alike = Task(data, BoxPrior({"x": (0.0, 10.0)}, TICKS), SearchSpace.grid(10, TICKS, ("x",)))
    rngs = np.random.default_rng(1), np.random.default_rng(2)
    found = transfer_structure(alike, alike, InferenceSettings(size=2), ExactSettings(joint=True), *rngs)
    assert (found.tree, found.source_satisfying, found.fit) == (None, False, None)
    assert not found.transferable


def test_similar_tasks_are_identified_as_transferable():
    rng = np.random.default_rng(0)
    settings = InferenceSettings(size=2, depth=1)
    steps: list[str] = []
    found = outcome(task(rng, "F[1,10] (7 <= x <= 8)"), task(rng, "F[2,11] (1 <= x <= 2)"), settings, steps.append)
    assert found.transferable, found.reason
    assert tuple(steps) == PARTS
    source, target = require_transferable(found)
    assert structurally_transferable(target, source)
    assert found.source_satisfying
    assert found.fit is not None
    assert found.fit.attempts[-1].satisfying


@pytest.mark.parametrize(
    ("source", "target"),
    [
        ("F[1,8] G[0,2] (6 <= x <= 9)", "F[2,9] G[0,1] (1 <= x <= 3)"),
        ("G[1,9] F[0,2] (4 <= x <= 9)", "G[0,8] F[0,3] (0 <= x <= 5)"),
        ("!F[2,6] (4 <= x <= 6)", "!F[3,9] (0 <= x <= 1)"),
    ],
)
def test_similar_tasks_whose_episodes_end_at_any_tick_are_transferable(source: str, target: str):
    rng = np.random.default_rng(5)
    tasks = [task(rng, rule, shortest=4) for rule in (source, target)]
    found = outcome(*tasks, InferenceSettings(size=2, depth=1, rate=0.9))
    assert found.transferable, found.reason
    for formula, data in zip(require_transferable(found), (one.data for one in tasks), strict=True):
        assert classification_rate(formula, data) >= 0.9


def test_what_the_tree_chose_too_early_is_mended_by_a_joint_fit():
    rng = np.random.default_rng(7)
    rule = "F[1,4] (7 <= x <= 8) & F[6,11] (1 <= x <= 4)"
    source, settings = task(rng, rule), InferenceSettings(size=2, rate=0.95)
    greedy = to_sdnf(parse("F[1,9] (6 <= x <= 9) & F[10,11] (1 <= x <= 4)")).disjuncts[0]
    tree = DecisionTree(greedy.primitives, 2, 20, 0, "I", 1)
    assert not is_satisfying(tree.formula, source.data, settings)
    found = source_formula(tree, source, settings, SWARM, rng)
    assert found is not None
    assert is_satisfying(found, source.data, settings)
    assert structurally_equivalent(found, SDNF((greedy,)))
    # nothing of this structure says that the labels are drawn by lot
    labels = np.resize([1, -1], len(source.data)).astype(np.int8)
    lot = LabelledTrajectories(source.data.values, source.data.lengths, labels, ("x",), source.data.ids)
    assert source_formula(tree, Task(lot, source.prior, source.space), settings, SWARM, rng) == tree.formula


def test_tasks_that_are_not_similar_are_refused_with_the_reason():
    rng = np.random.default_rng(3)
    # a size of one leaves room for a single primitive, and the target's rule is no ◇
    settings = InferenceSettings(size=1, depth=1, rate=1.0)
    found = outcome(task(rng, "F[1,10] (7 <= x <= 8)"), task(rng, "G[3,5] (2 <= x <= 8) & F[9,12] (x >= 7)"), settings)
    assert found.source is not None
    assert not found.transferable
    assert found.target is None
    assert "not identified" in found.reason
    with pytest.raises(NotTransferableError, match="not identified"):
        require_transferable(found)


def test_a_source_without_a_satisfying_formula_ends_at_step_1():
    rng = np.random.default_rng(4)
    noise = task(rng, "F[1,10] (7 <= x <= 8)")
    labels = rng.permuted(noise.data.labels)
    data = LabelledTrajectories(noise.data.values, noise.data.lengths, labels, noise.data.variables, noise.data.ids)
    steps: list[str] = []
    found = outcome(Task(data, noise.prior, noise.space), noise, InferenceSettings(depth=1, rate=0.99), steps.append)
    assert not found.transferable
    assert found.fit is None
    assert steps == ["tree", "source"]
    assert "source" in found.reason


def test_tick_tables_are_one_for_each_disjunct_and_may_keep_full_valuations():
    formula = to_sdnf(parse("(F[0,3] G[0,2] (x >= 1)) | (F[1,4] G[0,2] (x <= 0))"))
    reduced, full = tick_tables(formula, 10), tick_tables(formula, 10, reduce=False)
    assert len(reduced) == len(full) == 2
    assert all(len(few) < len(many) for few, many in zip(reduced, full, strict=True))


@settings(max_examples=100)
@given(sdnfs(most=2), st.integers(1, 9), st.booleans(), st.integers(0, 2**32 - 1))
def test_tick_tables_say_what_the_semantics_says_also_where_a_formula_looks_beyond_the_episode(
    formula: SDNF, horizon: int, reduce: bool, seed: int
):
    X = random_trajectories(seed, 4, horizon + 1, len(VARIABLES))
    tables = tick_tables(formula, horizon, reduce=reduce)
    for table, disjunct in zip(tables, formula.disjuncts, strict=True):
        expected = disjunct.formula.verdict(X, variables=VARIABLES)
        np.testing.assert_array_equal(table.verdicts(letters_of(table.automaton, X, variables=VARIABLES)), expected)


@pytest.mark.parametrize("joint", [False, True])
@pytest.mark.parametrize("call", [1, 2, 4, 8, 12])
def test_ctrl_c_leaves_no_hypothesis_on_half_a_search(monkeypatch, joint, call):
    rng = np.random.default_rng(0)
    tasks = task(rng, "F[1,10] (7 <= x <= 8)"), task(rng, "F[2,9] (1 <= x <= 3)")
    interrupter = Interrupter(call)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    rngs = np.random.default_rng(1), np.random.default_rng(2)
    with pytest.raises(KeyboardInterrupt):
        transfer_structure(*tasks, InferenceSettings(), ExactSettings(joint=joint), *rngs)
    assert interrupter.left <= 0


@pytest.mark.parametrize("call", [1, 3, 5, 20])
def test_ctrl_c_leaves_no_fit_to_transfer(monkeypatch, call):
    target = task(np.random.default_rng(0), "G[0,3] (x <= 6) & F[5,9] (7 <= x <= 8)")
    source = to_sdnf(parse("G[0,2] (x <= 5) & F[4,9] (6 <= x <= 8)"))
    interrupter = Interrupter(call)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    with pytest.raises(KeyboardInterrupt):
        fit_transferable(
            target.data, target.prior, target.space, source, InferenceSettings(), ExactSettings(),
            np.random.default_rng(0),
        )  # fmt: skip
    assert interrupter.left <= 0
