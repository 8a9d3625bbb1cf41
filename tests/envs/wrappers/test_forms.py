from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.wrappers.worlds import FORMULAS, NUMBERED, Env, frozen_lake, random_episodes
from tickwise.automata.monitor import Monitor
from tickwise.envs.wrappers import ExtendedState, Labelled
from tickwise.envs.wrappers.forms import Places, make_form, numbering, observation_of
from tickwise.errors import ConfigurationError, DataError

PLACES = Places.of(Monitor.of("F[0,3] (x >= 2) & G[5,6] F[0,2] (x <= 1) | G[2,4] (x >= 5)", ("x",)))

CASES = [
    pytest.param(make, form, id=f"{make.__name__}-{form}")
    for make in FORMULAS
    for form in ("dict", "flat", "discrete")
    if form != "discrete" or make.__name__ in NUMBERED
]

# what Gymnasium says of any wrapped environment, and of CartPole's own space
expected = [
    "ignore:.*is different from the unwrapped version.*:UserWarning",
    "ignore:.*A Box observation space m.*imum value is -?infinity.*:UserWarning",
]


def made(make: Any, form: str) -> Env:
    return ExtendedState(make(), FORMULAS[make], form)


@pytest.mark.parametrize(("make", "form"), CASES)
@pytest.mark.filterwarnings(*expected)
def test_gymnasium_finds_nothing_wrong(make: Any, form: str):
    env = made(make, form)
    check_env(env, skip_render_check=True)
    for episode in random_episodes(env, 3, seed=1):
        assert all(env.observation_space.contains(observation) for observation, *_ in episode)


@pytest.mark.parametrize(("make", "form"), CASES)
# images for its convolutional policy should be larger than MiniGrid's
@pytest.mark.filterwarnings("ignore:The minimal resolution for an image is 36x36:UserWarning")
def test_stable_baselines3_finds_nothing_wrong(make: Any, form: str):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(made(make, form), skip_render_check=True)


@pytest.mark.parametrize("form", ["dict", "flat", "discrete"])
def test_what_gymnasium_records_of_it_makes_it_anew(form: str):
    env = made(frozen_lake, form)
    again = gymnasium.make(env.spec)  # type: ignore[arg-type]
    assert again.observation_space == env.observation_space
    rows = [
        [(str(observation), *rest) for observation, *rest, _ in episode]
        for made_env in (env, again)
        for episode in random_episodes(made_env, 4, seed=3)
    ]
    assert rows[:4] == rows[4:]


def inner_spaces() -> st.SearchStrategy[gymnasium.Space[Any]]:
    sizes = st.integers(1, 4)
    shapes = st.lists(st.integers(1, 3), min_size=0, max_size=2).map(tuple)
    plain = st.one_of(
        st.builds(lambda n, start: spaces.Discrete(n, start=start), sizes, st.integers(-2, 2)),
        st.builds(lambda sizes: spaces.MultiDiscrete(sizes, start=[1] * len(sizes)), st.lists(sizes, min_size=1)),
        st.just(spaces.MultiDiscrete([[2, 3], [4, 1]])),
        st.builds(spaces.MultiBinary, st.integers(1, 4)),
        st.builds(lambda shape: spaces.Box(-3, 5, shape, dtype=np.float64), shapes),
        st.builds(lambda shape: spaces.Box(0, 255, shape, dtype=np.uint8), shapes),
    )
    several = st.lists(plain, min_size=1, max_size=3)
    nested = st.one_of(
        plain,
        several.map(lambda parts: spaces.Tuple(parts)),
        several.map(lambda parts: spaces.Dict({f"k{i}": part for i, part in enumerate(reversed(parts))})),
    )
    return st.one_of(nested, st.lists(nested, min_size=1, max_size=2).map(lambda parts: spaces.Tuple(parts)))


@settings(max_examples=60)
@given(inner_spaces(), st.integers(0, 2**16))
def test_a_flat_observation_is_gymnasiums_flattened_one_and_location_and_clocks(space: Any, seed: int):
    form = make_form("flat", space, PLACES)
    space.seed(seed)
    inner = space.sample()
    rng = np.random.default_rng(seed)
    number = PLACES.number(np.asarray(rng.integers(2)), np.asarray(rng.integers(4)))
    flat = form.extend(inner, number)
    assert form.space.contains(flat)
    width = flat.size - PLACES.locations - PLACES.clocks
    np.testing.assert_array_equal(flat[:width], spaces.flatten(space, inner).astype(np.float32))
    location, clocks = np.split(flat[width:], [PLACES.locations])
    assert np.flatnonzero(location).tolist() == [PLACES.location_of[number]]
    np.testing.assert_allclose(clocks * PLACES.longest, PLACES.clocks_of[number], rtol=1e-6)


@pytest.mark.parametrize(("make", "form"), CASES)
def test_an_extended_observation_comes_apart_into_what_it_was_made_of(make: Any, form: str):
    env = made(make, form)
    for episode in random_episodes(env, 3, seed=2):
        for observation, info in ((step[0], step[-1]) for step in episode):
            inner, number = env.split(observation)
            assert number == info["table_state"]
            assert env.env.observation_space.contains(inner)
            again = env.extend(inner, number)
            np.testing.assert_equal(again, observation)


@pytest.mark.parametrize("form", ["dict", "flat"])
def test_what_no_automaton_has_is_told(form: str):
    env = made(frozen_lake, form)
    observation, _ = env.reset(seed=0)
    if form == "dict":
        observation["clocks"] = observation["clocks"] + 99
    else:
        observation[-1] = 99
    with pytest.raises(DataError, match="no automaton has location 0 with clocks"):
        env.split(observation)


@given(st.lists(st.integers(1, 4), min_size=1, max_size=4), st.integers(-3, 3))
def test_numbers_are_those_from_0_each_once(sizes: list[int], start: int):
    space = spaces.MultiDiscrete(sizes, start=[start] * len(sizes))
    count, number = numbering(space, "the test")
    everything = np.array(list(np.ndindex(*sizes))) + start
    assert count == len(everything)
    np.testing.assert_array_equal(number(everything), np.arange(count))
    np.testing.assert_array_equal([observation_of(space, each) for each in range(count)], everything)
    assert [int(number(each)) for each in everything] == list(range(count))


def test_locations_of_all_disjuncts_have_numbers_of_their_own():
    monitor = Monitor.of("F[0,3] (x >= 2) | G[2,4] F[0,2] (x >= 5)", ("x",))
    places = Places.of(monitor)
    first, second = monitor.tables
    assert places.locations == len(first.automaton.locations) + len(second.automaton.locations)
    assert places.clocks == 2  # the second has a clock more
    assert (places.clocks_of[: len(first), 1] == 0).all()
    assert set(places.location_of[: len(first)]).isdisjoint(places.location_of[len(first) :])
    np.testing.assert_array_equal(places.clocks_of[len(first) :], second.clocks)
    np.testing.assert_array_equal(places.stage_of, np.concatenate([first.stage, second.stage]))


@pytest.mark.parametrize(
    ("form", "space", "message"),
    [
        ("vector", spaces.Discrete(3), "no form 'vector'; use one of 'dict', 'flat', 'discrete'"),
        ("dict", spaces.Dict({"clocks": spaces.Discrete(2)}), "entry 'clocks' already"),
        ("flat", spaces.Text(5), "no vector when flattened"),
        ("flat", spaces.Dict({"a": spaces.Sequence(spaces.Discrete(2))}), "no vector when flattened"),
        ("discrete", spaces.Box(0, 1, (2,)), "needs observations that are whole numbers"),
        ("discrete", spaces.MultiDiscrete([2**20] * 4), "that can be numbered"),
        ("discrete", spaces.Discrete(2**61), "use another form"),
    ],
)
def test_a_form_that_does_not_fit_is_refused(form: str, space: Any, message: str):
    with pytest.raises(ConfigurationError, match=message) as caught:
        make_form(form, space, PLACES)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("form", "space", "observation"),
    [
        ("discrete", spaces.Discrete(3), 3),
        ("discrete", spaces.Discrete(3), -1),
        ("discrete", spaces.MultiDiscrete([2, 3]), [1, 3]),
        ("discrete", spaces.MultiDiscrete([2, 3]), [1, 2, 0]),
        ("flat", spaces.Discrete(3, start=1), 0),
        ("flat", spaces.Box(0, 1, (2,)), np.zeros(3, dtype=np.float32)),
    ],
)
def test_an_observation_outside_its_space_is_refused(form: str, space: Any, observation: Any):
    extend = make_form(form, space, PLACES).extend
    with pytest.raises(DataError, match="is not in") as caught:
        extend(observation, np.asarray(0))
    assert "\n" not in str(caught.value)


def test_a_bound_beyond_single_precision_is_none():
    form = make_form("flat", spaces.Box(-1e300, 1e300, (1,), dtype=np.float64), PLACES)
    assert form.space.contains(form.extend(np.array([1e30]), np.asarray(0)))


def test_extended_state_needs_labels():
    with pytest.raises(ConfigurationError, match=r"ExtendedState needs named features; wrap .* in Labelled"):
        ExtendedState(gymnasium.make("FrozenLake-v1"), "F[0,3] (row >= 2)")


def test_an_environment_that_breaks_its_space_is_named():
    lake = gymnasium.make("FrozenLake-v1", disable_env_checker=True)
    wrong = gymnasium.wrappers.TransformObservation(lake, lambda s: s + 16, spaces.Discrete(16))
    env = ExtendedState(Labelled(wrong, ["state"]), "F[0,3] (state >= 2)", "discrete")
    with pytest.raises(DataError, match=r"observation .*16.* is not in Discrete\(16\)"):
        env.reset(seed=0)
