"""Step 2 of Section IV-B: fit a formula of a given structure to the target's trajectories."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError
from tickwise.inference.certificate import certify
from tickwise.inference.draft import Draft, Drafter, draft_of, formula_of, structure_of
from tickwise.inference.draft import Structure as DraftStructure
from tickwise.inference.exact import ExactSettings
from tickwise.inference.fit import Fit
from tickwise.inference.joint import fit_jointly
from tickwise.inference.objective import Objective, formula_signature, trajectory_weights
from tickwise.inference.prior import Prior
from tickwise.inference.space import SearchSpace, shape_of
from tickwise.inference.starts import sampled_starts
from tickwise.inference.swarm import SwarmResult, SwarmSettings, maximise
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings, Search
from tickwise.logic.sdnf import SDNF, Operator

_COVERINGS = 6  # starts by covering of each search over several disjuncts

Structure = Sequence[Sequence[Operator | str]]
"""For each disjunct the temporal operators of its primitives, in order, such as ``(("FG", "F"),)``."""


@dataclass(frozen=True, slots=True)
class TransferFit:
    """The outcome of Step 2.

    Attributes:
        attempts: The best formula with one, two, … copies of the source's structure.
        transferable: Whether the last attempt is satisfying, so that logical transferability is identified.
        reason: One sentence in plain words.
    """

    attempts: tuple[Fit, ...]
    transferable: bool
    reason: str

    @property
    def formula(self) -> SDNF | None:
        """The satisfying formula φ^T; None if there is none."""
        return self.attempts[-1].formula if self.transferable else None


def fit_structure(
    data: LabelledTrajectories,
    prior: Prior,
    space: SearchSpace,
    structure: Structure | SDNF,
    settings: InferenceSettings,
    search: Search,
    rng: np.random.Generator,
    *,
    start: SDNF | None = None,
) -> Fit:
    """Optimise all parameters of one formula together, its operators fixed.

    An exact search goes through the primitives one at a time, from many beginnings (see `tickwise.inference.joint`). Of
    a structure of one primitive it proves its formula to be the best; of others it says how much better the best one
    can be, where `ExactSettings.certificate` gives it the time.

    A swarm moves all parameters at once. Then each primitive in turn is searched anew with the others held, until none
    gets better: windows of neighbours push each other, and a joint move that keeps all good is rare. All of this is
    repeated, the swarm's restarts times the number of primitives of the longest disjunct, and the best is kept. Of
    several disjuncts some starts are by covering: each is fitted alone to the positives that those before it leave.

    Args:
        data: Labelled trajectories, with both labels.
        prior: The prior G_L of the information gain.
        space: What boxes and times may be chosen.
        structure: A source formula, which gives operators and the polarity of each predicate, or the operators alone.
        settings: ζ, ϱ_th, λ and class weights.
        search: How to search: the settings of a swarm, or the limits of an exact search.
        rng: The source of all randomness; an exact search draws nothing.
        start: A formula whose disjuncts are a good guess for the first disjuncts.

    Returns:
        The best formula found.

    Raises:
        DataError: If a label is missing.
        ConfigurationError: If the structure is empty or does not fit into the space's horizon.
    """
    data.require_both_classes()
    pairs = _pairs(structure)
    shape = shape_of(pairs)
    gaps = ((0, space.horizon),)
    if not space.room(shape, gaps):
        raise ConfigurationError(
            f"{max(map(len, pairs))} primitives one after the other do not fit into {space.horizon} ticks; "
            "use a longer horizon"
        )
    weights = trajectory_weights(data.labels, settings.class_weight)
    if isinstance(search, ExactSettings):
        drafter = Drafter(data, weights, prior, space, settings.information_weight, 0.0, search)
        found, bound = _exactly(drafter, structure_of(pairs), None if start is None else draft_of(start))
        return Fit.of(formula_of(found), *drafter.parts(found), settings, bound, interrupted=drafter.interrupted)
    return _fit_by_swarm(data, prior, space, pairs, settings, search, rng, start)


def _exactly(drafter: Drafter, structure: DraftStructure, start: Draft | None) -> tuple[Draft, float | None]:
    """The best formula found, and a bound on J over all of them where it is cheap or asked for."""
    if len(structure) == len(structure[0]) == 1:
        return _alone(drafter, structure, start)
    found = fit_jointly(drafter, structure, start)
    assert found is not None  # there is room for the structure
    if drafter.settings.certificate == 0 or drafter.interrupted:
        return found, None
    known = certify(drafter, structure, found, drafter.settings.certificate)
    return known.draft, known.bound


def _alone(drafter: Drafter, structure: DraftStructure, start: Draft | None) -> tuple[Draft, float]:
    """The best primitive, and the bound that proves it."""
    found = drafter.place(((None,),), structure, 0, 0)
    if found is None:
        raise KeyboardInterrupt
    known: list[Draft] = [((found.primitive,),)]
    if start is not None and len(start) == len(start[0]) == 1:  # its sides need not be among the levels
        known.append(start)
    best = max(known, key=drafter.value)
    return best, max(found.bound, drafter.value(best))


def _fit_by_swarm(
    data: LabelledTrajectories,
    prior: Prior,
    space: SearchSpace,
    pairs: Sequence[Sequence[tuple[Operator, bool]]],
    settings: InferenceSettings,
    swarm: SwarmSettings,
    rng: np.random.Generator,
    start: SDNF | None,
) -> Fit:
    shape, gaps = shape_of(pairs), ((0, space.horizon),)
    weights = trajectory_weights(data.labels, settings.class_weight)
    objective = Objective(data, weights, prior, space, shape, gaps, settings.information_weight)
    single = replace(swarm, restarts=1)
    position, value = np.zeros(0), -np.inf
    for _ in range(swarm.restarts * max(map(len, pairs))):
        known = [] if start is None else [space.encode(start)]
        if len(pairs) > 1:
            known += [_covering(objective, pairs, single, rng) for _ in range(_COVERINGS)]
        found = _one_search(objective, _blocks(space, pairs), single, rng, known)
        if found.value > value:
            position, value = found.position, found.value
    formula = objective.formula(position)
    return Fit.of(formula, *objective.parts(formula), settings)


def fit_transferable(
    data: LabelledTrajectories,
    prior: Prior,
    space: SearchSpace,
    source: SDNF,
    settings: InferenceSettings,
    search: Search,
    rng: np.random.Generator,
) -> TransferFit:
    """Step 2: look for a satisfying formula that is structurally transferable from the source (Definition 7).

    The number of structurally equivalent copies joined by ∨ grows from one until a satisfying formula is found or the
    size constraint would be violated.

    Args:
        data: The target's labelled trajectories.
        prior: The target's prior.
        space: The target's search space.
        source: φ^S, a satisfying formula of the source task.
        settings: ζ, ϱ_th, λ and class weights.
        search: How to search.
        rng: The source of all randomness.

    Returns:
        Every attempt, and whether logical transferability (Definition 8) is identified.

    Raises:
        DataError: If a label is missing.
        ConfigurationError: If the structure does not fit into the space's horizon.
        KeyboardInterrupt: If Ctrl-C ended an exact search.
    """
    attempts: list[Fit] = []
    copies = 1
    while copies * source.size <= settings.size:
        previous = attempts[-1].formula if attempts else None
        structure = SDNF(source.disjuncts * copies)
        attempts.append(fit_structure(data, prior, space, structure, settings, search, rng, start=previous))
        if attempts[-1].interrupted:
            raise KeyboardInterrupt  # whether there is a satisfying formula is not known
        if attempts[-1].satisfying:
            noun = "formula" if copies == 1 else f"disjunction of {copies} formulas"
            reason = (
                f"A {noun} structurally equivalent with the source's classifies {_percent(attempts[-1].rate)} of the "
                f"target's trajectories rightly, at least the {_percent(settings.rate)} that are asked for."
            )
            return TransferFit(tuple(attempts), True, reason)
        copies += 1
    if not attempts:
        reason = f"The source's formula has size {source.size}, more than the {settings.size} that are allowed."
    else:
        best = max(attempt.rate for attempt in attempts)
        reason = (
            f"Logical transferability is not identified: with up to {len(attempts)} "
            f"cop{'y' if len(attempts) == 1 else 'ies'} of the source's structure the best classification rate on the "
            f"target is {_percent(best)}, below the {_percent(settings.rate)} that are asked for, and one more copy "
            f"would exceed size {settings.size}."
        )
    return TransferFit(tuple(attempts), False, reason)


def _percent(rate: float) -> str:
    """A rate in percent, with so many decimals that only all is 100 %."""
    return next(text for places in range(1, 16) if (text := f"{rate:.{places}%}") != f"{1:.{places}%}" or rate == 1)


def _pairs(structure: Structure | SDNF) -> list[list[tuple[Operator, bool]]]:
    if isinstance(structure, SDNF):
        return [[(p.operator, p.complemented) for p in disjunct.primitives] for disjunct in structure.disjuncts]
    if not structure or not all(structure):
        raise ConfigurationError("the structure has no primitive; give one tuple of operators per disjunct")
    try:
        return [[(Operator(operator), False) for operator in disjunct] for disjunct in structure]
    except ValueError:
        raise ConfigurationError(f"the structure {structure!r} names an unknown operator; use F, G, FG, GF") from None


def _blocks(space: SearchSpace, pairs: Sequence[Sequence[tuple[Operator, bool]]]) -> list[slice]:
    """Where each primitive's parameters lie in a position."""
    blocks, at = [], 0
    for operator, _ in (pair for disjunct in pairs for pair in disjunct):
        width = 2 * len(space.variables) + 2 + operator.nested
        blocks.append(slice(at, at + width))
        at += width
    return blocks


def _one_search(
    objective: Objective,
    blocks: Sequence[slice],
    swarm: SwarmSettings,
    rng: np.random.Generator,
    known: Sequence[NDArray[np.float64]],
) -> SwarmResult:
    """One joint swarm, then each primitive in turn with the others held, until none gets better."""
    space, shape = objective.space, objective.shape
    (lower, upper), units = space.bounds(shape), space.units(shape)
    starts = sampled_starts(objective.data, space, shape, swarm.particles // 2, rng)
    for row, position in zip(starts, known, strict=False):
        row[: len(position)] = position
    best = maximise(objective, lower, upper, units, swarm, rng, starts)
    improved = len(blocks) > 1
    while improved:
        improved = False
        for block in blocks:
            held = _Held(objective, best.position, block)
            single = sampled_starts(objective.data, space, shape, swarm.particles // 2, rng)[:, block]
            single = np.vstack((best.position[None, block], single))
            found = maximise(held, lower[block], upper[block], units[block], swarm, rng, single)
            if found.value > best.value:
                best, improved = replace(found, position=held.whole(found.position[None])[0]), True
    return best


def _covering(
    objective: Objective,
    pairs: Sequence[Sequence[tuple[Operator, bool]]],
    swarm: SwarmSettings,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """A position of the whole from disjuncts that are fitted one after the other.

    In a disjunction a negative that one disjunct lets through is lost, whereas a positive that it misses may be
    another's: so negatives weigh more here, twice the number of disjuncts.
    """
    data, parts = objective.data, []
    left = np.ones(len(data), dtype=np.bool_)
    weights = np.where(data.labels == 1, 1.0, 2.0 * len(pairs)) * objective.weights
    for disjunct in pairs:
        gain = objective.information_weight * objective.weights.sum() / weights[left].sum()
        alone = replace(
            objective,
            data=data.select(left),
            weights=weights[left],
            shape=shape_of([disjunct]),
            information_weight=float(gain),  # in trajectories, the gain is worth what it was
        )
        parts.append(_one_search(alone, _blocks(objective.space, [disjunct]), swarm, rng, ()).position)
        rest = left & ~(formula_signature(alone.formula(parts[-1]), data) & (data.labels == 1))
        left = rest if (data.labels[rest] == 1).any() else left
    return np.concatenate(parts)


@dataclass(frozen=True, slots=True, eq=False)
class _Held:
    """The objective as a function of one primitive's parameters, the others held."""

    objective: Objective
    position: NDArray[np.float64]
    block: slice

    def __call__(self, positions: NDArray[np.float64], incumbents: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.objective(self.whole(positions), incumbents)

    def whole(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """The full positions, shape ``(particles, dimensions)``."""
        full = np.tile(self.position, (len(positions), 1))
        full[:, self.block] = positions
        return full
