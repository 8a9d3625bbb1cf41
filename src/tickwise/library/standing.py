"""By which numbers entries are ranked, and the words for why one stands where it stands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

ORDER = ("promise", "dissimilarity", "distance")
"""By which numbers entries are ranked: the first decides, the next where it ties or is not known, and so on.

This is the one place that says so. ``promise`` is better the greater it is, the others the smaller they are.
"""

_PHRASES = {
    "promise": (
        "with its values the greedy policy satisfies the task's formula in {} of episodes before anything is learned"
    ),
    "dissimilarity": "its formula, moved onto the task's, disagrees with that in {} of what satisfies either",
    "distance": "once moved, its regions and windows differ from the fitted ones by {} of the world and the episode",
}

_DIGITS = 9  # what differs further behind is rounding


@dataclass(frozen=True, slots=True)
class Numbers:
    """How promising an entry is, in three ways.

    Attributes:
        promise: The probability that the greedy policy of the transferred Q-function satisfies the new task's formula
            (see `tickwise.transfer.promise`); None where no world is known.
        dissimilarity: How often the entry's formula, moved onto the one that was fitted, and the new task's formula
            disagree, among the trajectories that satisfy either (see `tickwise.inference.similarity`).
        distance: What remains of regions and windows once the entry's formula lies over the fitted one, as a share (see
            `tickwise.library.ranking.distance`).
    """

    promise: float | None
    dissimilarity: float
    distance: float


def key_of(numbers: Numbers, order: Sequence[str]) -> tuple[float, ...]:
    """What entries are sorted by: the least comes first."""
    return tuple(_cost(numbers, name) for name in order)


def _cost(numbers: Numbers, name: str) -> float:
    value: float | None = getattr(numbers, name)
    if value is None:
        return 0.0
    return round(-value if name == "promise" else value, _DIGITS)


def reason_of(place: int, ranked: Sequence[tuple[str, Numbers]], order: Sequence[str]) -> str:
    """Why an entry stands where it stands: the number that decides between it and its neighbour, in one sentence.

    Args:
        place: Its place, from 0.
        ranked: Names and numbers of all, in order.
        order: By which numbers they are ranked.

    Returns:
        The sentence; that of the first compares with the second, that of any other with the one before.
    """
    numbers = ranked[place][1]
    if len(ranked) == 1:
        said = next((said for name in order if (said := _said(name, numbers))), "it is alone")
        return _sentence(f"no other entry is transferable; {said}")
    other, theirs = ranked[place - 1 if place else 1]
    ours = key_of(numbers, order)
    deciding = next((name for name, a, b in zip(order, ours, key_of(theirs, order), strict=True) if a != b), None)
    if deciding is None:
        return _sentence(f"it has the same numbers as {other}, and the names decide")
    ties = [name for name in order[: order.index(deciding)] if getattr(numbers, name) is not None]
    tied = f"its {' and '.join(ties)} {'is that' if len(ties) == 1 else 'are those'} of {other}, but " if ties else ""
    digits = _digits(getattr(numbers, deciding), getattr(theirs, deciding))
    said = _said(deciding, numbers, digits)
    return _sentence(f"{tied}{said}, and with {other} {_percent(getattr(theirs, deciding), digits)}")


def _said(name: str, numbers: Numbers, digits: int = 3) -> str:
    value = getattr(numbers, name)
    return "" if value is None else _PHRASES[name].format(_percent(value, digits))


def _percent(share: float, digits: int) -> str:
    return f"{100 * share:.{digits}g} %"


def _digits(ours: float, theirs: float) -> int:
    """As many digits as tell two shares apart."""
    return next((d for d in range(3, _DIGITS) if _percent(ours, d) != _percent(theirs, d)), _DIGITS)


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."
