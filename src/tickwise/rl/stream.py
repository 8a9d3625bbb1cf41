"""NumPy's PCG64 for compiled loops: the numbers that ``Generator.random`` gives, without a call for each of them.

A stream is four words: the upper and lower half of the generator's state, then those of its increment. A loop that
is given the stream of a generator and put back afterwards leaves the generator where as many calls of ``random``
would have left it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.errors import ConfigurationError

_WORD = 2**64
_HALF = np.uint64(0xFFFFFFFF)
_MULTIPLIER_HIGH = np.uint64(0x2360ED051FC65DA4)
_MULTIPLIER_LOW = np.uint64(0x4385DF649FCCF645)
_11, _32, _58, _63, _64 = (np.uint64(shift) for shift in (11, 32, 58, 63, 64))
_UNIT = 2.0**-53


def take_stream(rng: np.random.Generator) -> NDArray[np.uint64]:
    """The stream of a generator, shape ``(4,)``; the generator itself is left as it is.

    Raises:
        ConfigurationError: If the generator is not one of PCG64.
    """
    kind = type(rng.bit_generator).__name__
    if kind != "PCG64":
        raise ConfigurationError(
            f"learning draws from PCG64, and the generator is of {kind}; use np.random.default_rng"
        )
    state = rng.bit_generator.state["state"]
    return np.array([half for name in ("state", "inc") for half in divmod(state[name], _WORD)], dtype=np.uint64)


def put_back(rng: np.random.Generator, stream: NDArray[np.uint64]) -> None:
    """Let a generator go on where its stream is; a half of a word that it keeps for later stays."""
    state = rng.bit_generator.state
    state["state"]["state"] = int(stream[0]) * _WORD + int(stream[1])
    rng.bit_generator.state = state


@njit
def _high_word(a: np.uint64, b: np.uint64) -> np.uint64:
    """The upper 64 bits of the product of two words."""
    a_low, a_high, b_low, b_high = a & _HALF, a >> _32, b & _HALF, b >> _32
    middle = a_high * b_low + (a_low * b_low >> _32)
    other = a_low * b_high + (middle & _HALF)
    return a_high * b_high + (middle >> _32) + (other >> _32)


@njit
def uniform(stream: NDArray[np.uint64]) -> float:
    """The next number in [0, 1): a step of the 128-bit congruential generator, folded and rotated (XSL RR)."""
    high, low = stream[0], stream[1]
    product = low * _MULTIPLIER_LOW
    high = _high_word(low, _MULTIPLIER_LOW) + high * _MULTIPLIER_LOW + low * _MULTIPLIER_HIGH + stream[2]
    low = product + stream[3]
    high += np.uint64(low < product)
    stream[0], stream[1] = high, low
    folded, rotation = high ^ low, high >> _58
    bits = (folded >> rotation) | (folded << (_64 - rotation & _63))
    return np.float64(np.int64(bits >> _11)) * _UNIT
