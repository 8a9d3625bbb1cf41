"""Q-learning with counterfactual updates: a step of the world teaches every memory state that could have seen it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._jit import njit
from tickwise.errors import ConfigurationError
from tickwise.rl.learner import check_form, first_values
from tickwise.rl.loop import advance, begin, best_value, draw_action, run_episodes
from tickwise.rl.qlearning import Problem, QSettings
from tickwise.rl.states import Memory
from tickwise.rl.stream import uniform

# Unsigned, so that the compiled indexing need not ask whether an index counts from the end.
_index = np.uint32


@dataclass(frozen=True, slots=True)
class Counterfactual:
    """Q-learning that also asks of each step what it would have been worth to an agent with another past.

    Where the robot goes does not depend on what the agent remembers. A step from state s by action a to s′, at which
    memory state u becomes u′, would have led another memory state v to v′ by the same letter. Where the reward and the
    end of the episode would have been the same too, (v, s, a, reward, v′, s′) is a step of the product like the real
    one, and Q is updated with it.

    **When it is sound.** The learner does not see the hidden task. It takes for granted that the reward of a tick, and
    whether the episode ends with it, depend on the past only through the tick, the MDP state at it, and the *verdict*
    that the automaton in the agent's memory gives at it: true, false or unknown. That holds where the task is to keep
    the formula whose automaton is the memory, as in `tickwise.envs.temporal.FormulaTask`, and where the task rewards
    states and ticks alone. Where the task asks for something that the formula does not say, it need not, and then the
    values are biased, however long one learns: a past that earned the reward lends it to one that did not. A formula of
    several disjuncts has a verdict of its own, of which that of the disjunct that the memory follows is only a part: a
    disjunct's *false* leaves open what the others say, so that there the assumption is one about the task.

    Updates are restricted to what is known under this assumption. The memory states v are those of the same disjunct's
    automaton that some word of the world's letters, with the letter just read at its end, leads to at the tick of s; at
    tick 0 there is none but u. And v′ has the verdict of u′ after *every* outcome that the action can have in s, by the
    world's table. To ask so only of the outcome that came would not do: updates that are made after some outcomes of an
    action and not after others learn the expectation over the former.

    The real update comes first, and is that of Q-learning; then those of the other memory states by ascending number,
    each with the values as those before it left them.

    Attributes:
        settings: Learning rate, discount, exploration and initial values.
        form: The name of the form.

    Raises:
        ConfigurationError: If the name is that of another form.
    """

    settings: QSettings = field(default_factory=QSettings)
    form: str = field(default="counterfactual", kw_only=True)

    def __post_init__(self) -> None:
        check_form(self)

    def learner(self, problem: Problem, q: NDArray[np.float32] | None = None) -> CounterfactualLearner:
        """What learns a problem with counterfactual updates; see `tickwise.rl.learner.LearningForm`.

        Raises:
            ConfigurationError: If the memory is not one of automata, so that nothing has a verdict, or the values have
                another shape.
        """
        q = first_values(problem, self.settings.initial, q)
        return CounterfactualLearner(problem, q, self.settings, Alternatives.of(problem))


@dataclass(frozen=True, slots=True, eq=False)
class Alternatives:
    """Which memory states could be at a tick, given the disjunct and the letter just read.

    Attributes:
        disjunct: The disjunct of each memory state, int32, shape ``(memory states,)``.
        choice: Equal for states and actions that the same letters can follow, int32, shape ``(states, actions)``.
        outlook: Equal for memory states that come to the same verdict by each letter that can follow a choice, int32,
            shape ``(choices, memory states)``.
        first: Where the memory states of disjunct d, tick t and letter l begin: ``first[row]``, for the row
            ``(d * horizon + t) * letters + l``; they end where the next row's begin. int64, shape ``(rows + 1,)``.
        states: The memory states, ascending within a row, int32.
    """

    disjunct: NDArray[np.int32]
    choice: NDArray[np.int32]
    outlook: NDArray[np.int32]
    first: NDArray[np.int64]
    states: NDArray[np.int32]

    @classmethod
    def of(cls, problem: Problem) -> Alternatives:
        """Follow all memory states that an episode can start with through all words of the world's letters.

        Raises:
            ConfigurationError: If the memory is not one of automata.
        """
        mdp, memory = problem.mdp, problem.memory
        if not memory.tables:
            raise ConfigurationError(
                "counterfactual updates need verdicts, and this memory follows no automaton; "
                "use automaton_memory, or another form of learning such as QLearning"
            )
        sizes = [len(table) for table in memory.tables]
        disjunct = np.repeat(np.arange(len(sizes), dtype=np.int32), sizes)
        possible = np.zeros((mdp.n_states, mdp.n_actions, memory.delta.shape[1]), dtype=np.bool_)
        s, a, k = np.nonzero(mdp.probability > 0)
        possible[s, a, memory.letter[s, a, k]] = True
        start = np.unique(memory.start[mdp.initial > 0])
        starts = [start[disjunct[start] == number] for number in range(len(sizes))]
        letters = np.flatnonzero(possible.any(axis=(0, 1)))
        rows = [row for start in starts for row in _rows(memory, start, letters, problem.task.horizon)]
        first = np.concatenate([[0], np.cumsum([len(row) for row in rows])])
        return cls(disjunct, *_outlook(memory, possible), first.astype(np.int64), np.concatenate(rows))


def _rows(
    memory: Memory, start: NDArray[np.int32], letters: NDArray[np.int64], horizon: int
) -> Iterator[NDArray[np.int32]]:
    """The memory states at each tick after each letter, from those that an episode can start with in one disjunct."""
    known = start
    for t in range(horizon):
        row = [start[:0]] * memory.delta.shape[1]
        if t > 0:
            for letter in letters:
                row[letter] = np.unique(memory.delta[known, letter])
            known = np.unique(np.concatenate(row))
        yield from row


def _outlook(memory: Memory, possible: NDArray[np.bool_]) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """The arrays `choice` and `outlook`, given which letters can follow each state and action."""
    verdict = np.concatenate([table.verdict for table in memory.tables])
    choices, choice = np.unique(possible.reshape(-1, possible.shape[2]), axis=0, return_inverse=True)
    numbers = [np.unique(verdict[memory.delta[:, each]], axis=0, return_inverse=True)[1] for each in choices]
    outlook = np.stack([number.reshape(-1) for number in numbers])
    return choice.reshape(possible.shape[:2]).astype(np.int32), outlook.astype(np.int32)


@dataclass(slots=True, eq=False)
class CounterfactualLearner:
    """Q-learning with counterfactual updates as a `tickwise.rl.learner.Learner`."""

    problem: Problem
    q: NDArray[np.float32]
    settings: QSettings
    alternatives: Alternatives

    def learn(self, rng: np.random.Generator, episodes: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Learn for some episodes; see `tickwise.rl.learner.Learner`."""
        chosen, others = self.settings, self.alternatives
        # floats, since whole numbers would have the loop compiled once more
        rates = float(chosen.alpha), float(chosen.gamma), float(chosen.epsilon)
        known = others.disjunct, others.choice, others.outlook, others.first, others.states
        return run_episodes(learn_counterfactually, self.problem, (*rates, *known, self.q), rng, episodes)


@njit
def learn_counterfactually(
    world: Any,
    alpha: float,
    gamma: float,
    epsilon: float,
    disjunct: NDArray[np.int32],
    choice: NDArray[np.int32],
    outlook: NDArray[np.int32],
    first: NDArray[np.int64],
    states: NDArray[np.int32],
    q: NDArray[np.float32],
    stream: NDArray[np.uint64],
    returns: NDArray[np.float32],
    paths: NDArray[np.int32],
) -> None:
    """The loop of `Counterfactual`; the arrays are those of `Alternatives`, the rest as in `run_episodes`."""
    horizon, delta = world[9], world[11]
    letters = delta.shape[1]
    for episode in range(len(returns)):
        u, s, w = begin(world, stream)
        total, letter = 0.0, _index(0)
        row = _index(disjunct[u] * horizon * letters)
        paths[episode, 0] = s
        best = best_value(q, u, s)
        for t in range(1, horizon + 1):
            low, high = first[_index(row + letter)], first[_index(row + letter + 1)]
            row = _index(row + letters)
            action = _index(draw_action(q, u, s, best, epsilon, uniform(stream)))
            option = _index(choice[s, action])
            outcome, next_s, w, gained, over = advance(world, t, s, w, action, uniform(stream))
            letter = _index(world[12][s, action, outcome])
            next_u = _index(delta[u, letter])
            best = best_value(q, next_u, next_s)
            target = gained if over else gained + gamma * best
            q[u, s, action] = np.float32(q[u, s, action] + alpha * (target - q[u, s, action]))
            for place in range(low, high):
                v = _index(states[_index(place)])
                if v != u and outlook[option, v] == outlook[option, u]:
                    next_v = _index(delta[v, letter])
                    target = gained if over else gained + gamma * best_value(q, next_v, next_s)
                    q[v, s, action] = np.float32(q[v, s, action] + alpha * (target - q[v, s, action]))
            if s == next_s:
                # an update may have changed the best value of the very state that comes next
                best = best_value(q, next_u, next_s)
            u, s = next_u, next_s
            paths[episode, t] = s
            total += gained
            if over:
                break
        returns[episode] = total
