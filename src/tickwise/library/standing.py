"""By which numbers entries are ranked, and the words for why one stands where it stands."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

ORDER = ("rehearsal", "promise", "dissimilarity", "distance")
"""By which numbers entries are ranked: the first decides, the next where it ties or is not known, and so on.

This is the one place that says so. ``promise`` is better the greater it is, the others the smaller they are.
"""

_PHRASES = {
    "rehearsal": "its values need {} to learn the task's formula in the model of the world",
    "promise": (
        "with its values the greedy policy satisfies the task's formula in {} of episodes before anything is learned"
    ),
    "dissimilarity": "its formula, moved onto the task's, disagrees with that in {} of what satisfies either",
    "distance": "once moved, its regions and windows differ from the fitted ones by {} of the world and the episode",
}

_DIGITS = 9  # what differs further behind is rounding


@dataclass(frozen=True, slots=True)
class Numbers:
    """How promising an entry is, in four ways.

    Attributes:
        rehearsal: The mean number of episodes that it takes to learn the new task's formula from the transferred
            Q-function in the model of the world (see `tickwise.transfer.rehearsal`); None where no world is known.
        promise: The probability that the greedy policy of the transferred Q-function satisfies the new task's formula
            (see `tickwise.transfer.promise`); None where no world is known.
        dissimilarity: How often the entry's formula, moved onto the one that was fitted, and the new task's formula
            disagree, among the trajectories that satisfy either (see `tickwise.inference.similarity`).
        distance: What remains of regions and windows once the entry's formula lies over the fitted one, as a share (see
            `tickwise.library.ranking.distance`).
    """

    rehearsal: float | None
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


def reason_of(place: int, ranked: Sequence[tuple[str, Numbers]], order: Sequence[str], most: float = math.inf) -> str:
    """Why an entry stands where it stands: the number that decides between it and its neighbour, in one sentence.

    Args:
        place: Its place, from 0.
        ranked: Names and numbers of all, in order.
        order: By which numbers they are ranked.
        most: Episodes that a rehearsal had at most.

    Returns:
        The sentence; that of the first compares with the second, that of any other with the one before.
    """
    numbers = ranked[place][1]
    if len(ranked) == 1:
        said = next((said for name in order if (said := _said(name, numbers, most))), "it is alone")
        return _sentence(f"no other entry is ranked; {said}")
    other, theirs = ranked[place - 1 if place else 1]
    ours = key_of(numbers, order)
    deciding = next((name for name, a, b in zip(order, ours, key_of(theirs, order), strict=True) if a != b), None)
    if deciding is None:
        return _sentence(f"it has the same numbers as {other}, and the names decide")
    ties = [name for name in order[: order.index(deciding)] if getattr(numbers, name) is not None]
    tied = f"its {' and '.join(ties)} {'is that' if len(ties) == 1 else 'are those'} of {other}, but " if ties else ""
    value = getattr(theirs, deciding)
    digits = _digits(deciding, getattr(numbers, deciding), value, most)
    said = _said(deciding, numbers, most, digits)
    return _sentence(f"{tied}{said}, and with {other} {_text(deciding, value, most, digits)}")


def warning_of(name: str, numbers: Numbers, without: float | None, most: float) -> str | None:
    """Why an entry's values had better not be transferred, in one sentence.

    Args:
        name: The entry's name.
        numbers: Its numbers.
        without: Episodes of a rehearsal without transferred values; None where no world is known.
        most: Episodes that a rehearsal had at most.

    Returns:
        The sentence; None where a gain is foreseen, or no world is known.
    """
    ours = numbers.rehearsal
    if ours is None or without is None or ours < without:
        return None
    if without >= most:
        return (
            f"Nothing is foreseen of {name}, and its other numbers rank it: within {most:,} episodes the task's "
            "formula was learned in the model of the world neither from its values nor without any."
        )
    return (
        f"No gain is foreseen from {name}: its values need {episodes(ours, most)} to learn the task's formula in the "
        f"model of the world, and without any it takes {episodes(without, most)}."
    )


def episodes(number: float, most: float, digits: int = 3) -> str:
    """What a rehearsal took, in words: of one that did not get there only the least is known."""
    return f"at least {most:,} episodes" if number >= most else f"about {number:,.{digits - 3}f} episodes"


def _said(name: str, numbers: Numbers, most: float, digits: int = 3) -> str:
    value = getattr(numbers, name)
    return "" if value is None else _PHRASES[name].format(_text(name, value, most, digits))


def _text(name: str, value: float, most: float, digits: int) -> str:
    return episodes(value, most, digits) if name == "rehearsal" else f"{100 * value:.{digits}g} %"


def _digits(name: str, ours: float, theirs: float, most: float) -> int:
    """As many digits as tell two numbers apart."""
    apart = (d for d in range(3, _DIGITS) if _text(name, ours, most, d) != _text(name, theirs, most, d))
    return next(apart, _DIGITS)


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."
