"""The forms in which location and clocks join an observation: a dictionary, one flat vector, or one number."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from tickwise.automata.monitor import Monitor
from tickwise.errors import ConfigurationError, DataError

_MOST_NUMBERS = 2**62
"""As many observations, or more, are not numbered."""

_PLAIN = (spaces.Box, spaces.Discrete, spaces.MultiDiscrete, spaces.MultiBinary)


@dataclass(frozen=True, slots=True, eq=False)
class Places:
    """Locations and clocks of all disjuncts in one numbering.

    Attributes:
        locations: How many locations there are, those of one disjunct after those of another.
        clocks: The greatest number of clocks of a disjunct.
        longest: The greatest value of a clock, in ticks, and at least 1.
        first_location: The number of each disjunct's first location, shape ``(disjuncts,)``.
        first_state: The number of each disjunct's first table state, shape ``(disjuncts,)``.
        location_of: The location of each table state, shape ``(table states,)``.
        clocks_of: The clock values of each table state, 0 where a disjunct has fewer clocks, shape ``(table states,
            clocks)``.
        stage_of: The primitive that each table state works on, shape ``(table states,)``.
    """

    locations: int
    clocks: int
    longest: int
    first_location: NDArray[np.int64]
    first_state: NDArray[np.int64]
    location_of: NDArray[np.int64]
    clocks_of: NDArray[np.int64]
    stage_of: NDArray[np.int64]

    @classmethod
    def of(cls, monitor: Monitor) -> Places:
        """Number the locations and the table states of a monitor's disjuncts."""
        tables = monitor.tables
        sizes = [len(table.automaton.locations) for table in tables]
        first_location = np.concatenate([[0], np.cumsum(sizes)])[:-1]
        first_state = np.concatenate([[0], np.cumsum([len(table) for table in tables])])
        width = max(table.clocks.shape[1] for table in tables)
        clocks = np.zeros((first_state[-1], width), dtype=np.int64)
        for first, table in zip(first_state, tables, strict=False):
            clocks[first : first + len(table), : table.clocks.shape[1]] = table.clocks
        location = np.concatenate([first + table.location for first, table in zip(first_location, tables, strict=True)])
        stages = np.concatenate([table.stage for table in tables]).astype(np.int64)
        longest = max(1, int(clocks.max(initial=0)))
        return cls(
            sum(sizes), width, longest, first_location, first_state[:-1], location.astype(np.int64), clocks, stages
        )

    def number(self, disjunct: NDArray[np.int64], state: NDArray[np.int64]) -> NDArray[np.int64]:
        """The number of a disjunct's table state among all."""
        return np.asarray(self.first_state[disjunct] + state, dtype=np.int64)

    def find(self, location: int, clocks: NDArray[Any]) -> int:
        """The number of the table state with a location and clock values.

        Raises:
            DataError: If the automata have none.
        """
        same = (self.location_of == location) & (self.clocks_of == clocks).all(axis=1)
        found = np.flatnonzero(same)
        if not len(found):
            raise DataError(f"no automaton has location {location} with clocks {clocks}; give an extended observation")
        return int(found[-1])  # the start, before the first letter, comes before all others and is never observed


@dataclass(frozen=True, slots=True, eq=False)
class Form:
    """A form of the extended state.

    Attributes:
        space: The space of extended observations.
        extend: Joins an observation and the number of a table state, for one environment or with a first axis for many.
        split: Takes one extended observation apart again.
    """

    space: gymnasium.Space[Any]
    extend: Callable[[Any, NDArray[np.int64]], Any]
    split: Callable[[Any], tuple[Any, int]]


def make_form(form: str, space: gymnasium.Space[Any], places: Places) -> Form:
    """A form of the extended state.

    Args:
        form: ``"dict"``, ``"flat"`` or ``"discrete"``.
        space: The space of the observations.
        places: The locations and clocks of the formula's automata.

    Returns:
        The space of extended observations, and how they are made and taken apart.

    Raises:
        ConfigurationError: If there is no such form, or the observation does not allow it.
    """
    forms = {"dict": _as_dict, "flat": _as_flat, "discrete": _as_discrete}
    if form not in forms:
        raise ConfigurationError(f"there is no form {form!r}; use one of {', '.join(map(repr, forms))}")
    return forms[form](space, places)


def _as_dict(space: gymnasium.Space[Any], places: Places) -> Form:
    inner = dict(space.spaces) if isinstance(space, spaces.Dict) else {"observation": space}
    taken = {"location", "clocks"} & inner.keys()
    if taken:
        raise ConfigurationError(
            f"the observation has an entry {min(taken)!r} already; rename it, or use another form than 'dict'"
        )
    shape = (places.clocks,)
    extended = spaces.Dict(
        inner
        | {
            "location": spaces.Discrete(places.locations),
            "clocks": spaces.Box(0, places.longest, shape, dtype=np.float32),
        }
    )

    def extend(observation: Any, number: NDArray[np.int64]) -> dict[str, Any]:
        entries = dict(observation) if isinstance(space, spaces.Dict) else {"observation": observation}
        location = places.location_of[number]
        return entries | {"location": location, "clocks": places.clocks_of[number].astype(np.float32)}

    def split(observation: Any) -> tuple[Any, int]:
        rest = {key: observation[key] for key in inner}
        number = places.find(int(observation["location"]), observation["clocks"])
        return rest if isinstance(space, spaces.Dict) else rest["observation"], number

    return Form(extended, extend, split)


def _as_flat(space: gymnasium.Space[Any], places: Places) -> Form:
    inner = _flat_box(space)
    low = np.concatenate([inner.low, np.zeros(places.locations + places.clocks, np.float32)])
    high = np.concatenate([inner.high, np.ones(places.locations + places.clocks, np.float32)])
    one_hot = np.eye(places.locations, dtype=np.float32)

    def extend(observation: Any, number: NDArray[np.int64]) -> NDArray[np.float32]:
        clocks = (places.clocks_of[number] / places.longest).astype(np.float32)
        return np.concatenate([_flat(space, observation), one_hot[places.location_of[number]], clocks], axis=-1)

    def split(observation: Any) -> tuple[Any, int]:
        rest, location, clocks = np.split(observation, [inner.shape[0], inner.shape[0] + places.locations])
        number = places.find(int(location.argmax()), np.rint(clocks * places.longest))
        return spaces.unflatten(space, rest), number

    return Form(spaces.Box(low, high, dtype=np.float32), extend, split)


def _as_discrete(space: gymnasium.Space[Any], places: Places) -> Form:
    count, number_of = numbering(space, "form='discrete'")
    states = len(places.location_of) * count
    if states >= _MOST_NUMBERS:
        raise ConfigurationError(f"form='discrete' would number {states} extended states; use another form")

    def extend(observation: Any, number: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.asarray(number * count + number_of(observation))[()]

    def split(observation: Any) -> tuple[Any, int]:
        number, rest = divmod(int(observation), count)
        return observation_of(space, rest), number

    return Form(spaces.Discrete(states), extend, split)


def numbering(space: gymnasium.Space[Any], what: str) -> tuple[int, Callable[[Any], NDArray[np.int64]]]:
    """How many observations a finite space has, and the number of each.

    Args:
        space: A Discrete or a MultiDiscrete space.
        what: What needs it.

    Returns:
        The count, and a function from observations to numbers from 0; it keeps axes before an observation's own.

    Raises:
        ConfigurationError: If the space is not finite.
    """
    count = count_of(space)
    if count is None:
        raise ConfigurationError(
            f"{what} needs observations that are whole numbers, a Discrete or MultiDiscrete space, not {space}; use "
            "another form, or map the observation with gymnasium.wrappers.TransformObservation"
        )
    if isinstance(space, spaces.Discrete):
        return count, lambda observation: _counted(space, observation)
    if count >= _MOST_NUMBERS:
        raise ConfigurationError(f"{what} needs observations that can be numbered, and there are {count}")
    assert isinstance(space, spaces.MultiDiscrete)
    places = np.concatenate([np.cumprod(space.nvec[::-1], dtype=np.int64)[::-1][1:], [1]])
    return count, lambda observation: _counted(space, observation) @ places


def count_of(space: gymnasium.Space[Any]) -> int | None:
    """How many observations a space has, or None if they have no numbers."""
    if isinstance(space, spaces.Discrete):
        return int(space.n)
    if isinstance(space, spaces.MultiDiscrete) and len(space.shape) == 1:
        return int(math.prod(space.nvec.tolist()))
    return None


def is_vector(space: gymnasium.Space[Any]) -> bool:
    """Whether observations are vectors of real numbers."""
    return isinstance(space, spaces.Box) and len(space.shape) == 1


def clipped(space: gymnasium.Space[Any], values: NDArray[Any]) -> NDArray[Any]:
    """The observation of a space of arrays that is nearest to some values."""
    assert isinstance(space, spaces.Box)
    return np.asarray(np.clip(values, space.low, space.high), dtype=space.dtype)


def observation_of(space: gymnasium.Space[Any], number: int) -> Any:
    """The observation that has a number in a finite space, see `numbering`."""
    if isinstance(space, spaces.MultiDiscrete):
        entries = np.unravel_index(number, tuple(space.nvec))
        return np.asarray(entries, dtype=space.dtype) + space.start
    assert isinstance(space, spaces.Discrete)
    return np.int64(number + space.start)


def _counted(space: spaces.Discrete | spaces.MultiDiscrete, observation: Any) -> NDArray[np.int64]:
    """Whole numbers from 0 instead of from where the space starts; what lies outside it is refused."""
    _leading(space, observation)
    entries = np.asarray(observation, dtype=np.int64) - space.start
    sizes = space.n if isinstance(space, spaces.Discrete) else space.nvec
    if ((entries < 0) | (entries >= sizes)).any():
        raise DataError(f"the observation {observation!r} is not in {space}; correct the environment or its space")
    return np.asarray(entries, dtype=np.int64)


def _flat_box(space: gymnasium.Space[Any]) -> spaces.Box:
    """The space of an observation as one vector of float32."""
    flat = spaces.flatten_space(space) if all(isinstance(part, _PLAIN) for part in _parts(space)) else None
    if not isinstance(flat, spaces.Box):
        raise ConfigurationError(f"an observation in {space} is no vector when flattened; use form='dict'")
    with np.errstate(over="ignore"):  # a bound beyond float32 is none
        low, high = flat.low.astype(np.float32), flat.high.astype(np.float32)
    return spaces.Box(low, high, dtype=np.float32)


def _parts(space: gymnasium.Space[Any]) -> list[gymnasium.Space[Any]]:
    """The spaces that dictionaries and tuples are made of."""
    if isinstance(space, (spaces.Dict, spaces.Tuple)):
        inner = space.spaces.values() if isinstance(space, spaces.Dict) else space.spaces
        return [part for each in inner for part in _parts(each)]
    return [space]


def _flat(space: gymnasium.Space[Any], observation: Any) -> NDArray[np.float32]:
    """What `gymnasium.spaces.flatten` gives, also with a first axis for many."""
    if isinstance(space, spaces.Discrete):
        return np.asarray(np.eye(int(space.n), dtype=np.float32)[_counted(space, observation)])
    if isinstance(space, spaces.MultiDiscrete):
        entries = _counted(space, observation).reshape(*_leading(space, observation), -1)
        parts = [np.eye(n, dtype=np.float32)[entries[..., i]] for i, n in enumerate(space.nvec.ravel())]
        return np.concatenate(parts, axis=-1)
    if isinstance(space, spaces.Dict):
        return np.concatenate([_flat(part, observation[key]) for key, part in space.spaces.items()], axis=-1)
    if isinstance(space, spaces.Tuple):
        parts = [_flat(part, each) for part, each in zip(space.spaces, observation, strict=True)]
        return np.concatenate(parts, axis=-1)
    values = np.asarray(observation, dtype=np.float32)
    return values.reshape(*_leading(space, values), -1)


def _leading(space: gymnasium.Space[Any], observation: Any) -> tuple[int, ...]:
    """The axes before an observation's own."""
    shape, own = np.shape(observation), tuple(space.shape or ())
    if shape[len(shape) - len(own) :] != own:
        raise DataError(f"an observation of shape {shape} is not in {space}; correct the environment or its space")
    return tuple(shape[: len(shape) - len(own)])
