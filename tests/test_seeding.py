from __future__ import annotations

import hashlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickwise._seeding import generator, seed_sequence

paths = st.lists(st.one_of(st.integers(0, 1000), st.text(min_size=1, max_size=8)), max_size=4).map(tuple)


@given(st.integers(0, 2**64), paths)
def test_a_place_has_one_stream(seed: int, path: tuple[str | int, ...]):
    first, again = generator(seed, *path), generator(seed, *path)
    np.testing.assert_array_equal(first.random(3), again.random(3))
    np.testing.assert_array_equal(
        np.random.default_rng(seed_sequence(seed, *path)).random(3), generator(seed, *path).random(3)
    )


@given(st.integers(0, 2**64), paths, paths)
def test_two_places_have_two_streams(seed: int, one: tuple[str | int, ...], other: tuple[str | int, ...]):
    if one != other:
        assert generator(seed, *one).random() != generator(seed, *other).random()


def test_neighbours_differ():
    draws = {
        generator(seed, *path).random()
        for seed in (0, 1)
        for path in ((), (0,), (1,), ("1",), ("a", "b"), ("b", "a"), ("ab",), ("a", 0), ("a", 1))
    }
    assert len(draws) == 18


def test_the_tree_stays_where_it_is():
    """Published runs name their seeds: the way from a path to a stream may never change."""
    digest = hashlib.sha256(b'["case1", "learn", 4]').digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 32, 4)]
    wanted = np.random.SeedSequence(entropy=7, spawn_key=tuple(words))
    assert generator(7, "case1", "learn", 4).random() == np.random.default_rng(wanted).random()


def test_drawing_elsewhere_changes_nothing():
    expected = generator(3, "evaluate").random()
    generator(3, "learn").random(1000)
    seed_sequence(3).spawn(5)
    np.random.default_rng().random()
    assert generator(3, "evaluate").random() == expected


def test_it_is_numpys_pcg64():
    assert isinstance(generator(0).bit_generator, np.random.PCG64)


def test_a_negative_seed_is_refused():
    with pytest.raises(ValueError, match="non-negative"):
        seed_sequence(-1)
