"""Algorithm 1: information-guided inference of a formula as a decision tree of primitives (Section III-C)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.exact import ExactProblem, ExactResult, ExactSettings, exact_search, worth_of
from tickwise.inference.levels import Coded, Levels, code
from tickwise.inference.objective import ClassWeight, Objective, formula_signature, trajectory_weights
from tickwise.inference.prior import Prior
from tickwise.inference.space import Gaps, SearchSpace, shape_of
from tickwise.inference.starts import sampled_starts
from tickwise.inference.swarm import SwarmSettings, maximise
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Formula, Verdict

STRUCTURES: tuple[tuple[Operator, bool], ...] = tuple(
    (operator, complemented) for complemented in (False, True) for operator in Operator
)
"""The primitive structures 𝒫 and, by duality, their negations: (operator, whether the box is complemented)."""


Search = SwarmSettings | ExactSettings
"""How parameters are searched: the paper's particle swarm, or exactly."""


@dataclass(frozen=True, slots=True)
class InferenceSettings:
    """The constants of Problem 1 and Algorithm 1.

    Attributes:
        size: ϱ_th, the most primitives of a satisfying formula.
        rate: ζ, the least classification rate of a satisfying formula, and the purity that ends a branch.
        information_weight: λ, the weight of the information gain.
        depth: h_max, the depth at which every node is a leaf.
        class_weight: Weights in the classification rate: None, ``"balanced"`` or a mapping from label to weight.
        nesting_cost: What the additional parameter of a nested structure costs where structures are compared, in
            units of ½ ln N nats of information, as the Bayesian information criterion has it; 0 compares J alone.
            Without it structures that classify alike are told apart by differences of I that are noise.

    Raises:
        ConfigurationError: If a constant is out of its range.
    """

    size: int = 4
    rate: float = 0.95
    information_weight: float = 0.01
    depth: int = 2
    class_weight: ClassWeight = None
    nesting_cost: float = 1.0

    def __post_init__(self) -> None:
        for name in ("size", "depth"):
            count = getattr(self, name)
            if not isinstance(count, int | np.integer) or count < 1:
                raise ConfigurationError(f"{name} is {count!r}; use a whole number, 1 or more")
        for name in ("rate", "information_weight", "nesting_cost"):
            number = getattr(self, name)
            if not isinstance(number, int | float | np.number):
                raise ConfigurationError(f"{name} is {number!r}; use a number")
        if not 0 < self.rate <= 1:
            raise ConfigurationError(f"rate is {self.rate}; use a number above 0 and at most 1")
        for name in ("information_weight", "nesting_cost"):
            number = getattr(self, name)
            if not 0 <= number < np.inf:
                raise ConfigurationError(f"{name} is {number}; use 0 or more")

    def nesting_penalty(self, trajectories: int, horizon: int) -> float:
        """What the duration of a nested structure costs, in units of J.

        Args:
            trajectories: The number N of trajectories.
            horizon: The prior's last tick L.
        """
        nats = self.nesting_cost * np.log(trajectories) / 2
        return float(self.information_weight * nats / horizon)


@dataclass(frozen=True, slots=True)
class DecisionTree:
    """A node of the tree, with all below it.

    Attributes:
        path: The path formula φ^path: its primitives from the root down, negated ones by duality; () for ⊤.
        depth: h, 0 at the root.
        positives: How many trajectories with label 1 reach the node.
        negatives: How many with label -1.
        stop: Why the node is a leaf: ``"I"`` (pure enough), ``"II"`` (deepest), ``"III"`` (no ticks left),
            ``"interrupted"`` (Ctrl-C ended the search at a node before); else None.
        label: 1 or -1 at a leaf; else None.
        primitive: z.φ of a non-leaf node; else None.
        objective: J of the primitive at this node (0 at a leaf).
        rate: CR of the primitive at this node (0 at a leaf).
        gain: I of the primitive (0 at a leaf).
        left: The node of the trajectories that satisfy the primitive.
        right: The node of those that violate it.
        gap: How much better the best primitive of Υ_z can be at most, in units of J: 0 where it is proved to be the
            best; None where the search was not exact.
        interrupted: Whether Ctrl-C ended the search here, before or below: then the tree is only the best so far.
    """

    path: tuple[Primitive, ...]
    depth: int
    positives: int
    negatives: int
    stop: str | None = None
    label: int | None = None
    primitive: Primitive | None = None
    objective: float = 0.0
    rate: float = 0.0
    gain: float = 0.0
    left: DecisionTree | None = field(default=None)
    right: DecisionTree | None = field(default=None)
    gap: float | None = None
    interrupted: bool = False

    @property
    def leaf(self) -> bool:
        """Whether this is a leaf node."""
        return self.primitive is None

    def nodes(self) -> Iterator[DecisionTree]:
        """This node and all below it, left before right."""
        yield self
        for child in (self.left, self.right):
            if child is not None:
                yield from child.nodes()

    @property
    def path_formula(self) -> SequentialConjunction | None:
        """φ^path with its primitives in the order of their start-effect times; None for ⊤."""
        ordered = tuple(sorted(self.path, key=lambda primitive: primitive.start))
        return SequentialConjunction(ordered) if ordered else None

    @property
    def formula(self) -> SDNF | None:
        """The tree as a formula in SDNF: the path formulas of the leaves with label 1; None if there is none.

        Where all leaves below a node have label 1, its splits tell nothing apart and the node's own path formula stands
        for them.
        """
        paths = tuple(self._paths())
        return SDNF(paths) if paths else None

    def _paths(self) -> Iterator[SequentialConjunction]:
        labels = {node.label for node in self.nodes() if node.leaf}
        path = self.path_formula
        if labels == {1} and path is not None:
            yield path
        elif self.left is not None and self.right is not None:
            yield from self.left._paths()
            yield from self.right._paths()


def infer_tree(
    data: LabelledTrajectories,
    prior: Prior,
    space: SearchSpace,
    settings: InferenceSettings,
    search: Search,
    rng: np.random.Generator,
) -> DecisionTree:
    """Algorithm 1 from the root: S_L, φ^path = ⊤, h = 0.

    Structures are compared by the objective less the cost of a nested structure's duration (see
    `InferenceSettings.nesting_cost`; at 0 this is line 11 to the letter). Ties go to the structure that comes first in
    `STRUCTURES` (the plain box before its complement, then ◇, □, ◇□, □◇), and within a structure to the position found
    first. An exact search has a rule of its own (see `tickwise.inference.exact`); a Ctrl-C ends it with the best
    primitive so far, and the tree with leaves below it.

    Args:
        data: Labelled trajectories S_L, with both labels.
        prior: The prior G_L of the information gain.
        space: What boxes and times may be chosen.
        settings: ζ, λ, h_max and class weights.
        search: How to search: the settings of a swarm, or the limits of an exact search.
        rng: The source of all randomness; an exact search draws nothing.

    Returns:
        The root of the tree.

    Raises:
        DataError: If a label is missing, or the root is already a leaf of label 1.
        UnknownVariableError: If the prior lacks a variable of the data.
        ConfigurationError: If the space's variables are not the data's.
    """
    data.require_both_classes()
    if space.variables != data.variables:
        raise ConfigurationError(
            f"the space has variables {', '.join(space.variables)}, the data {', '.join(data.variables)}; use the same"
        )
    grower = _Grower(prior, space, settings, search)
    tree = grower.grow(data, trajectory_weights(data.labels, settings.class_weight), (), 0, rng)
    if tree.label == 1:
        raise DataError(
            f"{tree.positives} of {len(data)} trajectories have label 1, the rate that is asked for already; "
            "raise rate, or set class_weight='balanced'"
        )
    return tree


@dataclass(frozen=True, slots=True)
class _Found:
    """The primitive that line 11 chose, and what it is worth."""

    primitive: Primitive
    objective: float
    rate: float
    gain: float
    gap: float | None = None
    interrupted: bool = False


@dataclass(frozen=True, slots=True)
class _Grower:
    prior: Prior
    space: SearchSpace
    settings: InferenceSettings
    search: Search

    def grow(
        self,
        data: LabelledTrajectories | None,
        weights: NDArray[np.float64],
        path: tuple[Primitive, ...],
        depth: int,
        rng: np.random.Generator,
        interrupted: bool = False,
    ) -> DecisionTree:
        """Line 1: MITLtree(S, φ^path, h). No data stands for an empty set S."""
        labels = np.zeros(0, dtype=np.int8) if data is None else data.labels
        positives, negatives = int((labels == 1).sum()), int((labels == -1).sum())
        share = float(weights[labels == 1].sum() / weights.sum()) if len(weights) else 0.0
        gaps = self.space.gaps([(primitive.start, primitive.end) for primitive in path])
        stop = self._stop(share, depth, gaps) or ("interrupted" if interrupted else None)
        if data is None or stop is not None:  # line 2
            # lines 3 to 8: a leaf, with label 1 if more than half of its trajectories have it
            label = 1 if share > 0.5 else -1
            return DecisionTree(path, depth, positives, negatives, stop, label, interrupted=interrupted)
        # lines 9 to 11: a non-leaf node with the best primitive over Υ_z, which the gaps are
        best = self._best(data, weights, gaps, rng)
        # line 12: partition
        primitive = best.primitive
        satisfied = formula_signature(SDNF((SequentialConjunction((primitive,)),)), data)
        interrupted, children = best.interrupted, list[DecisionTree]()
        for mask, step in ((satisfied, primitive), (~satisfied, primitive.negation)):  # lines 13 and 14
            subset, below = data.select(mask) if mask.any() else None, (*path, step)
            children.append(self.grow(subset, weights[mask], below, depth + 1, rng.spawn(1)[0], interrupted))
            interrupted = interrupted or children[-1].interrupted
        return DecisionTree(  # line 15
            path, depth, positives, negatives, None, None, primitive, best.objective, best.rate, best.gain,
            left=children[0], right=children[1], gap=best.gap, interrupted=interrupted,
        )  # fmt: skip

    def _stop(self, share: float, depth: int, gaps: Gaps) -> str | None:
        if max(share, 1 - share) >= self.settings.rate:
            return "I"
        if depth >= self.settings.depth:
            return "II"
        return None if gaps else "III"

    def _best(
        self, data: LabelledTrajectories, weights: NDArray[np.float64], gaps: Gaps, rng: np.random.Generator
    ) -> _Found:
        """Line 11: the primitive structure and parameters in Υ_z with the greatest objective."""
        if isinstance(self.search, ExactSettings):
            return self._exact(data, weights, gaps, self.search)
        return self._by_swarm(data, weights, gaps, self.search, rng)

    def _nesting_cost(self, data: LabelledTrajectories) -> float:
        return self.settings.nesting_penalty(len(data), self.prior.horizon)

    def _exact(
        self, data: LabelledTrajectories, weights: NDArray[np.float64], gaps: Gaps, limits: ExactSettings
    ) -> _Found:
        levels = Levels.of(self.space, data, limits.levels)
        coded = code(data, weights, levels, self.space.horizon)
        best = best_primitive(coded, levels, self.prior, gaps, self.settings, limits)
        return _Found(best.primitive, best.objective, best.rate, best.gain, best.gap, best.interrupted)

    def _by_swarm(
        self,
        data: LabelledTrajectories,
        weights: NDArray[np.float64],
        gaps: Gaps,
        swarm: SwarmSettings,
        rng: np.random.Generator,
    ) -> _Found:
        winner: tuple[Primitive, float, Objective] | None = None
        most = -np.inf
        for operator, complemented in STRUCTURES:
            shape = shape_of([[(operator, complemented)]])
            if not self.space.room(shape, gaps):
                continue
            objective = Objective(data, weights, self.prior, self.space, shape, gaps, self.settings.information_weight)
            starts = sampled_starts(data, self.space, shape, swarm.restarts * swarm.particles // 2, rng)
            lower, upper = self.space.bounds(shape)
            found = maximise(objective, lower, upper, self.space.units(shape), swarm, rng, starts)
            worth = found.value - (self._nesting_cost(data) if operator.nested else 0.0)
            if worth > most:
                most = worth
                formula = objective.formula(found.position)
                winner = formula.disjuncts[0].primitives[0], found.value, objective
        assert winner is not None  # the gaps have room for ◇ at least
        primitive, value, objective = winner
        return _Found(primitive, value, *objective.parts(SDNF((SequentialConjunction((primitive,)),))))


def best_primitive(
    coded: Coded, levels: Levels, prior: Prior, gaps: Gaps, settings: InferenceSettings, limits: ExactSettings
) -> ExactResult:
    """Line 11 of Algorithm 1 by exact search, at a node that coded trajectories have reached.

    Args:
        coded: The trajectories, with their weights.
        levels: The levels that they were coded by.
        prior: The prior G_L.
        gaps: Free intervals of ticks, so that θ is in Υ_z.
        settings: λ, and what a nested structure costs.
        limits: The limits of the search.

    Returns:
        The best primitive.
    """
    cost = settings.nesting_penalty(len(coded.positive), prior.horizon)
    worth = worth_of(coded, settings.information_weight, cost)
    return exact_search(ExactProblem(coded, levels, prior, gaps, worth), limits)


def classification_rate(
    phi: Formula | SDNF | None, data: LabelledTrajectories, class_weight: ClassWeight = None
) -> float:
    """CR(S_L, φ): the share of trajectories that the weak view of a formula classifies rightly.

    Args:
        phi: A formula; None classifies every trajectory as -1.
        data: Labelled trajectories.
        class_weight: Weights of the labels; None for equal ones.

    Returns:
        The rate in [0, 1].

    Raises:
        UnknownVariableError: If the formula names a variable that the data does not have.
    """
    weights = trajectory_weights(data.labels, class_weight)
    if phi is None:
        signature = np.zeros(len(data), dtype=bool)
    else:
        formula = phi.formula if isinstance(phi, SDNF) else phi
        verdicts = formula.verdict(data.values, variables=data.variables, lengths=data.lengths)
        signature = np.asarray(verdicts) != Verdict.FALSE
    return float(weights[signature == (data.labels == 1)].sum() / weights.sum())


def pruned(phi: SDNF, data: LabelledTrajectories, settings: InferenceSettings) -> SDNF:
    """A satisfying formula less the disjuncts that it does not need, those that say least of the positives first.

    A leaf of a decision tree may hold the few trajectories that were on the wrong side above it. Its path formula says
    nothing of the task, but would become part of the structure that is transferred.

    Args:
        phi: A formula.
        data: Labelled trajectories.
        settings: The constraints of Problem 1.

    Returns:
        The formula with the fewest such disjuncts; as it is where it is not satisfying.
    """
    positives = data.select(data.labels == 1)
    by_use = sorted(phi.disjuncts, key=lambda disjunct: formula_signature(SDNF((disjunct,)), positives).sum())
    for disjunct in by_use:
        rest = tuple(other for other in phi.disjuncts if other != disjunct)
        if rest and is_satisfying(SDNF(rest), data, settings):
            phi = SDNF(rest)
    return phi


def is_satisfying(phi: SDNF | None, data: LabelledTrajectories, settings: InferenceSettings) -> bool:
    """Whether a formula meets the classification and the size constraint of Problem 1; None does not."""
    if phi is None or phi.size > settings.size:
        return False
    return classification_rate(phi, data, settings.class_weight) >= settings.rate
