"""The environments that come with Tickwise: the two case studies of the paper, source and target, and random ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from tickwise.envs.gridworld import GridWorld
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import ReachStayReach, Recurrence, Task, TaskTable
from tickwise.errors import ConfigurationError
from tickwise.logic.syntax import Box


@dataclass(frozen=True, slots=True)
class EnvironmentSpec:
    """A world and a hidden task in it.

    Attributes:
        name: The name, without a version.
        world: The dynamics.
        task: The hidden task.
    """

    name: str
    world: GridWorld
    task: Task

    @property
    def id(self) -> str:
        """The Gymnasium id."""
        return f"{self.name}-v0"

    def mdp(self) -> TabularMDP:
        """The world as arrays."""
        return self.world.mdp()

    def task_table(self) -> TaskTable:
        """The hidden task over the world's states, as arrays."""
        return self.task.table(self.mdp())


CASE_STUDY_1_SOURCE = EnvironmentSpec(
    "CaseStudy1Source",
    GridWorld(9),
    ReachStayReach(first=Box.of(x=(3, 4), y=(3, 5)), stay=4, second=Box.of(x=(7, 8), y=(5, 8)), deadline=40),
)
"""9×9: five ticks in a row in G^S = [3,4]×[3,5], later Y^S = [7,8]×[5,8], by tick 40."""

# The paper says of the true Y^T only that it differs from the inferred [4,7]×[1,2] and is close to it.
CASE_STUDY_1_TARGET = EnvironmentSpec(
    "CaseStudy1Target",
    GridWorld(9),
    ReachStayReach(first=Box.of(x=(5, 6), y=(6, 7)), stay=5, second=Box.of(x=(4, 7), y=(0, 2)), deadline=40),
)
"""9×9: six ticks in a row in G^T = [5,6]×[6,7], later Y^T = [4,7]×[0,2], by tick 40."""

# The paper shows the green regions of Case Study 2 only in a figure: where they lie is our choice.
CASE_STUDY_2_SOURCE = EnvironmentSpec(
    "CaseStudy2Source",
    GridWorld(5),
    Recurrence(
        regions=(Box.of(x=(2, 3), y=(2, 3)),),
        period=8,
        greens=(Box.of(x=(0, 1), y=(2, 3)), Box.of(x=(4, 5), y=(2, 3))),
        deadline=25,
    ),
)
"""5×5, 25 ticks: B^S = [2,3]² at least once in every 8 ticks, two green regions."""

CASE_STUDY_2_TARGET = EnvironmentSpec(
    "CaseStudy2Target",
    GridWorld(7),
    Recurrence(
        regions=(Box.of(x=(2, 3), y=(3, 4)), Box.of(x=(4, 5), y=(3, 4))),
        period=10,
        greens=tuple(Box.of(x=x, y=y) for x in ((2, 3), (4, 5)) for y in ((1, 2), (5, 6))),
        deadline=40,
    ),
)
"""7×7, 40 ticks: B_1^T = [2,3]×[3,4] or B_2^T = [4,5]×[3,4], the same one, every 10 ticks."""

CATALOG = {
    spec.name: spec for spec in (CASE_STUDY_1_SOURCE, CASE_STUDY_1_TARGET, CASE_STUDY_2_SOURCE, CASE_STUDY_2_TARGET)
}
"""All environments with a name of their own."""

RANDOM_TASK = "RandomTask"
"""The name of every environment that `tickwise.envs.random_tasks.random_task` draws."""


def find(name: str) -> EnvironmentSpec:
    """The environment of a name.

    Raises:
        ConfigurationError: If there is none.
    """
    if name not in CATALOG:
        raise ConfigurationError(f"there is no environment {name!r}; there are {', '.join(CATALOG)}")
    return CATALOG[name]


def register_all() -> None:
    """Register the environments with Gymnasium, where they are not registered yet.

    Each gets its plain id, which ``gymnasium.make("tickwise:CaseStudy1Source-v0")`` looks up, and the same
    id in the namespace ``tickwise/``. ``gymnasium.make("tickwise:RandomTask-v0", task_seed=17)`` draws a task.
    """
    from gymnasium.envs.registration import register, registry

    entries: list[tuple[str, str, dict[str, Any]]] = [
        (spec.id, "GridWorldEnv", {"specification": spec.name}) for spec in CATALOG.values()
    ]
    entries.append((f"{RANDOM_TASK}-v0", "RandomTaskEnv", {}))
    for plain_id, environment, settings in entries:
        for full_id in (plain_id, f"tickwise/{plain_id}"):
            if full_id not in registry:
                register(id=full_id, entry_point=f"tickwise.envs.environment:{environment}", kwargs=settings)
