"""Structural equivalence and structural transferability of formulas (Definitions 6 and 7)."""

from __future__ import annotations

from tickwise.logic.sdnf import SDNF, Operator, to_sdnf
from tickwise.logic.syntax import Formula


def structure(phi: Formula | SDNF) -> tuple[tuple[Operator, ...], ...]:
    """The temporal operators O_T of a formula's primitives: all that Definitions 6 and 7 look at.

    Args:
        phi: A formula in SDNF, or one that can be brought to it.

    Returns:
        For each sequential conjunctive subformula, in order, the operators of its primitives, in order.

    Raises:
        FormulaError: If the formula has no SDNF.
    """
    return tuple(tuple(primitive.operator for primitive in disjunct.primitives) for disjunct in to_sdnf(phi).disjuncts)


def structurally_equivalent(a: Formula | SDNF, b: Formula | SDNF) -> bool:
    """Whether two formulas are structurally equivalent (Definition 6).

    They are if they have the same number of disjuncts, the i-th of each have the same number of primitives,
    and the j-th of these have the same temporal operator.

    Args:
        a: A formula in SDNF, or one that can be brought to it.
        b: Another one.

    Raises:
        FormulaError: If one of them has no SDNF.
    """
    return structure(a) == structure(b)


def structurally_transferable(target: Formula | SDNF, source: Formula | SDNF) -> bool:
    """Whether the target is structurally transferable from the source (Definition 7).

    It is if the two are structurally equivalent, or the target is a disjunction of p > 1 formulas each of
    which is structurally equivalent with the source.

    Args:
        target: φ_2, a formula in SDNF, or one that can be brought to it.
        source: φ_1, likewise.

    Raises:
        FormulaError: If one of them has no SDNF.
    """
    of_target, of_source = structure(target), structure(source)
    copies = len(of_target) // len(of_source)
    return copies > 0 and of_target == of_source * copies
