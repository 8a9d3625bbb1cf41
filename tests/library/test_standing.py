from __future__ import annotations

import pytest

from tickwise.library.standing import ORDER, Numbers, key_of, reason_of

A, B, C = Numbers(0.62, 0.25, 0.031), Numbers(0.31, 0.125, 0.02), Numbers(0.31, 0.5, 0.02)


def test_the_greater_promise_and_the_smaller_others_come_first():
    assert sorted((C, B, A), key=lambda each: key_of(each, ORDER)) == [A, B, C]
    assert sorted((C, B, A), key=lambda each: key_of(each, ("dissimilarity",))) == [B, A, C]
    assert sorted((C, A, B), key=lambda each: key_of(each, ("distance", "promise"))) == [C, B, A]  # C and B tie


@pytest.mark.parametrize(
    ("place", "ranked", "order", "said"),
    [
        (
            0, (A, B), ORDER,
            "With its values the greedy policy satisfies the task's formula in 62 % of episodes before anything is "
            "learned, and with the second 31 %.",
        ),
        (
            1, (A, B), ORDER,
            "With its values the greedy policy satisfies the task's formula in 31 % of episodes before anything is "
            "learned, and with the first 62 %.",
        ),
        (
            1, (B, C), ORDER,
            "Its promise is that of the first, but its formula, moved onto the task's, disagrees with that in 50 % of "
            "what satisfies either, and with the first 12.5 %.",
        ),
        (
            1, (B, C), ("distance", "promise", "dissimilarity"),
            "Its distance and promise are those of the first, but its formula, moved onto the task's, disagrees with "
            "that in 50 % of what satisfies either, and with the first 12.5 %.",
        ),
        (1, (B, B), ORDER, "It has the same numbers as the first, and the names decide."),
        (
            0, (A,), ("distance",),
            "No other entry is transferable; once moved, its regions and windows differ from the fitted ones by 3.1 % "
            "of the world and the episode.",
        ),
        (
            0, (Numbers(None, 0.25, 0.1), Numbers(None, 0.5, 0.1)), ORDER,
            "Its formula, moved onto the task's, disagrees with that in 25 % of what satisfies either, and with the "
            "second 50 %.",
        ),
        (0, (Numbers(None, 0.25, 0.1),), ("promise",), "No other entry is transferable; it is alone."),
    ],
)  # fmt: skip
def test_why_in_one_sentence(place: int, ranked: tuple[Numbers, ...], order: tuple[str, ...], said: str):
    names = ("the first", "the second")
    found = reason_of(place, [*zip(names, ranked, strict=False)], order)
    assert found == said


def test_as_many_digits_as_tell_them_apart():
    found = reason_of(0, [("a", Numbers(0.62001, 0, 0)), ("b", Numbers(0.62, 0, 0))], ORDER)
    assert "in 62.001 % of episodes" in found
    assert found.endswith("and with b 62 %.")
