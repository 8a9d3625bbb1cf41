"""A new task as a library sees it: labelled trajectories, and what is known of where they are from."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np

from tickwise._wording import brief, listed
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.prior import PathPrior
from tickwise.inference.space import SearchSpace
from tickwise.inference.swarm import SwarmSettings
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings, Search
from tickwise.logic.sdnf import SDNF
from tickwise.rl.learner import LearningForm, QLearning
from tickwise.rl.states import Memory, automaton_memory, disjunct_choice
from tickwise.transfer.hypothesis import Task, tick_tables
from tickwise.transfer.rehearsal import Goal


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """A new task; `in_world` and `of_data` make one.

    Attributes:
        task: Its trajectories, prior and space of parameters.
        horizon: The length L of an episode, in ticks.
        mdp: Its world, or a model of it; None where none is known, so that nothing can be foreseen or transferred.
        settings: When a formula is satisfying (Problem 1).
        search: How parameters are fitted.
        disjunct: The strategy that chooses the disjunct (see `tickwise.rl.states.DISJUNCT_CHOICES`).
        form: The form of learning that goes on from what is transferred, and that is rehearsed.
        goal: When the task counts as learned in a rehearsal, or at a lower level (see `tickwise.library.outlook`).
        seed: The seed of the fits and of the rehearsals.
    """

    task: Task
    horizon: int
    mdp: TabularMDP | None
    settings: InferenceSettings = field(default_factory=InferenceSettings)
    search: Search = field(default_factory=SwarmSettings)
    disjunct: str = "nearest_centroid"
    form: LearningForm = field(default_factory=QLearning)
    goal: Goal = field(default_factory=Goal)
    seed: int = 0

    @property
    def world(self) -> TabularMDP:
        """The world.

        Raises:
            ConfigurationError: If none is known.
        """
        if self.mdp is None:
            raise ConfigurationError("values are transferred into a world, and none is known of the new task; name one")
        return self.mdp

    def memory(self, formula: SDNF) -> Memory:
        """The extended states of a formula in the world.

        Raises:
            ConfigurationError: If no world is known.
        """
        return automaton_memory(self.world, tick_tables(formula, self.horizon), disjunct_choice(self.disjunct))

    @classmethod
    def in_world(
        cls,
        data: LabelledTrajectories,
        mdp: TabularMDP,
        horizon: int,
        settings: InferenceSettings | None = None,
        search: Search | None = None,
        *,
        disjunct: str = "nearest_centroid",
        form: LearningForm | None = None,
        goal: Goal | None = None,
        seed: int = 0,
    ) -> Target:
        """A task in a world that is known, or estimated (see `tickwise.envs.estimation`).

        The prior is uniform over the world's paths, as in the paper, and regions consist of whole cells.

        Args:
            data: Its trajectories; variables that the world does not have are left out.
            mdp: The world.
            horizon: The length L of an episode, in ticks.
            settings: When a formula is satisfying; by default as for `tickwise infer`.
            search: How parameters are fitted; by default by the paper's swarm.
            disjunct: The strategy that chooses the disjunct.
            form: The form of learning; by default Q-learning with the default settings.
            goal: When the task counts as learned in a rehearsal; by default as `Goal` has it.
            seed: The seed of the fits and of the rehearsals.

        Raises:
            ConfigurationError: If the horizon is less than 1.
            DataError: If a label or a variable is missing, or a trajectory leaves the world or outlasts the horizon.
        """
        known = _columns(data, mdp.variables)
        if horizon < 1:
            raise ConfigurationError(f"an episode of {horizon} ticks is none; use a horizon of 1 or more")
        if known.horizon > horizon:
            raise DataError(
                f"a trajectory goes on until tick {known.horizon}, and an episode ends at {horizon}; cut it"
            )
        _check_places(known, mdp)
        prior = PathPrior(mdp.support_graph(), mdp.coordinates, mdp.variables, horizon)
        task = Task(known, prior, cells_space(mdp, horizon))
        return cls(
            task, horizon, mdp, settings or InferenceSettings(), search or SwarmSettings(), disjunct,
            form or QLearning(), goal or Goal(), seed,
        )  # fmt: skip

    @classmethod
    def of_data(
        cls,
        data: LabelledTrajectories,
        settings: InferenceSettings | None = None,
        search: Search | None = None,
        *,
        seed: int = 0,
    ) -> Target:
        """A task of whose world nothing but trajectories is known; prior and space are those of `tickwise infer`.

        Raises:
            DataError: If a label is missing, or every trajectory has a single tick.
        """
        data.require_both_classes()
        space = SearchSpace.from_data(data)
        task = Task(data, space.box_prior(data.horizon), space)
        return cls(task, data.horizon, None, settings or InferenceSettings(), search or SwarmSettings(), seed=seed)


def cells_space(mdp: TabularMDP, horizon: int) -> SearchSpace:
    """Boxes with sides halfway between neighbouring cells' centres, or at the world's limits: unions of whole cells."""
    edges = []
    for column, (low, high) in enumerate(mdp.limits):
        centres = np.unique(mdp.cell_coordinates[:, column]).tolist()
        between = [(left + right) / 2 for left, right in itertools.pairwise(centres)]
        edges.append((float(low), *(edge for edge in between if low < edge < high), float(high)))
    return SearchSpace(mdp.variables, tuple(edges), horizon, (False,) * len(edges))


def _columns(data: LabelledTrajectories, variables: tuple[str, ...]) -> LabelledTrajectories:
    """The trajectories with the columns of a world, in its order."""
    data.require_both_classes()
    missing = [name for name in variables if name not in data.variables]
    if missing:
        raise DataError(
            f"the trajectories have no {listed(missing)}, which the world has; they have {listed(data.variables)}"
        )
    columns = [data.variables.index(name) for name in variables]
    return LabelledTrajectories(data.values[..., columns], data.lengths, data.labels, variables, data.ids)


def _check_places(data: LabelledTrajectories, mdp: TabularMDP) -> None:
    for column, (name, (low, high)) in enumerate(zip(mdp.variables, mdp.limits, strict=True)):
        values = data.values[..., column]
        outside = (values < low) | (values > high)  # NaN is neither
        if outside.any():
            row, tick = (int(index) for index in np.argwhere(outside)[0])
            raise DataError(
                f"trajectory {brief(data.ids[row])}, tick {tick}: {name} is {values[row, tick]:g}, and the world goes "
                f"from {low:g} to {high:g}; name the world that the trajectories are from"
            )
