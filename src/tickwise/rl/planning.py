"""Exact values by planning on the product of a world and its hidden task."""

from __future__ import annotations

from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import TaskTable
from tickwise.rl.kernels import backward_induction


def optimal_value(mdp: TabularMDP, task: TaskTable) -> float:
    """The optimal value V*: the greatest expected undiscounted return, averaged over the initial states.

    It is exact: backward induction over (task state, MDP state, tick), with the hidden task in view.

    Args:
        mdp: The world.
        task: The hidden task over the world's states.

    Returns:
        V*, in units of reward.
    """
    return _value(mdp, task, 1.0)


def worst_value(mdp: TabularMDP, task: TaskTable) -> float:
    """The least expected undiscounted return, averaged over the initial states; see `optimal_value`."""
    return _value(mdp, task, -1.0)


def _value(mdp: TabularMDP, task: TaskTable, sign: float) -> float:
    values = backward_induction(
        mdp.successor, mdp.probability, task.delta, task.letter, task.reward, task.final_reward,
        task.terminated, task.horizon, sign,
    )  # fmt: skip
    first = task.delta[0, task.letter]
    return float(mdp.initial @ values[first, range(mdp.n_states)])
