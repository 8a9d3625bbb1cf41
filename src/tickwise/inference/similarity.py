"""How far two formulas over the same world are from each other: the exact probability that they disagree."""

from __future__ import annotations

import math

from tickwise.inference.information import log_mass
from tickwise.inference.prior import Prior
from tickwise.logic.alignment import aligned
from tickwise.logic.sdnf import SDNF, to_sdnf
from tickwise.logic.syntax import Formula


def disagreement(phi: Formula | SDNF, psi: Formula | SDNF, prior: Prior) -> float:
    """The probability that a trajectory of the prior satisfies one of two formulas and not the other, exactly.

    Dynamic programming over the product of the prior's chain and both formulas' tick tables. It is a metric on formulas
    that are taken for the same where no trajectory of the prior tells them apart. The view is weak, as that of
    `probability`: what is undecided at the prior's horizon counts as satisfied.

    Args:
        phi: A formula that can be brought to SDNF, or an SDNF.
        psi: Another one.
        prior: The prior distribution.

    Returns:
        The probability in [0, 1].

    Raises:
        FormulaError: If a formula has no SDNF.
        UnknownVariableError: If a formula names a variable that the prior does not have.
    """
    return math.exp(log_mass([to_sdnf(phi), to_sdnf(psi)], prior, lambda satisfied: satisfied[0] != satisfied[1]))


def dissimilarity(phi: Formula | SDNF, psi: Formula | SDNF, prior: Prior) -> float:
    """The probability that two formulas disagree, among the trajectories that satisfy at least one of them.

    Satisfying formulas of high information gain are seldom satisfied at random, so they hardly ever disagree; this is
    their distance on a scale of its own, from 0 for equivalent ones to 1 for ones that exclude each other. It is the
    Jaccard distance of what satisfies them, and a metric as `disagreement` is.

    Args:
        phi: A formula that can be brought to SDNF, or an SDNF.
        psi: Another one.
        prior: The prior distribution.

    Returns:
        The conditional probability in [0, 1]; 0 where neither can be satisfied.

    Raises:
        FormulaError: If a formula has no SDNF.
        UnknownVariableError: If a formula names a variable that the prior does not have.
    """
    both = [to_sdnf(phi), to_sdnf(psi)]
    either = log_mass(both, prior, any)
    if math.isinf(either):
        return 0.0
    return min(1.0, math.exp(log_mass(both, prior, lambda satisfied: satisfied[0] != satisfied[1]) - either))


def aligned_dissimilarity(source: Formula | SDNF, target: Formula | SDNF, prior: Prior) -> float:
    """The dissimilarity that remains once a source's formula is moved onto a target's in space and time.

    Algorithm 2 compares states relative to the regions, so where a region lies is no difference to it; this leaves out
    the displacement that the target's regions and windows have in common (see `tickwise.logic.alignment.aligned`).

    Args:
        source: A formula that can be brought to SDNF, or an SDNF.
        target: Another one, structurally transferable from it.
        prior: The prior distribution of the target's world; what it leaves undecided counts as satisfied.

    Returns:
        The conditional probability in [0, 1]; see `dissimilarity`.

    Raises:
        FormulaError: If the target is not structurally transferable from the source.
        UnknownVariableError: If a formula names a variable that the prior does not have.
    """
    return dissimilarity(aligned(source, target), target, prior)
