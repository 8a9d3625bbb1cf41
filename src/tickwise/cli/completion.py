"""What a shell offers where a name is wanted; each is called with what has been typed so far.

Everything is imported when it is asked for: a press of Tab must not wait for what it does not need.
"""

from __future__ import annotations

from collections.abc import Iterable


def studies(incomplete: str) -> list[str]:
    """What can be reproduced."""
    from tickwise.experiments.case_studies import STUDIES

    return _beginning(incomplete, (*STUDIES, "random", "all", "pair-01"))


def case_studies(incomplete: str) -> list[str]:
    """The case studies alone."""
    from tickwise.experiments.case_studies import STUDIES

    return _beginning(incomplete, STUDIES)


def effects(incomplete: str) -> list[str]:
    """The settings whose effect can be measured."""
    from tickwise.experiments.effect_catalog import EFFECTS

    return _beginning(incomplete, EFFECTS)


def protocols(incomplete: str) -> list[str]:
    """The protocols of inference."""
    from tickwise.experiments.study import PROTOCOLS

    return _beginning(incomplete, PROTOCOLS)


def formats(incomplete: str) -> list[str]:
    """The formats of automata."""
    from tickwise.automata.formats import FORMATS

    return _beginning(incomplete, sorted((*FORMATS, "svg")))


def searches(incomplete: str) -> list[str]:
    """The searches for formulas."""
    from tickwise.inference.classifier import SEARCHES

    return _beginning(incomplete, SEARCHES)


def numbers(incomplete: str) -> list[str]:
    """What entries of a library can be ranked by."""
    from tickwise.library.standing import ORDER

    return _beginning(incomplete, ORDER)


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
