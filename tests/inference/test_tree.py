import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.inference.test_exact import Interrupter
from tests.inference.worlds import errand_data, grid_prior, ragged_walks, verdicts, weakly
from tests.strategies import sdnfs
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.bounding import Bounds
from tickwise.inference.exact import ExactSettings
from tickwise.inference.information import information_gain
from tickwise.inference.objective import Objective
from tickwise.inference.prior import BoxPrior
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import (
    STRUCTURES,
    DecisionTree,
    InferenceSettings,
    classification_rate,
    infer_tree,
    is_satisfying,
    pruned,
)
from tickwise.logic.parse import parse
from tickwise.logic.sdnf import SDNF, Operator, SequentialConjunction, to_sdnf
from tickwise.logic.syntax import Verdict

FAST = SwarmSettings(particles=30, iterations=40, restarts=2, stall=10)


def binary(rows, labels):
    """Trajectories of one variable that is 0.5 or 1.5."""
    return LabelledTrajectories.from_arrays(np.array(rows, dtype=float)[..., None] + 0.5, labels, ("x",))


def grow(data, depth=2, rate=0.95, horizon=None, **more):
    space = SearchSpace.grid(2, data.horizon if horizon is None else horizon, ("x",))
    prior = BoxPrior({"x": (0, 2)}, data.horizon)
    settings = InferenceSettings(depth=depth, rate=rate, **more)
    return infer_tree(data, prior, space, settings, FAST, np.random.default_rng(1))


def primitive(text):
    return to_sdnf(parse(text)).disjuncts[0].primitives[0]


def test_one_primitive_is_enough():
    # label 1 iff x is high at tick 1 and at tick 2: □[1,2] is exact, and no exact formula is rarer
    data = binary([[0, 1, 1], [1, 1, 1], [0, 0, 1], [1, 1, 0], [1, 0, 0]], [1, 1, -1, -1, -1])
    tree = grow(data)
    assert str(tree.formula) == "G[1,2] (1 <= x <= 2)"
    assert (tree.positives, tree.negatives, tree.rate) == (2, 3, 1.0)
    assert tree.gain == pytest.approx(np.log(4) / 2)  # P = 1/4, L = 2
    assert tree.objective == pytest.approx(1 + 0.01 * np.log(4) / 2)
    for child, label, step in ((tree.left, 1, tree.primitive), (tree.right, -1, tree.primitive.negation)):
        assert (child.leaf, child.stop, child.label, child.path, child.depth) == (True, "I", label, (step,), 1)


def test_two_stages_make_a_conjunction_in_the_order_of_time():
    # label 1 iff high throughout 0..1 and throughout 3..4: one primitive cannot say it
    rows = [[a, b, c, d, e] for a in (0, 1) for b in (0, 1) for c in (0, 1) for d in (0, 1) for e in (0, 1)]
    labels = [1 if r[0] and r[1] and r[3] and r[4] else -1 for r in rows]
    tree = grow(binary(rows, labels), rate=1.0, class_weight="balanced")
    assert classification_rate(tree.formula, binary(rows, labels)) == 1
    assert {str(p) for p in tree.formula.disjuncts[0].primitives} == {"G[0,1] (1 <= x <= 2)", "G[3,4] (1 <= x <= 2)"}
    assert tree.left.stop is None
    assert tree.left.left.stop == "I"
    assert tree.right.stop == "I"


def test_depth_ends_the_tree():
    rng = np.random.default_rng(0)
    data = binary(rng.integers(0, 2, (40, 12)), np.where(rng.random(40) < 0.5, 1, -1))
    tree = grow(data, depth=1)
    assert {tree.left.stop, tree.right.stop} <= {"I", "II"}
    assert all(node.depth <= 1 for node in tree.nodes())
    for node in (tree.left, tree.right):
        assert node.label == (1 if node.positives > node.negatives else -1)
    assert tree.left.positives + tree.right.positives == tree.positives


def test_no_room_ends_the_tree():
    # two ticks hold one window; after it Υ is empty. Row 3 contradicts row 0, so no leaf is pure
    data = binary([[1, 1], [1, 1], [0, 1], [1, 1], [0, 0], [0, 0]], [1, 1, -1, -1, -1, -1])
    tree = grow(data, depth=5, rate=1.0)
    assert str(tree.formula) == "G[0,1] (1 <= x <= 2)"
    assert (tree.left.stop, tree.left.label, tree.left.positives, tree.left.negatives) == ("III", 1, 2, 1)
    assert (tree.right.stop, tree.right.label) == ("I", -1)


def test_exactly_half_is_label_minus_one():
    tree = DecisionTree((), 0, 1, 1, "II", -1)
    assert tree.formula is None
    data = binary([[1, 1], [1, 1]], [1, -1])
    grown = grow(data, rate=1.0)
    assert [node.label for node in grown.nodes() if node.leaf] == [-1, -1]
    assert grown.formula is None
    assert not is_satisfying(None, data, InferenceSettings())
    assert classification_rate(None, data) == 0.5


def test_negated_primitives_come_from_the_right_branch_by_duality():
    first, second = primitive("F[0,3] (x <= 1)"), primitive("G[5,6] (x >= 2)")
    leaf = DecisionTree((first.negation, second), 2, 3, 0, "I", 1)
    other = DecisionTree((first.negation, second.negation), 2, 0, 3, "I", -1)
    right = DecisionTree((first.negation,), 1, 3, 3, None, None, second, 1, 1, 0, leaf, other)
    left = DecisionTree((first,), 1, 0, 4, "I", -1)
    root = DecisionTree((), 0, 3, 7, None, None, first, 1, 1, 0, left, right)
    (path,) = root.formula.disjuncts
    assert path.primitives == (first.negation, second)
    assert path.primitives[0].operator is Operator.ALWAYS
    assert [node.depth for node in root.nodes()] == [0, 1, 1, 2, 2]


def test_paths_are_put_in_the_order_of_start_effect_times():
    late, early = primitive("F[5,6] (x <= 1)"), primitive("G[1,2] (x >= 2)")
    leaf = DecisionTree((late, early), 2, 3, 0, "I", 1)
    assert leaf.path_formula.primitives == (early, late)


def test_a_split_between_leaves_of_label_one_is_left_out():
    first, second = primitive("F[0,3] (x <= 1)"), primitive("G[5,6] (x >= 2)")
    yes = DecisionTree((first, second), 2, 3, 0, "I", 1)
    also = DecisionTree((first, second.negation), 2, 2, 1, "II", 1)
    left = DecisionTree((first,), 1, 5, 1, None, None, second, 1, 1, 0, yes, also)
    root = DecisionTree(
        (), 0, 5, 9, None, None, first, 1, 1, 0, left, DecisionTree((first.negation,), 1, 0, 8, "I", -1)
    )
    assert [d.primitives for d in root.formula.disjuncts] == [(first,)]


def test_the_empty_side_of_a_split_is_a_leaf():
    data = binary([[1, 1, 1], [1, 1, 1], [1, 1, 1]], [1, 1, -1])
    tree = grow(data, rate=0.9)
    assert {tree.left.positives + tree.left.negatives, tree.right.positives + tree.right.negatives} == {0, 3}


def test_every_structure_is_searched():
    assert len(set(STRUCTURES)) == 8


SMALL = errand_data(1, 3, 8, (0, 1, 0, 2), 2, (1, 3, 1, 3), 8, 25)
SMALL_SPACE, SMALL_PRIOR = SearchSpace.grid(3, 8), grid_prior(3, 8)


@pytest.mark.parametrize("seed", range(3))
def test_the_swarm_finds_the_optimum_of_a_small_space(seed):
    best = -np.inf
    for pair in STRUCTURES:
        shape = shape_of([[pair]])
        objective = Objective(SMALL, np.ones(len(SMALL)), SMALL_PRIOR, SMALL_SPACE, shape, SMALL_SPACE.gaps(), 0.01)
        positions = np.array(list(every_position(pair[0].nested)), dtype=float)
        best = max(best, objective(positions, np.full(len(positions), -np.inf)).max())
    settings = InferenceSettings(depth=1, nesting_cost=0.0)
    tree = infer_tree(SMALL, SMALL_PRIOR, SMALL_SPACE, settings, SwarmSettings(), np.random.default_rng(seed))
    assert tree.objective == best


def every_position(nested):
    sides = [(a, b) for a in range(4) for b in range(a + 1, 4)]
    for duration in range(1, 8) if nested else (0,):
        for start in range(9):
            for end in range(start + 1, 9 - duration):
                for x in sides:
                    for y in sides:
                        yield (*x, *y, start, end, duration) if nested else (*x, *y, start, end)


def test_a_nested_structure_has_to_earn_its_additional_parameter():
    # both classify alike here; the nested one is a little less probable
    plain, free = (
        infer_tree(SMALL, SMALL_PRIOR, SMALL_SPACE, settings, SwarmSettings(), np.random.default_rng(0))
        for settings in (InferenceSettings(depth=1), InferenceSettings(depth=1, nesting_cost=0.0))
    )
    assert (plain.primitive.operator.nested, free.primitive.operator.nested) == (False, True)
    assert plain.rate == free.rate
    assert plain.objective < free.objective


QUICK = SwarmSettings(particles=8, iterations=4, restarts=1, stall=2, climbers=1)


@settings(max_examples=25)
@given(
    rule=st.none() | sdnfs(most=2, disjuncts=2, longest=3),
    seed=st.integers(0, 2**32 - 1),
    horizon=st.integers(5, 12),
    class_weight=st.sampled_from((None, "balanced")),
)
def test_a_tree_of_ragged_trajectories_says_what_the_semantics_says(rule, seed, horizon, class_weight):
    """Algorithm 1 line by line; effect windows may reach beyond the end of all trajectories, or not use their last."""
    data = ragged_walks(seed, 3, 9, 30, rule)
    chosen = InferenceSettings(rate=0.9, depth=3, class_weight=class_weight)
    space, prior = SearchSpace.grid(3, horizon), grid_prior(3, 9)
    tree = infer_tree(data, prior, space, chosen, QUICK, np.random.default_rng(seed))
    undecided = np.zeros(len(data), dtype=bool)
    reached = np.zeros(len(data), dtype=int)
    waiting = [(tree, np.ones(len(data), dtype=bool))]
    while waiting:
        node, here = waiting.pop()
        assert (node.positives, node.negatives) == tuple((data.labels[here] == label).sum() for label in (1, -1))
        assert node.path_formula is None or node.path_formula.primitives[-1].end <= horizon
        if node.leaf:
            reached[here] = node.label
            continue
        alone = SDNF((SequentialConjunction((node.primitive,)),))
        said = verdicts(alone, data)
        undecided |= said == Verdict.UNKNOWN
        part = data.select(here)
        assert all(node.primitive.end < p.start or p.end < node.primitive.start for p in node.path)  # Υ_z
        if class_weight is None:
            assert node.rate == pytest.approx(classification_rate(alone, part))
        assert node.gain == pytest.approx(information_gain(alone, prior), abs=1e-12)
        assert node.left.path == (*node.path, node.primitive)
        assert node.right.path == (*node.path, node.primitive.negation)
        waiting += [(node.left, here & (said != Verdict.FALSE)), (node.right, here & (said == Verdict.FALSE))]
    if tree.formula is None:
        assert (reached == -1).all()
        return
    satisfied = weakly(tree.formula, data)
    assert satisfied[reached == 1].all()
    # what ends before a primitive is decided is on both sides of it; nothing else is
    assert (satisfied == (reached == 1))[~undecided].all()


def test_equal_seeds_give_equal_trees():
    data = errand_data(5, 4, 9, (0, 1, 0, 2), 2, (2, 4, 2, 4), 6, 12)
    space, prior = SearchSpace.grid(4, 9), grid_prior(4, 9)
    trees = [infer_tree(data, prior, space, InferenceSettings(), FAST, np.random.default_rng(7)) for _ in range(2)]
    assert trees[0] == trees[1]


def test_size_and_rate_make_a_formula_satisfying():
    data = binary([[1, 1, 1], [0, 0, 0], [1, 0, 0]], [1, -1, -1])
    formula = to_sdnf(parse("G[0,1] (x >= 1)"))
    assert classification_rate(formula, data) == 1
    assert classification_rate(formula.formula, data) == 1
    assert is_satisfying(formula, data, InferenceSettings(size=1))
    both = to_sdnf(parse("G[0,1] (x >= 1) | G[0,1] (x >= 2)"))
    assert not is_satisfying(both, data, InferenceSettings(size=1))
    assert not is_satisfying(to_sdnf(parse("F[0,1] (x >= 1)")), data, InferenceSettings())


def test_data_that_has_nothing_to_tell_apart():
    with pytest.raises(DataError, match="no trajectory has label -1"):
        grow(binary([[1, 1], [0, 1]], [1, 1]))
    with pytest.raises(DataError, match="already"):
        grow(binary([[1, 1]] * 20 + [[0, 0]], [1] * 20 + [-1]))
    with pytest.raises(ConfigurationError, match="the space has variables x, y, the data x"):
        infer_tree(
            binary([[1, 1], [0, 1]], [1, -1]), grid_prior(2, 1), SearchSpace.grid(2, 1), InferenceSettings(), FAST,
            np.random.default_rng(0),
        )  # fmt: skip


@pytest.mark.parametrize(
    "wrong", [{"size": 0}, {"depth": 0}, {"rate": 0.0}, {"rate": 1.1}, {"information_weight": -1.0}]
)
def test_wrong_settings(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        InferenceSettings(**wrong)


def test_a_disjunct_that_is_not_needed_is_pruned():
    # label 1 iff high at tick 1; the second disjunct says nothing of any positive, the third is one positive's alone
    data = binary([[0, 1, 0], [0, 1, 1], [1, 1, 0], [0, 0, 1], [1, 0, 0], [0, 0, 0]], [1, 1, 1, -1, -1, -1])
    needed, idle, other = "F[1,1] (x >= 1)", "G[0,2] (x >= 1)", "G[1,2] (x >= 1)"
    settings = InferenceSettings(rate=1.0)
    whole = to_sdnf(parse(f"{idle} | {needed} | {other}"))
    assert str(pruned(whole, data, settings)) == needed
    assert pruned(to_sdnf(parse(needed)), data, settings) == to_sdnf(parse(needed))
    # what is not satisfying stays as it is
    wrong = to_sdnf(parse(f"{idle} | {other}"))
    assert pruned(wrong, data, settings) == wrong


@given(sdnfs(longest=2), st.integers(0, 1_000))
@settings(max_examples=40, deadline=None)
def test_pruning_keeps_a_formula_satisfying_and_leaves_no_disjunct_to_spare(rule: SDNF, seed: int):
    data = ragged_walks(seed, 4, 6, 30, rule)
    constraints = InferenceSettings(size=20, rate=0.9)
    found = pruned(rule, data, constraints)
    assert set(found.disjuncts) <= set(rule.disjuncts)
    assert is_satisfying(found, data, constraints) == is_satisfying(rule, data, constraints)
    if is_satisfying(found, data, constraints) and found != rule:
        assert found.size < rule.size


def test_an_exact_tree_proves_every_node():
    settings = InferenceSettings(depth=2, rate=1.0)
    tree = infer_tree(SMALL, SMALL_PRIOR, SMALL_SPACE, settings, ExactSettings(), np.random.default_rng(0))
    swarm = infer_tree(SMALL, SMALL_PRIOR, SMALL_SPACE, settings, SwarmSettings(), np.random.default_rng(0))
    assert [node.gap for node in tree.nodes() if not node.leaf] == [0] * sum(not node.leaf for node in tree.nodes())
    assert all(node.gap is None for node in (*swarm.nodes(), *(node for node in tree.nodes() if node.leaf)))
    nested = tree.primitive.operator.nested, swarm.primitive.operator.nested
    cost = settings.nesting_penalty(len(SMALL), SMALL_PRIOR.horizon)
    assert tree.objective - cost * nested[0] >= swarm.objective - cost * nested[1] - 1e-12
    again = infer_tree(SMALL, SMALL_PRIOR, SMALL_SPACE, settings, ExactSettings(), np.random.default_rng(1))
    assert again == tree  # nothing is drawn


def test_an_exact_search_that_is_stopped_leaves_a_gap():
    rng = np.random.default_rng(3)
    labels = np.where(rng.random(len(SMALL)) < 0.5, 1, -1)
    noise = LabelledTrajectories(SMALL.values, SMALL.lengths, labels, SMALL.variables, SMALL.ids)
    settings, none = InferenceSettings(depth=1, rate=1.0), np.random.default_rng(0)
    stopped = infer_tree(noise, SMALL_PRIOR, SMALL_SPACE, settings, ExactSettings(nodes=1), none)
    best = infer_tree(noise, SMALL_PRIOR, SMALL_SPACE, settings, ExactSettings(), none)
    assert best.gap == 0
    cost = settings.nesting_penalty(len(noise), SMALL_PRIOR.horizon)
    missed = best.objective - stopped.objective
    missed -= cost * (best.primitive.operator.nested - stopped.primitive.operator.nested)
    assert stopped.gap > 0
    assert stopped.gap >= missed - 1e-12


@pytest.mark.parametrize("call", [1, 2, 3, 6])
def test_ctrl_c_ends_an_exact_tree_with_leaves(monkeypatch, call):
    interrupter = Interrupter(call)
    monkeypatch.setattr(Bounds, "__call__", lambda bounds, nodes: interrupter(bounds, nodes))
    settings, rng = InferenceSettings(depth=3, rate=1.0, class_weight="balanced"), np.random.default_rng(0)
    if call == 1:
        with pytest.raises(KeyboardInterrupt):
            infer_tree(SMALL, SMALL_PRIOR, SMALL_SPACE, settings, ExactSettings(), rng)
        return
    tree = infer_tree(SMALL, SMALL_PRIOR, SMALL_SPACE, settings, ExactSettings(), rng)
    assert interrupter.left == 0
    assert tree.gap > 0
    assert {child.stop for child in (tree.left, tree.right)} <= {"interrupted", "I"}
    assert "interrupted" in {child.stop for child in (tree.left, tree.right)}
    assert all(child.leaf for child in (tree.left, tree.right))
