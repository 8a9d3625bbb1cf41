"""Compiled kernels of the search: the exact probability of a formula in SDNF under a prior.

These agree with the reference `tickwise.inference.information`, which walks tick tables; here the automaton fragments
are arithmetic, since the search changes windows and durations at every step.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.inference.kernels import EVENTUALLY, EVENTUALLY_ALWAYS, PriorArrays, Shape, inside
from tickwise.inference.numbering import place, roomier

_ADVANCE, _FAIL = -1, -2
# Unsigned, so that the compiled indexing need not ask whether an index counts from the end.
_index = np.uint64


@njit
def _eventual(nested: bool, times: NDArray[np.int64], count: int, holds: bool, tick: int) -> int:
    """One letter of a ◇ or ◇□ fragment: the next stay count, or that the fragment is satisfied or has failed."""
    if holds:
        if tick < times[0]:
            return 0
        if not nested or count >= times[2]:
            return _ADVANCE
        return count + 1
    return _FAIL if tick >= times[1] else 0


@njit
def _fragment(operator: int, times: NDArray[np.int64], count: int, holds: bool, tick: int) -> int:
    """One letter of a fragment; □ and □◇ are the duals of ◇ and ◇□ (¬□ρ is ◇¬ρ)."""
    nested = operator >= EVENTUALLY_ALWAYS
    if operator in (EVENTUALLY, EVENTUALLY_ALWAYS):
        return _eventual(nested, times, count, holds, tick)
    outcome = _eventual(nested, times, count, not holds, tick)
    if outcome == _ADVANCE:
        return _FAIL
    return _ADVANCE if outcome == _FAIL else outcome


@njit
def _assignments(
    prior: PriorArrays, shape: Shape, lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Measure of every joint truth assignment of n predicates under one independent draw, shape ``(2**n,)``.

    The measure of an intersection of boxes is a product over the variables; inclusion and exclusion give the rest.
    """
    n = len(shape.operators)
    measure = np.empty(2**n)
    for mask in range(2**n):
        product = 1.0
        for variable in range(len(prior.low)):
            low, high = prior.low[variable], prior.high[variable]
            width = high - low
            for j in range(n):
                if mask >> j & 1:
                    low, high = max(low, lower[j, variable]), min(high, upper[j, variable])
            product *= max(high - low, 0.0) / width
        measure[mask] = product
    for j in range(n):
        for mask in range(2**n):
            if not mask >> j & 1:
                measure[mask] = max(measure[mask] - measure[mask | 1 << j], 0.0)
    result = np.empty(2**n)
    for mask in range(2**n):
        letter = mask
        for j in range(n):
            if shape.complemented[j]:
                letter ^= 1 << j
        result[letter] = measure[mask]
    return result


@njit
def _letters(
    prior: PriorArrays, shape: Shape, lower: NDArray[np.float64], upper: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Truth of every predicate in every chain state, shape ``(n, states)``."""
    n = len(shape.operators)
    count = 2**n if prior.independent else len(prior.coordinates)
    letters = np.empty((n, count), dtype=np.bool_)
    for j in range(n):
        for state in range(count):
            if prior.independent:
                letters[j, state] = bool(state >> j & 1)
            else:
                letters[j, state] = inside(prior.coordinates[state], lower[j], upper[j]) != shape.complemented[j]
    return letters


@njit
def _codes(
    shape: Shape, times: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Number each disjunct's automaton states: (stage, stay count) pairs in order, then the failed state.

    Returns:
        Number of codes of each disjunct; first code of each primitive; stage and stay count of each code.
    """
    disjuncts = len(shape.starts) - 1
    sizes = np.empty(disjuncts, dtype=np.int64)
    first = np.empty(len(shape.operators), dtype=np.int64)
    for i in range(disjuncts):
        size = 0
        for j in range(shape.starts[i], shape.starts[i + 1]):
            first[j] = size
            size += 1 + (times[j, 2] if shape.operators[j] >= EVENTUALLY_ALWAYS else 0)
        sizes[i] = size + 1
    stage = np.full((disjuncts, sizes.max()), -1, dtype=np.int64)
    count = np.zeros((disjuncts, sizes.max()), dtype=np.int64)
    for i in range(disjuncts):
        for j in range(shape.starts[i], shape.starts[i + 1]):
            end = first[j + 1] if j + 1 < shape.starts[i + 1] else sizes[i] - 1
            for code in range(first[j], end):
                stage[i, code] = j
                count[i, code] = code - first[j]
    return sizes, first, stage, count


@njit
def _successors(
    shape: Shape,
    times: NDArray[np.int64],
    tick: int,
    code: int,
    codes: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]],
    after: NDArray[np.int64],
    reads: NDArray[np.int64],
) -> None:
    """Fill, for a product code, each disjunct's next code on a false and a true letter, and the predicate it reads.

    An accepted disjunct is ``_ADVANCE``, a failed one ``_FAIL``.
    """
    sizes, first, stage, count = codes
    for i in range(len(sizes)):
        part = code % sizes[i]
        code //= sizes[i]
        j = stage[i, part]
        reads[i] = j
        for bit in range(2):
            if j < 0:  # failed already
                after[i, bit] = _FAIL
                continue
            outcome = _fragment(shape.operators[j], times[j], count[i, part], bit == 1, tick)
            if outcome >= 0:
                after[i, bit] = first[j] + outcome
            elif outcome == _FAIL:
                after[i, bit] = _FAIL
            else:
                after[i, bit] = first[j + 1] if j + 1 < shape.starts[i + 1] else _ADVANCE


@njit
def _outcome(
    sizes: NDArray[np.int64],
    after: NDArray[np.int64],
    bits: int,
) -> int:
    """The product code after a letter, ``_ADVANCE`` if a disjunct is satisfied, ``_FAIL`` if all have failed."""
    target, stride, failed = 0, 1, 0
    for i in range(len(sizes)):
        part = after[i, bits >> i & 1]
        if part == _ADVANCE:
            return _ADVANCE
        if part == _FAIL:
            failed += 1
            part = sizes[i] - 1
        target += part * stride
        stride *= sizes[i]
    return _FAIL if failed == len(sizes) else target


@njit
def log_probability(
    prior: PriorArrays,
    shape: Shape,
    times: NDArray[np.int64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> float:
    """Log P that the weak verdict at the horizon is not FALSE, exactly; -inf where P is 0.

    Dynamic programming over (product of the disjuncts' automaton codes) x (chain states), from the first window's
    start on. Mass on acceptance leaves at once, times the weight of all its continuations; mass on failure is dropped.
    Only codes and states that carry mass are visited. A common factor is taken out where numbers get tiny, so that
    long horizons do not underflow.

    Args:
        prior: The prior's arrays, coordinates in the order of the box sides.
        shape: The fixed part of the formula.
        times: Windows and durations, shape ``(primitives, 3)``.
        lower: Lower box sides, shape ``(primitives, variables)``.
        upper: Upper box sides, shape ``(primitives, variables)``.

    Returns:
        The natural logarithm of the probability.
    """
    start = times[shape.starts[:-1], 0].min()
    if start > prior.horizon:
        return 0.0
    codes = _codes(shape, times)
    disjuncts = len(codes[0])
    letters = _letters(prior, shape, lower, upper)
    states = letters.shape[1]
    draws = _assignments(prior, shape, lower, upper) if prior.independent else prior.forward[start]
    # row k of `mass` is the mass of product code carried[k] before a letter, row k of `moved` that of fresh[k] after
    # it; both are zero outside the row's range (first state, one past the last state)
    carried, fresh = np.zeros(1, dtype=np.int64), np.zeros(8, dtype=np.int64)
    mass, moved = np.zeros((8, states)), np.zeros((8, states))
    mass_range, moved_range = np.zeros((8, 2), dtype=np.int64), np.zeros((8, 2), dtype=np.int64)
    mass[0], mass_range[0, 1] = draws, states
    after, reads = np.empty((disjuncts, 2), dtype=np.int64), np.empty(disjuncts, dtype=np.int64)
    outcomes, spans = np.empty(2**disjuncts, dtype=np.int64), np.empty((2**disjuncts, 2), dtype=np.int64)
    # which row of `moved` has which code: a table with room to spare, since of all codes few carry mass
    keys, rows = np.full(64, -1, dtype=np.int64), np.empty(64, dtype=np.int64)
    factor, accepted_log = 0.0, -np.inf
    # local names: a tuple of arrays handed to a function in a loop costs more than the loop
    independent, scale = prior.independent, prior.scale
    later = np.ones((1, states)) if independent else prior.backward
    indptr, indices, weights = prior.indptr, prior.indices, prior.weights
    for tick in range(start, prior.horizon + 1):
        used, accepted, largest = 0, 0.0, 0.0
        for k in range(len(carried)):
            if used + len(outcomes) > len(moved):  # one code has at most this many successors
                more = used + len(outcomes)
                fresh = np.concatenate((fresh, np.zeros(more, dtype=np.int64)))
                moved = np.concatenate((moved, np.zeros((more, states))))
                moved_range = np.concatenate((moved_range, np.zeros((more, 2), dtype=np.int64)))
                if len(keys) < 2 * len(moved):
                    keys, rows = roomier(len(moved), fresh[:used])
            _successors(shape, times, tick, carried[k], codes, after, reads)
            for bits in range(len(outcomes)):
                slot = _outcome(codes[0], after, bits)
                if slot >= 0:
                    at = place(keys, slot)
                    if keys[at] < 0:
                        keys[at], rows[at] = slot, used
                        fresh[used] = slot
                        moved_range[used, 0], moved_range[used, 1] = states, 0
                        used += 1
                    slot = rows[at]
                outcomes[bits] = slot
            gone, most = _read(mass[k], mass_range[k], letters, reads, outcomes, spans, moved, later[tick % len(later)])
            accepted += gone
            largest = max(largest, most)
            for bits in range(len(outcomes)):
                slot = outcomes[bits]
                if slot >= 0:
                    moved_range[slot, 0] = min(moved_range[slot, 0], spans[bits, 0])
                    moved_range[slot, 1] = max(moved_range[slot, 1], spans[bits, 1])
        keys[:] = -1
        used = _drop_empty(used, fresh, moved, moved_range)
        if tick == prior.horizon:  # what is still undecided counts as satisfied
            accepted += moved[:used].sum()
        if accepted > 0.0:
            accepted_log = np.logaddexp(accepted_log, factor + np.log(accepted))
        if used == 0 or tick == prior.horizon:
            break
        carried = fresh[:used].copy()
        if len(mass) < used:
            mass, mass_range = np.zeros((len(moved), states)), np.zeros((len(moved), 2), dtype=np.int64)
        share = 1.0
        if largest < 1e-100:
            share = 1.0 / largest
            factor += np.log(largest)
        if independent:
            _draw(share, draws, used, moved, mass, mass_range)
        else:
            _step(indptr, indices, weights, share / scale[tick], used, moved, moved_range, mass, mass_range)
    return min(accepted_log, 0.0)


@njit
def _read(
    mass: NDArray[np.float64],
    bounds: NDArray[np.int64],
    letters: NDArray[np.bool_],
    reads: NDArray[np.int64],
    outcomes: NDArray[np.int64],
    spans: NDArray[np.int64],
    moved: NDArray[np.float64],
    later: NDArray[np.float64],
) -> tuple[float, float]:
    """Let one code read a letter: move its mass to the codes after, and clear it.

    Fills ``spans`` with the range of states that gave each combination of letters.

    Returns:
        The mass that is accepted, with all its continuations; and the largest entry that was moved.
    """
    accepted, largest = 0.0, 0.0
    spans[:, 0], spans[:, 1] = len(mass), 0
    single = len(reads) == 1
    for state in range(_index(bounds[0]), _index(bounds[1])):
        weight = mass[state]
        if weight == 0.0:
            continue
        mass[state] = 0.0
        bits = _index(0)
        if single:
            bits = _index(letters[_index(reads[0]), state])
        else:
            for i in range(len(reads)):
                if reads[i] >= 0 and letters[_index(reads[i]), state]:
                    bits |= _index(1) << _index(i)
        slot = outcomes[bits]
        if slot >= 0:
            moved[_index(slot), state] += weight
            spans[bits, 0] = min(spans[bits, 0], np.int64(state))
            spans[bits, 1] = state + _index(1)
            if weight > largest:
                largest = weight
        elif slot == _ADVANCE:
            accepted += weight * later[state]
    return accepted, largest


@njit
def _drop_empty(
    used: int,
    fresh: NDArray[np.int64],
    moved: NDArray[np.float64],
    moved_range: NDArray[np.int64],
) -> int:
    """Keep the rows that got mass, in order; returns how many rows stay."""
    kept = 0
    for k in range(used):
        if moved_range[k, 0] >= moved_range[k, 1]:
            continue
        if kept < k:
            low, high = moved_range[k, 0], moved_range[k, 1]
            fresh[kept] = fresh[k]
            moved_range[kept, 0], moved_range[kept, 1] = low, high
            for state in range(low, high):
                moved[kept, state] = moved[k, state]
                moved[k, state] = 0.0
        kept += 1
    return kept


@njit
def _step(
    indptr: NDArray[np.int64],
    indices: NDArray[np.int64],
    weights: NDArray[np.float64],
    share: float,
    used: int,
    moved: NDArray[np.float64],
    moved_range: NDArray[np.int64],
    mass: NDArray[np.float64],
    mass_range: NDArray[np.int64],
) -> None:
    """Move the mass of the used rows one tick along the chain, times ``share``, and clear where it was."""
    for k in range(used):
        source, target = moved[k], mass[k]
        low, high = len(source), 0
        for state in range(_index(moved_range[k, 0]), _index(moved_range[k, 1])):
            weight = source[state] * share
            if weight != 0.0:
                source[state] = 0.0
                begin, end = _index(indptr[state]), _index(indptr[state + _index(1)])
                for edge in range(begin, end):
                    target[_index(indices[edge])] += weight * weights[edge]
                if begin < end:  # successors are sorted
                    low, high = min(low, indices[begin]), max(high, indices[end - _index(1)] + 1)
        mass_range[k, 0], mass_range[k, 1] = low, high


@njit
def _draw(
    share: float,
    draws: NDArray[np.float64],
    used: int,
    moved: NDArray[np.float64],
    mass: NDArray[np.float64],
    mass_range: NDArray[np.int64],
) -> None:
    """The step of independent ticks: all of a row's mass is dealt out anew."""
    for k in range(used):
        mass[k] = moved[k].sum() * share * draws
        mass_range[k, 0], mass_range[k, 1] = 0, len(draws)
        moved[k] = 0.0
