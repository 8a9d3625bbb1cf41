from __future__ import annotations

import pytest

from tickwise.library.standing import ORDER, Numbers, episodes, key_of, reason_of, warning_of

A, B, C = Numbers(900, 0.62, 0.25, 0.031), Numbers(900, 0.31, 0.125, 0.02), Numbers(900, 0.31, 0.5, 0.02)
FAST, SLOW, LOST = (Numbers(episodes, 0.5, 0.25, 0.1) for episodes in (1_240, 12_400, 20_000))


def test_the_greater_promise_and_the_smaller_others_come_first():
    assert sorted((C, B, A), key=lambda each: key_of(each, ORDER)) == [A, B, C]
    assert sorted((LOST, SLOW, A, FAST), key=lambda each: key_of(each, ORDER)) == [A, FAST, SLOW, LOST]
    assert sorted((A, FAST), key=lambda each: key_of(each, ("distance",))) == [A, FAST]
    assert sorted((C, B, A), key=lambda each: key_of(each, ("dissimilarity",))) == [B, A, C]
    assert sorted((C, A, B), key=lambda each: key_of(each, ("distance", "promise"))) == [C, B, A]  # C and B tie


@pytest.mark.parametrize(
    ("place", "ranked", "order", "said"),
    [
        (
            0, (FAST, SLOW), ORDER,
            "Its values need about 1,240 episodes to learn the task's formula in the model of the world, and with the "
            "second about 12,400 episodes.",
        ),
        (
            1, (SLOW, LOST), ORDER,
            "Its values need at least 20,000 episodes to learn the task's formula in the model of the world, and with "
            "the first about 12,400 episodes.",
        ),
        (
            0, (A, B), ORDER,
            "Its rehearsal is that of the second, but with its values the "
            "greedy policy satisfies the task's formula in 62 % of episodes before anything is "
            "learned, and with the second 31 %.",
        ),
        (
            1, (A, B), ("promise",),
            "With its values the greedy policy satisfies the task's formula in 31 % of episodes before anything is "
            "learned, and with the first 62 %.",
        ),
        (
            1, (B, C), ORDER,
            "Its rehearsal and promise are those of the first, but its formula, moved onto the task's, disagrees "
            "with that in 50 % of what satisfies either, and with the first 12.5 %.",
        ),
        (
            1, (B, C), ("distance", "promise", "dissimilarity"),
            "Its distance and promise are those of the first, but its formula, moved onto the task's, disagrees with "
            "that in 50 % of what satisfies either, and with the first 12.5 %.",
        ),
        (1, (B, B), ORDER, "It has the same numbers as the first, and the names decide."),
        (
            0, (A,), ("distance",),
            "No other entry is ranked; once moved, its regions and windows differ from the fitted ones by 3.1 % "
            "of the world and the episode.",
        ),
        (
            0, (Numbers(None, None, 0.25, 0.1), Numbers(None, None, 0.5, 0.1)), ORDER,
            "Its formula, moved onto the task's, disagrees with that in 25 % of what satisfies either, and with the "
            "second 50 %.",
        ),
        (
            0, (FAST,), ORDER,
            "No other entry is ranked; its values need about 1,240 episodes to learn the task's formula in the "
            "model of the world.",
        ),
        (0, (Numbers(None, None, 0.25, 0.1),), ("rehearsal",), "No other entry is ranked; it is alone."),
    ],
)  # fmt: skip
def test_why_in_one_sentence(place: int, ranked: tuple[Numbers, ...], order: tuple[str, ...], said: str):
    names = ("the first", "the second")
    found = reason_of(place, [*zip(names, ranked, strict=False)], order, most=20_000)
    assert found == said


def test_as_many_digits_as_tell_them_apart():
    found = reason_of(0, [("a", Numbers(0, 0.62001, 0, 0)), ("b", Numbers(0, 0.62, 0, 0))], ORDER)
    assert "in 62.001 % of episodes" in found
    assert found.endswith("and with b 62 %.")
    found = reason_of(0, [("a", Numbers(900.2, 0, 0, 0)), ("b", Numbers(900.4, 0, 0, 0))], ORDER)
    assert found.startswith("Its values need about 900.2 episodes")
    assert found.endswith("and with b about 900.4 episodes.")


def test_episodes_in_words():
    assert [episodes(number, 20_000) for number in (0, 1_240.0, 19_999, 20_000)] == [
        "about 0 episodes", "about 1,240 episodes", "about 19,999 episodes", "at least 20,000 episodes",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("numbers", "without", "said"),
    [
        (FAST, 1_260, None),
        (SLOW, 20_000, None),
        (Numbers(None, None, 0.25, 0.1), None, None),
        (
            FAST, 1_240,
            "No gain is foreseen from a: its values need about 1,240 episodes to learn the task's formula in the model "
            "of the world, and without any it takes about 1,240 episodes.",
        ),
        (
            LOST, 900,
            "No gain is foreseen from a: its values need at least 20,000 episodes to learn the task's formula in the "
            "model of the world, and without any it takes about 900 episodes.",
        ),
        (
            LOST, 20_000,
            "Nothing is foreseen of a, and its other numbers rank it: within 20,000 episodes the task's formula was "
            "learned in the model of the world neither from its values nor without any.",
        ),
    ],
)  # fmt: skip
def test_a_warning_where_no_gain_is_foreseen(numbers: Numbers, without: float | None, said: str | None):
    assert warning_of("a", numbers, without, 20_000) == said
