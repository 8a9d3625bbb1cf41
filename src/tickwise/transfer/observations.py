"""Algorithm 2 for observations instead of tables: which of the source's a target's extended observation is like."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise.automata.mapping import bijections
from tickwise.automata.ticks import TickTable
from tickwise.envs.wrappers import ExtendedState, Labelled
from tickwise.envs.wrappers.forms import clipped, count_of, is_vector, observation_of
from tickwise.errors import ConfigurationError
from tickwise.logic.semantics import holds
from tickwise.logic.syntax import Box, Predicate
from tickwise.transfer.qtransfer import check_copies, most_alike, similar_valuations

Landmarks = tuple[Sequence[NDArray[np.float64]], Sequence[NDArray[np.float64]]]
"""What is compared relative to in the source and in the target, for each disjunct ``(primitives, features)``."""

_MOST_CANDIDATES = 100_000
"""A source with more observations is not searched through for the most alike."""


class ObservationMap:
    """For each extended observation of a target task the one of the source task that is most like it (Algorithm 2).

    Location and clocks go by the bijections ξ_Q and ξ_C, clocks to the nearest valuation (lines 7 to 11). The rest
    goes by where its features lie relative to the primitive that is worked on (line 6): where the source has finitely
    many observations, to the one whose features lie most alike; where features are the entries of a vector, by
    moving them and cutting off at the source's bounds; and else as `move` says.

    It serves agents that are no tables over worlds that are tables: give a `QTable` its initial values by it, or an
    agent of Stable-Baselines3 by `tickwise.transfer.deep.transfer_values`.

    ```python
    likeness = ObservationMap(source, target)
    q = QTable(4, initial=lambda observation: source_q.row(likeness(observation)))
    ```

    Args:
        source: The source task's environment, extended by φ^S.
        target: The target task's environment, extended by φ^T.
        landmarks: What features are compared relative to, as `tickwise.transfer.landmarks` gives it from
            trajectories; by default the centres of the regions, of a region that is open to one side its bound, and
            where it leaves a feature open, the feature is compared as it is.
        move: Takes an observation of the target, not extended, and a displacement, shape ``(features,)``; gives the
            source's observation whose features are nearest to the target's and the displacement together.

    Attributes:
        source: The source task's environment.
        target: The target task's environment.

    Raises:
        AutomatonError: If φ^T is not structurally transferable from φ^S (Definition 7).
        ConfigurationError: If the features differ, or observations cannot be mapped without `move`.
    """

    def __init__(
        self,
        source: ExtendedState,
        target: ExtendedState,
        landmarks: Landmarks | None = None,
        move: Callable[[Any, NDArray[np.float64]], Any] | None = None,
    ) -> None:
        _check(source, target)
        self.source, self.target = source, target
        self._move = move
        self._candidates = _candidates(source, target) if move is None else None
        self._features_of = _labelled(target).features_of if move is None else None
        self._similar: list[int] = []  # for each of the target's table states the source's
        self._pairs: list[_Pair] = []  # and what the rest of the observation is compared relative to
        sources = source.monitor.tables
        for i, table in enumerate(target.monitor.tables):  # line 2
            i_hat = i % len(sources)  # line 4
            xi = bijections(table.automaton, sources[i_hat].automaton)
            similar = similar_valuations(sources[i_hat], table, xi)  # lines 7 to 11
            self._similar += source.places.number(np.asarray(i_hat), similar).tolist()
            centres = None if landmarks is None else (landmarks[0][i_hat], landmarks[1][i])
            pairs = _pairs(sources[i_hat], table, source.monitor.variables, centres)
            self._pairs += [pairs[stage] for stage in table.stage]  # line 3

    def __call__(self, observation: Any) -> Any:
        """The source's extended observation most like one of the target.

        Raises:
            DataError: If it is no extended observation of the target.
        """
        plain, number = self.target.split(observation)
        return self.source.extend(self._like(plain, self._pairs[number]), self._similar[number])

    def _like(self, observation: Any, pair: _Pair) -> Any:
        """Line 6: the source's observation that lies most alike relative to the primitive that is worked on."""
        if self._move is not None:
            return self._move(observation, pair.near - pair.far)
        space, names = self.source.env.observation_space, self.source.monitor.variables
        if self._candidates is None:
            return clipped(space, np.asarray(observation) + (pair.near - pair.far))
        assert self._features_of is not None
        features = self._features_of(observation)[None, :]
        differs = holds(pair.target, features, names)[:, None] != holds(pair.source, self._candidates, names)
        return observation_of(space, int(most_alike(self._candidates - pair.near, features - pair.far, differs)[0]))


@dataclass(frozen=True, slots=True, eq=False)
class _Pair:
    """Two primitives' predicates, and what features are compared relative to in both tasks."""

    source: Predicate
    target: Predicate
    near: NDArray[np.float64]
    far: NDArray[np.float64]


def _pairs(
    source: TickTable,
    target: TickTable,
    names: Sequence[str],
    landmarks: tuple[NDArray[np.float64], NDArray[np.float64]] | None,
) -> list[_Pair]:
    """What is compared while each primitive is worked on."""
    ours, theirs = (table.automaton.conjunction.primitives for table in (source, target))
    if landmarks is None:
        centres = [_centres(near.box, far.box, names) for near, far in zip(ours, theirs, strict=True)]
    else:
        centres = list(zip(*landmarks, strict=True))
    predicates = zip(source.automaton.predicates, target.automaton.predicates, strict=True)
    return [_Pair(*pair, *centre) for pair, centre in zip(predicates, centres, strict=True)]


def _check(source: ExtendedState, target: ExtendedState) -> None:
    for name, env in (("source", source), ("target", target)):
        if not isinstance(env, ExtendedState):
            raise ConfigurationError(f"the {name} is no ExtendedState; wrap it, with the formula of its task, last")
    check_copies(source.monitor.tables, target.monitor.tables)
    if source.monitor.variables != target.monitor.variables:
        raise ConfigurationError(
            f"the source's features are {', '.join(source.monitor.variables)} and the target's "
            f"{', '.join(target.monitor.variables)}; transfer compares them, so use the same in both"
        )


def _labelled(env: ExtendedState) -> Labelled:
    """What names the features, if its observation is the one that the extended state is made of."""
    below: Any = env.env
    while not isinstance(below, Labelled) and hasattr(below, "env"):
        below = below.env
    if not isinstance(below, Labelled) or below.observation_space != env.env.observation_space:
        raise ConfigurationError(
            "the features are not those of the observation that is extended, so it cannot be mapped by them; "
            "give move, a function of an observation and a displacement"
        )
    return below


def _candidates(source: ExtendedState, target: ExtendedState) -> NDArray[np.float64] | None:
    """The features of all the source's observations, shape ``(observations, features)``; None to move entries."""
    space, ours, theirs = source.env.observation_space, _labelled(source), _labelled(target)
    count = count_of(space)
    if count is not None and count <= _MOST_CANDIDATES:
        return np.array([ours.features_of(observation_of(space, number)) for number in range(count)])
    if is_vector(space) and ours.by_entry and theirs.by_entry:
        return None
    raise ConfigurationError(
        f"an observation in {space} is neither one of at most {_MOST_CANDIDATES} nor a vector whose entries are the "
        "features; give move, a function of an observation and a displacement"
    )


def _centres(source: Box, target: Box, names: Sequence[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places to compare relative to in two regions of the same shape, each of shape ``(features,)``."""
    near, far = np.zeros((2, len(names)))
    bounds = {bound.variable: bound for bound in source.bounds}
    for theirs in target.bounds:
        ours = bounds.get(theirs.variable)
        if ours is None:
            continue
        column = names.index(theirs.variable)
        ends = np.array([[ours.lower, ours.upper], [theirs.lower, theirs.upper]])
        finite = np.isfinite(ends).all(axis=0)
        if finite.any():
            near[column], far[column] = ends[:, finite].mean(axis=1)
    return near, far
