"""Transfer of extended Q-functions beyond Algorithm 2, each step of it a switch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError, DataError
from tickwise.rl.qlearning import Problem
from tickwise.transfer.likeness import Match, Side, matches
from tickwise.transfer.qtransfer import centroids, check_transfer

Landmarks = tuple[Sequence[NDArray[np.float64]], Sequence[NDArray[np.float64]]]
"""What is compared relative to in the source and in the target, for each disjunct ``(primitives, variables)``."""


@dataclass(frozen=True, slots=True)
class Confidence:
    """How far a transferred value is trusted, in updates that it counts for.

    It is ``most · n / (n + visits) · reach / (reach + d)`` for a value that the source updated n times and that comes
    from a distance d (see `tickwise.transfer.likeness.Match`).

    Attributes:
        most: The most that it can be.
        visits: The source's updates at which it is half of that.
        reach: The distance at which it is half of that.

    Raises:
        ConfigurationError: If a number is not above 0.
    """

    most: float = 1.0
    visits: float = 10.0
    reach: float = 1.0

    def __post_init__(self) -> None:
        for name in ("most", "visits", "reach"):
            if not 0 < getattr(self, name) < np.inf:
                raise ConfigurationError(f"{name} of a confidence is {getattr(self, name)}; use a number above 0")

    def of(self, visits: NDArray[np.uint32], distance: NDArray[np.float64]) -> NDArray[np.float32]:
        """The confidence in values with so many updates, from such a distance."""
        seen = visits / (visits + self.visits)
        return np.asarray(self.most * seen * (self.reach / (self.reach + distance)), dtype=np.float32)


@dataclass(frozen=True, slots=True)
class Transfer:
    """How values are transferred; all defaults together are Algorithm 2.

    Attributes:
        visited: Take values only from entries (memory state, state, action) that the source updated: the nearest one,
            in position relative to the region's landmark, then in clocks. Where the location has none for an action,
            Algorithm 2's.
        within: The farthest that such an entry may lie beyond Algorithm 2's; where all are farther, Algorithm 2's is
            taken, visited or not.
        progress: Compare clocks by how far they are through their windows and durations, instead of by their values;
            see `tickwise.transfer.progress.progress_valuations`.
        travel: Where a state lies off the place that it is like, for instance beyond the source's border, take the
            value of that place for when one would get there: as many ticks later as the way takes.
        confidence: How far transferred values are trusted; None for not at all.

    Raises:
        ConfigurationError: If ``within`` is negative.
    """

    visited: bool = False
    within: float = np.inf
    progress: bool = False
    travel: bool = False
    confidence: Confidence | None = None

    def __post_init__(self) -> None:
        if not self.within >= 0:
            raise ConfigurationError(f"within is {self.within}; use a distance of 0 or more")

    @property
    def needs_visits(self) -> bool:
        """Whether the source's learning has to count what it updates."""
        return self.visited or self.confidence is not None


@dataclass(frozen=True, slots=True, eq=False)
class Transferred:
    """What a target begins with.

    Attributes:
        q: Q̄^T, float32, shape ``(target memory states, target states, actions)``.
        confidence: The confidence in each value, float32, of the same shape; 0 where none is wanted.
    """

    q: NDArray[np.float32]
    confidence: NDArray[np.float32]


def transfer(
    source: Problem,
    q: NDArray[np.float32],
    visits: NDArray[np.uint32] | None,
    target: Problem,
    initial: float,
    how: Transfer | None = None,
    landmarks: Landmarks | None = None,
) -> Transferred:
    """Transfer an extended Q-function from the source to the target task.

    Args:
        source: The source, whose memory is that of φ^S.
        q: Q̄^S*, shape ``(source memory states, source states, actions)``.
        visits: How often each entry was updated, of the same shape, as `tickwise.rl.trusting.TrustingLearner` counts;
            None where nothing asks for it.
        target: The target, whose memory is that of φ^T.
        initial: The value of table states that no episode learns in (the start, before the first letter).
        how: The switches; None for Algorithm 2.
        landmarks: What places are compared relative to; see `tickwise.transfer.qtransfer.transfer_q`.

    Returns:
        Values and confidence, for `tickwise.rl.trusting.Trusting` or any other form of learning to begin with.

    Raises:
        DataError: As `transfer_q`, or if visits are needed and there are none, or of another shape.
        AutomatonError: If φ^T is not structurally transferable from φ^S.
    """
    how = how or Transfer()
    check_transfer(source.mdp, source.memory, q, target.mdp, target.memory)
    counts = _checked(visits, q, how)
    shape = (target.memory.n_states, target.mdp.n_states, target.mdp.n_actions)
    result = Transferred(np.full(shape, initial, dtype=np.float32), np.zeros(shape, dtype=np.float32))
    actions = np.arange(target.mdp.n_actions)
    for i, table in enumerate(target.memory.tables):
        i_hat = i % len(source.memory.tables)
        origin, first = source.memory.tables[i_hat], source.memory.offsets[i_hat]
        near = centroids(origin, source.mdp) if landmarks is None else landmarks[0][i_hat]
        far = centroids(table, target.mdp) if landmarks is None else landmarks[1][i]
        sides = Side(source.mdp, origin, near), Side(target.mdp, table, far)
        rows = slice(first, first + len(origin))
        for u, match in _matches(*sides, counts[rows], how):
            entry = (match.memory, match.state, actions)
            result.q[target.memory.offsets[i] + u] = q[rows][entry]
            if how.confidence is not None:
                trust = how.confidence.of(counts[rows][entry], match.distance)
                result.confidence[target.memory.offsets[i] + u] = trust
    return result


def _matches(source: Side, target: Side, visits: NDArray[np.uint32], how: Transfer) -> Iterator[tuple[int, Match]]:
    """For each table state of the target its match, of one layer for all actions or one for each."""
    everything = np.ones((*visits.shape[:2], 1), dtype=np.bool_)
    plain = matches(source, target, everything, progress=how.progress, travel=how.travel)
    if not how.visited:
        yield from plain
        return
    among = matches(source, target, visits > 0, progress=how.progress, travel=how.travel)
    for (u, first), (_, other) in zip(plain, among, strict=True):
        far = other.distance - first.distance > how.within
        yield u, Match(*(np.where(far, getattr(first, name), getattr(other, name)) for name in Match.__slots__))


def _checked(visits: NDArray[np.uint32] | None, q: NDArray[np.float32], how: Transfer) -> NDArray[np.uint32]:
    """The visits; zeros where nothing asks for them."""
    if visits is None:
        if how.needs_visits:
            raise DataError("what was visited is not known; give the visits of learning in the source")
        return np.zeros(q.shape, dtype=np.uint32)
    if visits.shape != q.shape:
        raise DataError(f"the visits have shape {visits.shape} and the source's Q-function {q.shape}; use the same")
    return visits
