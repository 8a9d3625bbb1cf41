"""Transfer of extended Q-functions between agents of Stable-Baselines3: Algorithm 2 with networks for tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tickwise.envs.wrappers import ExtendedState
from tickwise.errors import ConfigurationError, MissingExtraError
from tickwise.transfer.observations import ObservationMap

try:
    import torch
    from stable_baselines3 import DQN
    from stable_baselines3.common.base_class import BaseAlgorithm
    from stable_baselines3.common.policies import ActorCriticPolicy
    from torch.nn.functional import kl_div, log_softmax, mse_loss
except ImportError:
    raise MissingExtraError("deep agents need Stable-Baselines3; pip install tickwise[sb3]") from None

_BATCH = 256


@dataclass(frozen=True, slots=True)
class Regression:
    """How near a target's network came to what was transferred.

    Attributes:
        observations: The number of different observations that it was fitted to.
        error: The root mean square of the values' differences, in units of return: Q-values for DQN, the value of an
            observation for actors and critics.
        agreement: The share of the observations in which the preferred action is the transferred one.
    """

    observations: int
    error: float
    agreement: float

    def __str__(self) -> str:
        return (
            f"fitted to {self.observations} observations: error {self.error:.3g}, "
            f"the same action preferred in {self.agreement:.1%}"
        )


def transfer_values(
    source: BaseAlgorithm,
    target: BaseAlgorithm,
    likeness: ObservationMap,
    *,
    steps: int = 5_000,
    updates: int = 4_000,
    exploration: float = 0.5,
    seed: int = 0,
) -> Regression:
    """Give a target's agent the values that a source's learned, by the mapped observation (Algorithm 2, line 12).

    A table's rows can be copied; a network is fitted to them instead. The target task is acted in, in part at random
    and in part as the source's agent would at the mapped observation, and at all observations that are met the
    target's network is fitted to what the source's says at the mapped one: Q̄ for DQN (its target network too), and the
    actions' probabilities and the value for PPO and A2C. Let DQN then begin with little exploration
    (``exploration_initial_eps``), or what was transferred is not acted upon.

    Args:
        source: The source task's trained agent.
        target: The target task's agent; its network is changed in place.
        likeness: The map of observations; both agents act in its environments.
        steps: How many steps to take in the target task.
        updates: How many steps of gradient descent to take, each on 256 observations.
        exploration: The probability of an action at random.
        seed: Seeds actions, the environment's episodes and the order of observations.

    Returns:
        How near the fit is.

    Raises:
        ConfigurationError: If the agents are not both of DQN, or both of PPO or A2C, or do not fit the environments.
    """
    _check(source, target, likeness, steps, updates, exploration)
    met = _met(source, likeness, steps, exploration, np.random.default_rng(seed))
    inputs = _tensor(target, met)
    with torch.no_grad():
        wanted = _outputs(source, _tensor(source, [likeness(observation) for observation in met]))
    wanted = [each.to(target.device) for each in wanted]
    _fit(target, inputs, wanted, updates, torch.Generator().manual_seed(seed))
    if isinstance(target, DQN):
        target.q_net_target.load_state_dict(target.q_net.state_dict())
    with torch.no_grad():
        found = _outputs(target, inputs)
    error = float(mse_loss(found[-1], wanted[-1]).sqrt())
    agreement = float((found[0].argmax(dim=1) == wanted[0].argmax(dim=1)).float().mean())
    return Regression(len(met), error, agreement)


def _check(
    source: BaseAlgorithm, target: BaseAlgorithm, likeness: ObservationMap, steps: int, updates: int, exploration: float
) -> None:
    if _kind(source) != _kind(target):
        raise ConfigurationError(
            f"the source's agent is of {type(source).__name__} and the target's of {type(target).__name__}; "
            "use DQN for both, or PPO or A2C for both"
        )
    for name, agent, env in (("source", source, likeness.source), ("target", target, likeness.target)):
        if agent.observation_space != env.observation_space:
            raise ConfigurationError(
                f"the {name}'s agent observes {agent.observation_space}, and the map's environment gives "
                f"{env.observation_space}; make both of the same ExtendedState"
            )
        if agent.get_vec_normalize_env() is not None:
            raise ConfigurationError(f"the {name}'s agent sees normalised observations; train it without VecNormalize")
    if source.action_space != target.action_space:
        raise ConfigurationError(
            f"the source has the actions {source.action_space} and the target {target.action_space}; "
            "transfer needs the same"
        )
    if steps < 1 or updates < 1 or not 0 <= exploration <= 1:
        raise ConfigurationError(
            f"steps is {steps}, updates {updates} and exploration {exploration}; use at least 1, 1, and 0 to 1"
        )


def _kind(agent: BaseAlgorithm) -> str:
    if isinstance(agent, DQN):
        return "values"
    if isinstance(agent.policy, ActorCriticPolicy) and hasattr(agent.action_space, "n"):
        return "actor and critic"
    raise ConfigurationError(
        f"{type(agent).__name__} with the actions {agent.action_space} has no values of single actions; "
        "use DQN, PPO or A2C with discrete actions"
    )


def _met(
    source: BaseAlgorithm, likeness: ObservationMap, steps: int, exploration: float, rng: np.random.Generator
) -> list[Any]:
    """The different observations that are met in the target task, in the order in which they are."""
    env: ExtendedState = likeness.target
    actions: Any = env.action_space
    found: dict[bytes, Any] = {}
    observation, _ = env.reset(seed=int(rng.integers(2**31)))
    for _ in range(steps):
        found.setdefault(_key(observation), observation)
        if rng.random() < exploration:
            action = int(actions.start + rng.integers(actions.n))
        else:
            action = int(source.predict(likeness(observation), deterministic=True)[0])
        observation, _, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            found.setdefault(_key(observation), observation)
            observation, _ = env.reset()
    return list(found.values())


def _key(observation: Any) -> bytes:
    entries = observation.values() if isinstance(observation, dict) else (observation,)
    return b"|".join(np.asarray(entry).tobytes() for entry in entries)


def _tensor(agent: BaseAlgorithm, observations: Sequence[Any]) -> Any:
    """Observations as the agent's network takes them, one to a row."""
    first = observations[0]
    if isinstance(first, dict):
        stacked: Any = {key: np.stack([each[key] for each in observations]) for key in first}
    else:
        stacked = np.stack(observations)
    return agent.policy.obs_to_tensor(stacked)[0]


def _outputs(agent: BaseAlgorithm, inputs: Any) -> list[torch.Tensor]:
    """What the network says: what actions are preferred by, shape ``(rows, actions)``, first, and values last."""
    if isinstance(agent, DQN):
        return [agent.q_net(inputs)]
    policy: Any = agent.policy
    return [policy.get_distribution(inputs).distribution.logits, policy.predict_values(inputs)]


def _fit(
    agent: BaseAlgorithm, inputs: Any, wanted: list[torch.Tensor], updates: int, generator: torch.Generator
) -> None:
    """Fit a network to values, by least squares, and to actions' probabilities, by their divergence."""
    parameters = agent.q_net.parameters() if isinstance(agent, DQN) else agent.policy.parameters()
    optimizer = torch.optim.Adam(parameters, lr=3e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, updates)
    agent.policy.set_training_mode(True)
    for _ in range(updates):
        rows = torch.randint(len(wanted[0]), (_BATCH,), generator=generator)
        batch = {key: each[rows] for key, each in inputs.items()} if isinstance(inputs, dict) else inputs[rows]
        found = _outputs(agent, batch)
        loss = mse_loss(found[-1], wanted[-1][rows])
        if len(found) > 1:
            ours, theirs = (log_softmax(each, dim=1) for each in (found[0], wanted[0][rows]))
            loss = loss + kl_div(ours, theirs, log_target=True, reduction="batchmean")
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
    agent.policy.set_training_mode(False)
