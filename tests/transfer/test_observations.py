from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.wrappers import FlattenObservation, TransformObservation

from tests.envs.wrappers.worlds import random_episodes
from tickwise.envs.enumeration import tabulate
from tickwise.envs.wrappers import ExtendedState, Labelled
from tickwise.errors import AutomatonError, ConfigurationError, DataError
from tickwise.rl.states import automaton_memory
from tickwise.transfer.observations import ObservationMap
from tickwise.transfer.qtransfer import transfer_q

NEAR = "F[0,5] G[0,2] (0 <= row <= 1 & 1 <= column <= 2) & F[9,12] (3 <= row <= 3 & 2 <= column <= 3)"
FAR = "F[1,6] G[0,3] (0 <= row <= 1 & 3 <= column <= 5) & F[11,14] (5 <= row <= 6 & 4 <= column <= 6)"
BALANCE = "F[0,5] G[0,2] ({} <= position <= {}) & F[9,12] (angle >= {})"


def features(size: int) -> dict[str, Any]:
    return {"row": lambda s: s // size, "column": lambda s: s % size}


def lake(size: int) -> Labelled:
    rows = ["S" + "F" * (size - 1), *["F" * size] * (size - 2), "F" * (size - 1) + "G"]
    return Labelled(gymnasium.make("FrozenLake-v1", desc=rows, is_slippery=False), features(size))


def cart_pole() -> Labelled:
    return Labelled(gymnasium.make("CartPole-v1"), ["position", "velocity", "angle", "turning"])


@pytest.mark.parametrize("form", ["dict", "flat", "discrete"])
@pytest.mark.parametrize(
    ("source", "target"),
    [(NEAR, FAR), (NEAR, f"{FAR} | {NEAR}"), (f"{NEAR} | {NEAR}", f"{FAR} | {NEAR} | {NEAR} | {FAR}")],
    ids=["one", "one to two", "two to four"],
)
def test_on_a_world_that_is_a_table_it_is_algorithm_2(source: str, target: str, form: str):
    envs = [ExtendedState(lake(size), text, form, reduce=False) for size, text in ((4, source), (7, target))]
    mdps = [tabulate(lake(size).env, features(size)).mdp for size in (4, 7)]  # states are the cells, in order
    memories = [automaton_memory(mdp, env.monitor.tables) for mdp, env in zip(mdps, envs, strict=True)]
    # each entry tells its own place
    q = np.arange(memories[0].n_states * 16 * 4, dtype=np.float32).reshape(-1, 16, 4)
    wanted = transfer_q(mdps[0], memories[0], q, mdps[1], memories[1], initial=-1)
    likeness = ObservationMap(*envs)
    observed = np.setdiff1d(np.arange(memories[1].n_states), memories[1].offsets)  # all but before the first letter
    for number in np.random.default_rng(0).permutation(observed)[:60]:
        for cell in range(49):
            plain, table_state = envs[0].split(likeness(envs[1].extend(cell, int(number))))
            np.testing.assert_array_equal(q[table_state, int(plain)], wanted[number, cell])


def test_entries_of_a_vector_are_moved_and_cut_off_at_the_sources_bounds():
    source = ExtendedState(cart_pole(), BALANCE.format(0.1, 0.3, 0.02), "flat")
    target = ExtendedState(cart_pole(), BALANCE.format(0.5, 0.9, -0.03), "flat")
    likeness = ObservationMap(source, target)
    observation = np.array([0.75, 0.4, 0.05, -0.2], dtype=np.float32)
    for table_state, moved in ((1, [0.25, 0.4, 0.05, -0.2]), (-1, [0.75, 0.4, 0.10, -0.2])):
        # the first stage is about the position, by 0.5 further on; the last about an angle, from 0.05 less on
        number = table_state % len(target.places.location_of)
        assert target.places.stage_of[number] == (0 if table_state == 1 else 1)
        plain, _ = source.split(likeness(target.extend(observation, number)))
        np.testing.assert_allclose(plain, moved, rtol=1e-5)
    far = target.extend(np.array([-4.8, 0, 0, 0], dtype=np.float32), 1)
    assert source.split(likeness(far))[0][0] == np.float32(-4.8)  # not -5.3, which CartPole does not have


@pytest.mark.parametrize("form", ["dict", "flat"])
def test_every_observation_of_an_episode_is_mapped_to_one_of_the_source(form: str):
    source = ExtendedState(cart_pole(), BALANCE.format(0.1, 0.3, 0.02), form)
    target = ExtendedState(cart_pole(), BALANCE.format(0.5, 0.9, -0.03), form)
    likeness = ObservationMap(source, target)
    for episode in random_episodes(target, 3, seed=1):
        for observation, *_ in episode:
            assert source.observation_space.contains(likeness(observation))


def test_likened_to_itself_nothing_moves():
    env = ExtendedState(lake(4), NEAR, "discrete")
    likeness = ObservationMap(env, env)
    for episode in random_episodes(env, 5, seed=3):
        assert all(likeness(observation) == observation for observation, *_ in episode)


def test_landmarks_say_what_is_compared_relative_to():
    source, target = (ExtendedState(lake(4), NEAR, "discrete") for _ in range(2))
    zero, one = np.zeros((2, 2)), np.tile([1.0, 0.0], (2, 1))
    likeness = ObservationMap(source, target, landmarks=([zero], [one]))
    plain, _ = source.split(likeness(target.extend(6, 1)))  # the second row's third cell
    assert plain == 2  # is the first row's


def test_move_maps_what_nothing_else_can():
    def image(env: Labelled, size: int) -> Labelled:
        cells = np.eye(size * size, dtype=np.float32).reshape(-1, size, size)
        space = spaces.Box(0, 1, (size, size), np.float32)
        seen = TransformObservation(env.env, lambda s: cells[s], space)
        return Labelled(seen, {"row": lambda o: o.any(1).argmax(), "column": lambda o: o.any(0).argmax()})

    def move(observation: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        where = np.array(np.unravel_index(observation.argmax(), observation.shape)) + displacement
        moved = np.zeros((4, 4), np.float32)
        moved[tuple(np.clip(where.round().astype(int), 0, 3))] = 1
        return moved

    source, target = (ExtendedState(image(lake(n), n), t) for n, t in ((4, NEAR), (7, FAR)))
    with pytest.raises(ConfigurationError, match=r"neither one of at most 100000 nor a vector .*; give move"):
        ObservationMap(source, target)
    likeness = ObservationMap(source, target, move=move)
    observation, _ = target.reset(seed=0)
    seen = observation["observation"].copy()
    seen[:] = 0
    seen[1, 5] = 1
    plain, _ = source.split(likeness(observation | {"observation": seen}))
    # regions' centres are (0.5, 1.5) and (0.5, 4)
    assert np.argwhere(plain).tolist() == [[1, 2]]


def refused(error: type[Exception], message: str, source: Any, target: Any) -> None:
    with pytest.raises(error, match=message) as caught:
        ObservationMap(source, target)
    assert "\n" not in str(caught.value)


def test_what_cannot_be_likened_is_refused():
    source = ExtendedState(lake(4), NEAR)
    refused(ConfigurationError, "the target is no ExtendedState; wrap it", source, lake(4))
    two = ExtendedState(lake(4), f"{NEAR} | {NEAR}")
    refused(AutomatonError, "1 disjuncts and the source's 2, so it is not structurally transferable", two, source)
    other = "G[0,5] (row >= 1) & F[9,12] (row <= 3)"
    refused(AutomatonError, "not isomorphic", source, ExtendedState(lake(4), other))
    renamed = Labelled(lake(4).env, {"column": lambda s: s % 4, "row": lambda s: s // 4})
    refused(ConfigurationError, "use the same in both", source, ExtendedState(renamed, NEAR))
    flattened = ExtendedState(FlattenObservation(lake(4)), NEAR)
    refused(ConfigurationError, "not those of the observation that is extended", source, flattened)


def test_an_observation_that_is_none_of_the_targets_is_refused():
    env = ExtendedState(lake(4), NEAR)
    observation, _ = env.reset(seed=0)
    with pytest.raises(DataError, match="no automaton has location 77"):
        ObservationMap(env, env)(observation | {"location": 77})
