from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import iterate
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.envs.wrappers.slow import Replay, episodes, extended_state
from tests.envs.wrappers.worlds import cart_pole, frozen_lake, gridworld
from tests.strategies import VARIABLES, sdnfs
from tickwise.envs.wrappers import ExtendedState, Labelled, VectorExtendedState, VectorLabelled
from tickwise.envs.wrappers.labelled import FEATURES
from tickwise.errors import ConfigurationError, DataError, UnknownVariableError
from tickwise.logic.sdnf import SDNF

MODES = pytest.mark.parametrize("mode", list(AutoresetMode))
# from Python 3.12 on, of any process with threads
pytestmark = pytest.mark.filterwarnings("ignore:.*use of fork.*:DeprecationWarning")
LAKE = "F[2,5] (row >= 1) & F[6,20] (column >= 1) | G[0,3] (row <= 2)"


def trajectories_of(replayed: list[np.ndarray]) -> Iterator[np.ndarray]:
    while True:
        yield from replayed


def follow(sdnf: SDNF, env: VectorExtendedState, replayed: list[list[np.ndarray]], mode: AutoresetMode) -> None:
    """Step through some episodes in each environment; every tick is compared with the run by definition."""
    coming = [trajectories_of(each) for each in replayed]
    now = [next(each) for each in coming]
    count = len(now)
    tick, over = np.zeros(count, dtype=int), np.zeros(count, dtype=bool)
    observations, infos = env.reset()
    compare(sdnf, env, now, tick, observations, infos)
    for _ in range(40):
        if mode == AutoresetMode.DISABLED and over.any():
            observations, infos = env.reset(options={"reset_mask": over.copy()})
            for row in np.flatnonzero(over):
                now[row], tick[row] = next(coming[row]), 0
            compare(sdnf, env, now, tick, observations, infos, only=over)
            over[:] = False
        observations, _, terminated, truncated, infos = env.step(np.zeros(count, dtype=int))
        for row in range(count):
            if mode == AutoresetMode.NEXT_STEP and over[row]:
                now[row], tick[row] = next(coming[row]), 0
            else:
                tick[row] += 1
        over = terminated | truncated
        np.testing.assert_array_equal(over, [tick[row] == len(now[row]) - 1 for row in range(count)])
        if mode == AutoresetMode.SAME_STEP and over.any():
            for row in np.flatnonzero(over):
                expected = extended_state(sdnf, now[row])
                last, told = infos["final_obs"][row], infos["final_info"]
                np.testing.assert_array_equal(last["observation"], now[row][-1])
                np.testing.assert_array_equal(told[FEATURES][row], now[row][-1])
                assert last["clocks"].tolist() == told["clocks"][row].tolist() == expected["clocks"]
                assert last["location"] == told["location"][row] == expected["location"]
                assert (told["stage"][row], told["verdict"][row]) == (expected["stage"], expected["verdict"])
                now[row], tick[row] = next(coming[row]), 0
        compare(sdnf, env, now, tick, observations, infos)


def compare(
    sdnf: SDNF,
    env: VectorExtendedState,
    now: list[np.ndarray],
    tick: np.ndarray,
    observations: dict[str, np.ndarray],
    infos: dict[str, Any],
    only: np.ndarray | None = None,
) -> None:
    assert env.observation_space.contains(observations)
    for row, X in enumerate(now):
        read = X[: tick[row] + 1]
        expected = extended_state(sdnf, read)
        np.testing.assert_array_equal(observations["observation"][row], read[-1])
        assert observations["location"][row] == infos["location"][row] == expected["location"]
        assert observations["clocks"][row].tolist() == infos["clocks"][row].tolist() == expected["clocks"]
        assert (infos["stage"][row], infos["verdict"][row]) == (expected["stage"], expected["verdict"])
        if only is None or only[row]:
            np.testing.assert_array_equal(infos[FEATURES][row], read[-1])


@MODES
@pytest.mark.parametrize("inside", [False, True], ids=["VectorLabelled", "Labelled"])
@settings(max_examples=8)
@given(sdnf=sdnfs(most=2, longest=3), seed=st.integers(0, 2**28))
def test_each_ticks_extended_states_are_those_of_the_runs(mode: AutoresetMode, inside: bool, sdnf: SDNF, seed: int):
    replayed = [episodes(seed + 10 * row) for row in range(3)]
    with closing(SyncVectorEnv(makers(replayed, inside), autoreset_mode=mode)) as vector:
        labelled = vector if inside else VectorLabelled(vector, VARIABLES)
        follow(sdnf, VectorExtendedState(labelled, sdnf, reduce=False), replayed, mode)


@MODES
@pytest.mark.parametrize("inside", [False, True], ids=["VectorLabelled", "Labelled"])
def test_so_are_those_of_environments_in_processes_of_their_own(mode: AutoresetMode, inside: bool):
    from tickwise.logic.parse import parse
    from tickwise.logic.sdnf import to_sdnf

    sdnf = to_sdnf(parse("F[0,3] G[0,2] (x >= 1) & F[6,9] (y >= 1) | G[0,4] F[0,2] (y <= 3)"))
    replayed = [episodes(10 * row) for row in range(3)]
    with closing(AsyncVectorEnv(makers(replayed, inside), autoreset_mode=mode)) as vector:
        labelled = vector if inside else VectorLabelled(vector, VARIABLES)
        follow(sdnf, VectorExtendedState(labelled, sdnf, reduce=False), replayed, mode)


def makers(replayed: list[list[np.ndarray]], inside: bool) -> list[Any]:
    """One environment a list; every other one truncates its episodes instead of ending them."""

    def maker(row: int) -> Any:
        def make() -> Any:
            env = Replay(replayed[row], truncated=row % 2 == 1)
            return Labelled(env, VARIABLES) if inside else env

        return make

    return [maker(row) for row in range(len(replayed))]


@MODES
@pytest.mark.parametrize(
    ("make", "form"), [(frozen_lake, "dict"), (gridworld, "flat"), (gridworld, "discrete"), (cart_pole, "flat")]
)
def test_a_vector_is_as_if_each_were_alone(mode: AutoresetMode, form: str, make: Any):
    formula = {frozen_lake: LAKE, gridworld: "F[0,9] (i >= 3)", cart_pole: "G[0,9] (angle >= 0)"}[make]
    rng = np.random.default_rng(5)
    with closing(VectorExtendedState(SyncVectorEnv([make] * 3, autoreset_mode=mode), formula, form)) as env:
        alone = [ExtendedState(make(), formula, form) for _ in range(3)]
        observations, infos = env.reset(seed=[1, 2, 3])
        told = [each.reset(seed=seed) for each, seed in zip(alone, (1, 2, 3), strict=True)]
        over = np.zeros(3, dtype=bool)
        for _ in range(120):
            assert env.observation_space.contains(observations)
            for row, each in enumerate(iterate(env.observation_space, observations)):
                assert same(each, told[row][0])
                assert infos["verdict"][row] == told[row][-1]["verdict"]
                assert infos["table_state"][row] == told[row][-1]["table_state"]
            actions = rng.integers(env.single_action_space.n, size=3)
            if mode == AutoresetMode.DISABLED and over.any():
                observations, infos = env.reset(options={"reset_mask": over.copy()})
                told = [alone[row].reset() if over[row] else told[row] for row in range(3)]
                over[:] = False
                continue
            observations, _, terminated, truncated, infos = env.step(actions)
            if mode == AutoresetMode.NEXT_STEP:
                told = [alone[row].reset() if over[row] else alone[row].step(actions[row]) for row in range(3)]
            else:
                told = [alone[row].step(actions[row]) for row in range(3)]
            over = terminated | truncated
            if mode == AutoresetMode.SAME_STEP:
                for row in np.flatnonzero(over):
                    assert same(infos["final_obs"][row], told[row][0])
                    assert infos["final_info"]["table_state"][row] == told[row][-1]["table_state"]
                    told[row] = alone[row].reset()


def same(ours: Any, theirs: Any) -> bool:
    if isinstance(ours, dict):
        return ours.keys() == theirs.keys() and all(same(ours[key], theirs[key]) for key in ours)
    return np.array_equal(ours, theirs)


def test_a_vector_of_its_own_kind_is_followed_too():
    names = ["position", "velocity", "angle", "turning"]
    vector = gymnasium.make_vec("CartPole-v1", 4, "vector_entry_point")
    with closing(VectorExtendedState(VectorLabelled(vector, names), "G[0,9] (angle >= 0)", "flat")) as env:
        observations, infos = env.reset(seed=0)
        over, ended, rng = np.ones(4, dtype=bool), np.zeros(4, dtype=bool), np.random.default_rng(0)
        angles: list[list[float]] = [[]] * 4
        for _ in range(80):
            assert env.observation_space.contains(observations)
            for row, angle in enumerate(infos[FEATURES][:, 2]):
                angles[row] = [*([] if over[row] else angles[row]), float(angle)]
                broken = min(angles[row][:10]) < 0
                assert infos["verdict"][row] == (-1 if broken else int(len(angles[row]) >= 10))
            # an episode that is over is reset in the step after it
            observations, _, terminated, truncated, infos = env.step(rng.integers(2, size=4))
            over, ended = ended, terminated | truncated


def test_features_that_do_not_fit_are_refused():
    with closing(SyncVectorEnv([frozen_lake] * 2)) as vector:
        with pytest.raises(ConfigurationError, match="2 names"):
            VectorLabelled(vector, ["a", "b"])
        with pytest.raises(UnknownVariableError, match="'x' is no feature"):
            VectorExtendedState(vector, "F[0,3] (x >= 1)")
        with pytest.raises(ConfigurationError, match="no form 'vector'"):
            VectorExtendedState(vector, "F[0,3] (row >= 1)", "vector")
        env = VectorLabelled(vector, {"x": lambda _: float("nan")})
        with pytest.raises(DataError, match="feature 'x' is NaN"):
            env.reset()
    with (
        closing(SyncVectorEnv([lambda: gymnasium.make("FrozenLake-v1")])) as plain,
        pytest.raises(ConfigurationError, match="VectorExtendedState needs named features"),
    ):
        VectorExtendedState(plain, "F[0,3] (x >= 1)")
