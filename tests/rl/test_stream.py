"""The stream inside the loops is NumPy's own, and a generator goes on where its stream was left."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.rl.twins import random_problem
from tickwise._jit import njit
from tickwise.errors import ConfigurationError
from tickwise.rl.qlearning import QSettings, learn
from tickwise.rl.stream import put_back, take_stream, uniform

words = st.integers(0, 2**64 - 1)


@njit
def fill(stream: NDArray[np.uint64], numbers: NDArray[np.float64]) -> None:
    for i in range(len(numbers)):
        numbers[i] = uniform(stream)


def drawn(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """So many numbers by way of the stream, which is put back."""
    stream, numbers = take_stream(rng), np.empty(count)
    fill(stream, numbers)
    put_back(rng, stream)
    return numbers


@pytest.mark.parametrize("seed", range(4))
def test_millions_of_numbers_are_numpys(seed: int):
    ours, theirs = np.random.default_rng(seed), np.random.default_rng(seed)
    assert drawn(ours, 2_000_000).tobytes() == theirs.random(2_000_000).tobytes()
    assert ours.bit_generator.state == theirs.bit_generator.state
    assert ours.random() == theirs.random()


@settings(max_examples=300, deadline=None)
@given(words, words, words, words, st.integers(0, 40))
def test_any_state_and_increment(high: int, low: int, increment_high: int, increment_low: int, count: int):
    """Among them the states whose products carry from one word into the next."""
    ours, theirs = np.random.default_rng(0), np.random.default_rng(0)
    state = ours.bit_generator.state
    # an increment is odd
    state["state"] = {"state": high << 64 | low, "inc": (increment_high << 64 | increment_low) | 1}
    ours.bit_generator.state = theirs.bit_generator.state = state
    assert drawn(ours, count).tobytes() == theirs.random(count).tobytes()
    assert ours.bit_generator.state == theirs.bit_generator.state


def test_a_half_of_a_word_that_was_kept_stays():
    """A draw of 32 bits takes a word of 64 and keeps the other half for the next such draw."""
    ours, theirs = np.random.default_rng(7), np.random.default_rng(7)
    for count in (1, 3, 10, 1000):
        assert ours.integers(10, dtype=np.int32) == theirs.integers(10, dtype=np.int32)
        assert drawn(ours, count).tobytes() == theirs.random(count).tobytes()
        assert ours.bit_generator.state == theirs.bit_generator.state
    halves = [rng.integers(2**32, size=9, dtype=np.uint32).tobytes() for rng in (ours, theirs)]
    assert halves[0] == halves[1]


def test_taking_a_stream_leaves_the_generator():
    rng = np.random.default_rng(3)
    before = rng.bit_generator.state
    fill(take_stream(rng), np.empty(5))
    assert rng.bit_generator.state == before


@pytest.mark.parametrize("kind", [np.random.PCG64DXSM, np.random.MT19937, np.random.Philox, np.random.SFC64])
def test_another_generator_is_refused_by_name(kind: type[np.random.BitGenerator]):
    problem, chosen = random_problem(0), QSettings()
    with pytest.raises(ConfigurationError, match=f"the generator is of {kind.__name__}; use np.random.default_rng"):
        learn(problem, problem.initial_q(chosen), chosen, np.random.Generator(kind(0)), 1)
