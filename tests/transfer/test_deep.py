"""Real agents of Stable-Baselines3 on real environments; skipped where it is not installed (`make sb3`)."""

from __future__ import annotations

import importlib
import sys
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from tests.transfer.test_observations import lake
from tickwise.envs.wrappers import ExtendedState, TimedTask
from tickwise.errors import ConfigurationError, MissingExtraError
from tickwise.transfer.observations import ObservationMap

pytest.importorskip("stable_baselines3", reason="Stable-Baselines3 is not installed; run make sb3")

import torch
from stable_baselines3 import DQN, PPO, SAC
from stable_baselines3.common.vec_env import DummyVecEnv, VecNormalize

from tickwise.transfer.deep import transfer_values

# wait in the upper right corner, then be at the goal, not too early
NEAR = "F[0,5] G[0,1] (0 <= row <= 0 & 2 <= column <= 2) & F[8,10] (2 <= row <= 2 & 2 <= column <= 2)"
FAR = "F[0,7] G[0,2] (0 <= row <= 0 & 3 <= column <= 3) & F[11,13] (3 <= row <= 3 & 3 <= column <= 3)"

DQN_SETTINGS = {
    "learning_rate": 1e-3, "learning_starts": 300, "gamma": 0.97, "exploration_fraction": 0.5,
    "target_update_interval": 200, "buffer_size": 10_000,
}  # fmt: skip
PPO_SETTINGS = {"learning_rate": 1e-3, "n_steps": 256, "batch_size": 128, "gamma": 0.97, "ent_coef": 0.02}


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Any:
    """Small networks gain nothing from threads, and lose much where other work shares the cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def near(form: str = "flat") -> ExtendedState:
    return ExtendedState(TimedTask(lake(3), NEAR, deadline=10), NEAR, form)


def far(form: str = "flat") -> ExtendedState:
    return ExtendedState(TimedTask(lake(4), FAR, deadline=13), FAR, form)


def succeeds(agent: Any, env: ExtendedState) -> bool:
    observation, info = env.reset(seed=0)
    over = False
    while not over:
        observation, _, terminated, truncated, info = env.step(int(agent.predict(observation, deterministic=True)[0]))
        over = terminated or truncated
    return bool(info["is_success"])


@pytest.fixture(scope="module")
def dqn() -> DQN:
    return DQN("MlpPolicy", near(), seed=0, device="cpu", **DQN_SETTINGS).learn(6_000)


@pytest.fixture(scope="module")
def ppo() -> PPO:
    return PPO("MultiInputPolicy", near("dict"), seed=0, device="cpu", **PPO_SETTINGS).learn(10_000)


def met(env: ExtendedState, episodes: int) -> list[Any]:
    rng, found = np.random.default_rng(7), []
    for episode in range(episodes):
        observation, _ = env.reset(seed=episode)
        over = False
        while not over:
            found.append(observation)
            observation, _, terminated, truncated, _ = env.step(int(rng.integers(4)))
            over = terminated or truncated
    return found


def test_dqn_learns_on_the_extended_state_and_gives_its_values_to_the_target(dqn: DQN):
    assert succeeds(dqn, near())
    env = far()
    likeness = ObservationMap(near(), env)
    agent = DQN("MlpPolicy", env, seed=1, device="cpu", **DQN_SETTINGS)
    assert not succeeds(agent, env)
    regression = transfer_values(dqn, agent, likeness)
    assert regression.observations > 100
    assert regression.error < 0.01
    assert regression.agreement > 0.95
    observations = met(env, 30)  # others than those of the fit
    ours = agent.policy.obs_to_tensor(np.stack(observations))[0]
    theirs = dqn.policy.obs_to_tensor(np.stack([likeness(each) for each in observations]))[0]
    with torch.no_grad():
        difference = (agent.q_net(ours) - dqn.q_net(theirs)).abs()
        np.testing.assert_array_equal(agent.q_net(ours), agent.q_net_target(ours))
    assert difference.mean() < 0.02


def test_ppo_learns_on_the_extended_state_and_gives_its_policy_and_values_to_the_target(ppo: PPO):
    assert succeeds(ppo, near("dict"))
    env = far("dict")
    likeness = ObservationMap(near("dict"), env)
    agent = PPO("MultiInputPolicy", env, seed=1, device="cpu", **PPO_SETTINGS)
    regression = transfer_values(ppo, agent, likeness)
    assert regression.error < 0.05
    assert regression.agreement > 0.95
    differences = []
    for observation in met(env, 30):
        ours, theirs = (
            each.policy.get_distribution(each.policy.obs_to_tensor(seen)[0]).distribution.probs.detach()
            for each, seen in ((agent, observation), (ppo, likeness(observation)))
        )
        differences.append(float((ours - theirs).abs().max()))
    assert np.mean(differences) < 0.05


def test_transfer_reproduces_from_its_seed(dqn: DQN):
    likeness = ObservationMap(near(), far())
    values = []
    for _ in range(2):
        agent = DQN("MlpPolicy", far(), seed=1, device="cpu", **DQN_SETTINGS)
        regression = transfer_values(dqn, agent, likeness, steps=300, updates=20, seed=5)
        values.append((regression, agent.q_net.q_net[0].weight.detach().numpy().copy()))
    assert values[0][0] == values[1][0]
    np.testing.assert_array_equal(values[0][1], values[1][1])


def test_what_does_not_fit_is_refused(dqn: DQN, ppo: PPO):
    env = far()
    likeness = ObservationMap(near(), env)
    agent = DQN("MlpPolicy", env, device="cpu")

    def refused(message: str, *arguments: Any, **settings: Any) -> None:
        with pytest.raises(ConfigurationError, match=message) as caught:
            transfer_values(*arguments, **settings)
        assert "\n" not in str(caught.value)

    refused("the source's agent is of PPO and the target's of DQN; use DQN for both", ppo, agent, likeness)
    refused("the target's agent observes .* make both of the same ExtendedState", dqn, dqn, likeness)
    refused("steps is 0, updates 4000 and exploration 0.5", dqn, agent, likeness, steps=0)
    refused("exploration 2", dqn, agent, likeness, exploration=2)
    normalised = DQN("MlpPolicy", VecNormalize(DummyVecEnv([far])), device="cpu")
    refused("train it without VecNormalize", dqn, normalised, likeness)
    pendulum = SAC("MlpPolicy", gymnasium.make("Pendulum-v1"), device="cpu", buffer_size=10)
    refused("SAC with the actions Box.* has no values of single actions", pendulum, agent, likeness)
    other = DQN("MlpPolicy", Fewer(far()), device="cpu")
    refused("transfer needs the same", dqn, other, likeness)


def test_without_stable_baselines3_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    monkeypatch.delitem(sys.modules, "tickwise.transfer.deep")
    with pytest.raises(MissingExtraError, match=r"^deep agents need Stable-Baselines3; pip install tickwise\[sb3\]$"):
        importlib.import_module("tickwise.transfer.deep")


class Fewer(gymnasium.ActionWrapper[Any, Any, Any]):
    """Without the last action."""

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        super().__init__(env)
        self.action_space = spaces.Discrete(3)

    def action(self, action: Any) -> Any:
        return action
