"""A tabular actor-critic: softmax preferences over extended states, and a critic that learns by TD(λ)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.errors import ConfigurationError
from tickwise.rl.learner import check_form, first_values
from tickwise.rl.loop import Index, advance, begin, best_value, run_episodes
from tickwise.rl.qlearning import Problem
from tickwise.rl.stream import uniform

# Unsigned, so that the compiled indexing need not ask whether an index counts from the end.
_index = np.uint32

FORGOTTEN = 0.01
"""A step whose trace is less than this is learned from no more."""


@dataclass(frozen=True, slots=True)
class ActorCritic:
    """An actor that comes to prefer the actions which turned out better than the critic expected.

    In memory state u and state s action a is chosen with probability π(a) proportional to exp(θ(u, s, a) / T), by the
    preferences θ and the temperature T. A step with reward r to u′ and s′ surprises the critic by δ = r + γV(u′, s′) −
    V(u, s), without the value of what follows where the episode ends. At once each step of the episode so far learns
    from it, the first one first: the value of its memory state and state grows by α_c δ e, the preference of its action
    by α_a δ e (1 − π(a)), and that of each other action b by −α_a δ e π(b), with the probabilities of when it was made.
    Its trace e is 1 at first, and γλ times as much after each further step; it is 0 once the same memory state and
    state come again (replacing traces), and below a hundredth the step is forgotten.

    The greatest preference is the action that greedy evaluation plays. Only the ratio α_a / T matters to an actor that
    begins without preferences. Given values are its preferences at first, and T is in their units: the less it is, the
    more surely the actor begins with what they say is best. The critic begins with what the softmax policy is worth by
    them.

    The defaults were measured in the target task of Case Study 1, over ten runs of 40,000 episodes each with the true
    formula and the paper's inferred one. The mean training return is 74 and 76, where that of Q-learning is 58 to 60;
    without traces it is 64 and 67, with an initial value of 0 it is 43 and 47. At an actor's rate of 0.5 it is 35 and
    41, since the policy settles on one action too early.

    Attributes:
        actor: Learning rate α_a of the preferences.
        critic: Learning rate α_c of the critic.
        gamma: Discount factor γ.
        trace: Decay λ of the traces; with 0 only the last step learns.
        temperature: Temperature T, in units of value.
        initial: What the critic expects of every state at first.
        form: The name of the form.

    Raises:
        ConfigurationError: If a setting is out of range, or the name is that of another form.
    """

    actor: float = 0.05
    critic: float = 0.8
    gamma: float = 0.99
    trace: float = 0.6
    temperature: float = 1.0
    initial: float = 40.0
    form: str = field(default="actor_critic", kw_only=True)

    def __post_init__(self) -> None:
        check_form(self)
        for name in ("actor", "critic", "gamma", "trace"):
            value = getattr(self, name)
            if not 0 <= value <= 1:
                raise ConfigurationError(f"{name} is {value}; use a number from 0 to 1")
        if not 0 < self.temperature < math.inf:
            raise ConfigurationError(f"the temperature is {self.temperature}; use a finite number above 0")
        if not math.isfinite(self.initial):
            raise ConfigurationError(f"the initial value is {self.initial}; use a finite number")

    def learner(self, problem: Problem, q: NDArray[np.float32] | None = None) -> ActorCriticLearner:
        """What learns a problem as actor and critic; see `tickwise.rl.learner.LearningForm`.

        Raises:
            ConfigurationError: If the values have another shape.
        """
        preferences = first_values(problem, self.initial, q)
        return ActorCriticLearner(problem, preferences, expected_values(preferences, self.temperature), self)


def expected_values(q: NDArray[np.float32], temperature: float) -> NDArray[np.float32]:
    """What the softmax policy of some values is worth by them, shape ``(memory states, states)``."""
    values = q.astype(np.float64)
    weights = np.exp((values - values.max(axis=2, keepdims=True)) / temperature)
    expected: NDArray[np.float32] = ((weights * values).sum(axis=2) / weights.sum(axis=2)).astype(np.float32)
    return expected


@dataclass(slots=True, eq=False)
class ActorCriticLearner:
    """Actor and critic as a `tickwise.rl.learner.Learner`.

    Attributes:
        problem: What is learned.
        q: The preferences, shape ``(memory states, states, actions)``.
        values: The critic's values, shape ``(memory states, states)``.
        settings: The form.
    """

    problem: Problem
    q: NDArray[np.float32]
    values: NDArray[np.float32]
    settings: ActorCritic

    def learn(self, rng: np.random.Generator, episodes: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Learn for some episodes; see `tickwise.rl.learner.Learner`."""
        chosen = self.settings
        # floats, since whole numbers would have the loop compiled once more
        rates = [float(rate) for rate in (chosen.actor, chosen.critic, chosen.gamma, chosen.trace, chosen.temperature)]
        arguments = (*rates, self.q, self.values)
        return run_episodes(learn_as_actor_and_critic, self.problem, arguments, rng, episodes)


@njit
def learn_as_actor_and_critic(
    world: Any,
    actor: float,
    critic: float,
    gamma: float,
    trace: float,
    temperature: float,
    preferences: NDArray[np.float32],
    values: NDArray[np.float32],
    stream: NDArray[np.uint64],
    returns: NDArray[np.float32],
    paths: NDArray[np.int32],
) -> None:
    """The loop of `ActorCritic`; the rest is as in `tickwise.rl.loop.run_episodes`."""
    horizon, delta, letters = world[9], world[11], world[12]
    actions = preferences.shape[2]
    steps = np.empty((horizon, 2), dtype=np.uint32)
    shares = np.empty((horizon, actions))
    eligible = np.empty(horizon)
    for episode in range(len(returns)):
        u, s, w = begin(world, stream)
        total, oldest = 0.0, 0
        paths[episode, 0] = s
        for t in range(1, horizon + 1):
            step = _index(t - 1)
            action = _index(draw_softly(preferences, u, s, temperature, uniform(stream), shares[step]))
            outcome, next_s, w, gained, over = advance(world, t, s, w, action, uniform(stream))
            next_u = _index(delta[u, _index(letters[s, action, outcome])])
            surprise = gained - values[u, s]
            if not over:
                surprise += gamma * values[next_u, next_s]
            for k in range(oldest, t - 1):
                past = _index(k)
                if steps[past, 0] == u and steps[past, 1] == s:
                    eligible[past] = 0.0
            steps[step, 0], steps[step, 1], eligible[step] = u, s, 1.0
            for each in range(actions):
                a = _index(each)
                shares[step, a] = (1.0 if a == action else 0.0) - shares[step, a]
            for k in range(oldest, t):
                past = _index(k)
                felt = surprise * eligible[past]
                v, x = steps[past, 0], steps[past, 1]
                values[v, x] = np.float32(values[v, x] + critic * felt)
                for each in range(actions):
                    a = _index(each)
                    preferences[v, x, a] = np.float32(preferences[v, x, a] + actor * felt * shares[past, a])
                eligible[past] *= gamma * trace
            while oldest < t and eligible[_index(oldest)] < FORGOTTEN:
                oldest += 1
            u, s = next_u, next_s
            paths[episode, t] = s
            total += gained
            if over:
                break
        returns[episode] = total


@njit
def draw_softly(
    preferences: NDArray[np.float32],
    u: Index,
    s: Index,
    temperature: float,
    number: float,
    chances: NDArray[np.float64],
) -> int:
    """The action that a number in [0, 1) selects by softmax; ``chances`` is filled with the probabilities."""
    actions = preferences.shape[2]
    most = np.float64(best_value(preferences, u, s))
    total = 0.0
    for each in range(actions):
        a = _index(each)
        chances[a] = math.exp((preferences[u, s, a] - most) / temperature)
        total += chances[a]
    action, left = 0, number * total - chances[_index(0)]
    while left >= 0.0 and action < actions - 1:
        action += 1
        left -= chances[_index(action)]
    for each in range(actions):
        chances[_index(each)] /= total
    return action
