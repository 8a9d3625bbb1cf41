"""Steps 1 to 3: transfer of logical structure under the hypothesis of logical transferability (Section IV-B)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from tickwise.automata.build import timed_automata
from tickwise.automata.model import TimedAutomaton
from tickwise.automata.ticks import TickTable
from tickwise.errors import DataError, NotTransferableError
from tickwise.inference.exact import ExactSettings
from tickwise.inference.growth import infer_jointly
from tickwise.inference.objective import formula_signature
from tickwise.inference.prior import Prior
from tickwise.inference.space import SearchSpace
from tickwise.inference.template import TransferFit, fit_structure, fit_transferable
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import DecisionTree, InferenceSettings, Search, infer_tree, is_satisfying, pruned
from tickwise.logic.sdnf import SDNF

PARTS = ("tree", "source", "target")
"""What Steps 1 and 2 consist of: Algorithm 1 and φ^S, which make up Step 1, and φ^T."""


@dataclass(frozen=True, slots=True)
class Task:
    """What inference needs of one task: its labelled trajectories, prior and space of parameters."""

    data: LabelledTrajectories
    prior: Prior
    space: SearchSpace


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """The outcome of Steps 1 and 2.

    Attributes:
        tree: The source's decision tree (Algorithm 1); None where all primitives were found together.
        source: φ^S, or None where the tree has no leaf with label 1, or no formula is better than a trivial one.
        source_satisfying: Whether φ^S is a satisfying formula (Problem 1).
        fit: The attempts of Step 2, or None where Step 1 failed.
    """

    tree: DecisionTree | None
    source: SDNF | None
    source_satisfying: bool
    fit: TransferFit | None

    @property
    def target(self) -> SDNF | None:
        """φ^T, or None where logical transferability was not identified."""
        return self.fit.formula if self.fit is not None and self.fit.transferable else None

    @property
    def transferable(self) -> bool:
        """Whether logical transferability is identified (Definition 8)."""
        return self.target is not None

    @property
    def reason(self) -> str:
        """Why it is or is not, in one sentence."""
        if self.source is None:
            lacking = (
                "no formula is better than a trivial one in the source task"
                if self.tree is None
                else "no leaf of the source's decision tree has label 1"
            )
            return f"Logical transferability is not identified: {lacking}."
        if not self.source_satisfying:
            return "Logical transferability is not identified: the source's formula violates a constraint of Problem 1."
        assert self.fit is not None  # Step 2 ran
        return self.fit.reason


def transfer_structure(
    source: Task,
    target: Task,
    settings: InferenceSettings,
    search: Search,
    source_rng: np.random.Generator,
    target_rng: np.random.Generator,
    done: Callable[[str], None] | None = None,
    *,
    target_settings: InferenceSettings | None = None,
) -> Hypothesis:
    """Infer φ^S by Algorithm 1 (Step 1), then fit a structurally transferable φ^T (Step 2).

    Args:
        source: The source task's data.
        target: The target task's data.
        settings: The constraints of Problem 1 and the settings of Algorithm 1.
        search: How to search: the settings of the particle swarm, or the limits of an exact search.
        source_rng: Draws of Step 1.
        target_rng: Draws of Step 2.
        done: Told which of `PARTS` is done, each in turn; for who shows progress or measures time.
        target_settings: The settings of Step 2, where ζ and λ count errors among another number of trajectories than in
            the source; None for the same.

    Returns:
        What was inferred, and whether logical transferability is identified.

    Raises:
        KeyboardInterrupt: If Ctrl-C ended an exact search, whose best so far is nothing to build on.
    """
    given = (source.data, source.prior, source.space, settings)
    jointly = search if isinstance(search, ExactSettings) and search.joint else None
    tree = infer_tree(*given, search, source_rng) if jointly is None else None
    _require_whole(tree is not None and tree.interrupted)
    if done is not None:
        done("tree")
    formula = source_formula(tree, source, settings, search, source_rng) if tree else None
    if jointly is not None:
        formula = _joint_formula(source, settings, jointly)
    satisfying = is_satisfying(formula, source.data, settings)
    if done is not None:
        done("source")
    fit = None
    if formula is not None and satisfying:
        constants = target_settings or settings
        fit = fit_transferable(target.data, target.prior, target.space, formula, constants, search, target_rng)
        if done is not None:
            done("target")
    return Hypothesis(tree, formula, satisfying, fit)


def _joint_formula(source: Task, settings: InferenceSettings, limits: ExactSettings) -> SDNF | None:
    """The formula that is found with all primitives together; None where there is no good one."""
    source.data.require_both_classes()
    try:
        fit = infer_jointly(source.data, source.prior, source.space, settings, limits)
    except DataError:  # both labels are there: no formula is better than a trivial one
        return None
    _require_whole(fit.interrupted)
    return fit.formula


def _require_whole(interrupted: bool) -> None:
    """Nothing is built on a formula that is only the best so far."""
    if interrupted:
        raise KeyboardInterrupt


def source_formula(
    tree: DecisionTree, source: Task, settings: InferenceSettings, search: Search, rng: np.random.Generator
) -> SDNF | None:
    """The formula of a decision tree, pruned; where it is not satisfying, its parameters are optimised together.

    Algorithm 1 chooses the primitives one by one: an earlier one that takes ticks from a later one is never mended. As
    Step 2 does in the target, the operators are fixed here and all parameters fitted jointly, those of the disjunct
    that says most of the positives alone, and those of all disjuncts.

    Args:
        tree: The source's decision tree.
        source: The source task's data.
        settings: The constraints of Problem 1.
        search: How to search: the settings of the particle swarm, or the limits of an exact search.
        rng: The source of all randomness.

    Returns:
        The first satisfying formula of these; the tree's where there is none, and None where it has none.
    """
    formula = tree.formula
    if formula is None or is_satisfying(formula, source.data, settings):
        return formula and pruned(formula, source.data, settings)
    positives = source.data.select(source.data.labels == 1)
    main = max(formula.disjuncts, key=lambda disjunct: formula_signature(SDNF((disjunct,)), positives).sum())
    for start in dict.fromkeys((SDNF((main,)), formula)):
        if start.size <= settings.size:
            fit = fit_structure(source.data, source.prior, source.space, start, settings, search, rng, start=start)
            _require_whole(fit.interrupted)
            if fit.satisfying:
                return fit.formula
    return formula


def tick_tables(formula: SDNF, horizon: int, *, reduce: bool = True) -> tuple[TickTable, ...]:
    """Step 3: the deterministic timed automata of the sequential conjunctive subformulas, compiled to tick tables.

    Args:
        formula: φ in SDNF.
        horizon: The length L of an episode, in ticks: the greatest clock value of the unreduced valuations. A
            formula may look beyond it, and is then undecided at an episode's end (the weak view).
        reduce: Hold clocks that a location does not use at 0; False keeps the paper's full valuations.

    Returns:
        One table a disjunct.
    """
    return tuple(
        automaton.compile(max(horizon, *_constants(automaton)), reduce=reduce) for automaton in timed_automata(formula)
    )


def _constants(automaton: TimedAutomaton) -> Iterator[int]:
    """What the clocks are compared with, in ticks: the windows' ends and the durations, at least."""
    for primitive in automaton.conjunction.primitives:
        yield from (primitive.window.end, primitive.duration)


def require_transferable(hypothesis: Hypothesis) -> tuple[SDNF, SDNF]:
    """φ^S and φ^T where logical transferability is identified.

    Raises:
        NotTransferableError: Where it is not, with the reason.
    """
    if hypothesis.source is None or hypothesis.target is None:
        raise NotTransferableError(hypothesis.reason)
    return hypothesis.source, hypothesis.target
