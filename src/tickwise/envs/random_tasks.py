"""Random temporal tasks: a random world with a random formula as its hidden task, of measured difficulty."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from tickwise.envs.catalog import RANDOM_TASK, EnvironmentSpec
from tickwise.envs.gridworld import GridWorld
from tickwise.envs.planning import best_success_probability, success_probability
from tickwise.envs.tabulate import TabularMDP
from tickwise.envs.tasks import TaskTable
from tickwise.envs.temporal import Ending, FormulaTask, sdnf_table
from tickwise.errors import ConfigurationError
from tickwise.logic.sdnf import SDNF, Operator, Primitive, SequentialConjunction
from tickwise.logic.syntax import Box, Interval, Not

Kind: TypeAlias = tuple[Operator, bool]
"""What a structure fixes of a primitive: its operator, and whether its predicate is the complement of a box."""

Structure: TypeAlias = tuple[tuple[Kind, ...], ...]
"""For each disjunct the kinds of its primitives, in their order in time."""

_Part = TypeVar("_Part")

KINDS: tuple[Kind, ...] = tuple((operator, complemented) for operator in Operator for complemented in (False, True))
"""The eight kinds of primitives."""


@dataclass(frozen=True, slots=True)
class RandomTaskSettings:
    """What random tasks are drawn from, and how difficult they may be; ranges include both ends.

    The chance of a formula is its exact probability of success under uniformly random actions.

    Attributes:
        sizes: Cells along a side of the world.
        deadlines: The deadline, in ticks.
        disjuncts: How many disjuncts a structure has, where it is drawn.
        primitives: How many primitives a disjunct has, where the structure is drawn.
        durations: The duration of a nested operator, in ticks.
        region: A box covers at most this share of the world's cells, or one cell.
        complemented_region: The box of a complement covers at least this share of the world's cells, and not
            all of them: it is its outside that has to be small, or random actions would find it too often.
        disjoint: Whether no cell satisfies two predicates of one disjunct, so that none can stand for two.
        endings: When episodes end, drawn from these.
        windows: How many ticks the window of a primitive has.
        solvable: The least probability of success that planning must achieve, by each disjunct alone.
        chances: The chance of the whole formula.
        effect: Dropping a primitive from its disjunct must raise the disjunct's chance by this factor or more.
        contribution: Dropping a disjunct must lower the chance of the whole by this share of it or more.
        worlds: How many worlds are tried before giving up.
        trials: How many conjunctions are tried for each disjunct.
        compositions: How many times the disjuncts of a formula are drawn in a world.

    Raises:
        ConfigurationError: If a range is reversed or a number out of range.
    """

    sizes: tuple[int, int] = (5, 8)
    deadlines: tuple[int, int] = (20, 32)
    disjuncts: tuple[int, int] = (1, 2)
    primitives: tuple[int, int] = (1, 2)
    durations: tuple[int, int] = (2, 6)
    region: float = 1 / 6
    complemented_region: float = 0.5
    disjoint: bool = False
    endings: tuple[Ending, ...] = ("deadline", "violated", "decided")
    windows: tuple[int, int] = (1, 100)
    solvable: float = 0.95
    chances: tuple[float, float] = (0.005, 0.2)
    effect: float = 2.0
    contribution: float = 0.25
    worlds: int = 500
    trials: int = 100
    compositions: int = 5

    def __post_init__(self) -> None:
        for name, least in (
            ("sizes", 2),
            ("deadlines", 1),
            ("disjuncts", 1),
            ("primitives", 1),
            ("durations", 1),
            ("windows", 1),
        ):
            low, high = getattr(self, name)
            if not least <= low <= high:
                raise ConfigurationError(f"{name} is {(low, high)}; use a range of whole numbers from {least} on")
        for name in ("region", "complemented_region", "solvable", "contribution"):
            if not 0 <= getattr(self, name) <= 1:
                raise ConfigurationError(f"{name} is {getattr(self, name)!r}; use a number from 0 to 1")
        if not 0 <= self.chances[0] <= self.chances[1] <= 1:
            raise ConfigurationError(f"chances is {self.chances}; use a range of probabilities")
        if not self.effect >= 1:
            raise ConfigurationError(f"effect is {self.effect!r}; use a factor of 1 or more")
        for name in ("worlds", "trials", "compositions"):
            if getattr(self, name) < 1:
                raise ConfigurationError(f"{name} is {getattr(self, name)!r}; use 1 or more")


def random_task(
    rng: np.random.Generator, structure: Structure | None = None, *, settings: RandomTaskSettings | None = None
) -> EnvironmentSpec:
    """Draw a random world and a random formula as its hidden task, until the task is neither trivial nor hopeless.

    Each disjunct can be achieved almost certainly with the task in view (see `best_success_probability`), random
    actions achieve the whole now and then (see `success_probability`), and no primitive or disjunct is idle.
    World, deadline and, where it is not given, structure are drawn anew where some formulas did not do, so
    easier ones are more frequent.

    Args:
        rng: The generator that all draws come from; the same state gives the same task.
        structure: For each disjunct the pairs (operator, whether complemented) of its primitives; by default
            drawn.
        settings: Ranges and bounds.

    Returns:
        The world and the task, a `FormulaTask`.

    Raises:
        ConfigurationError: If the structure is malformed or nothing was found.
    """
    settings = RandomTaskSettings() if settings is None else settings
    wanted = None if structure is None else _checked(structure)
    ends = settings.endings[int(rng.integers(len(settings.endings)))]
    for _ in range(settings.worlds):
        kinds = _structure(rng, settings) if wanted is None else wanted
        world = GridWorld(_between(rng, settings.sizes))
        arena = _Arena(world.mdp(), _between(rng, settings.deadlines), settings)
        formula = _formula(rng, kinds, world.size, arena)
        if formula is not None:
            return EnvironmentSpec(RANDOM_TASK, world, FormulaTask(str(formula), arena.deadline, ends=ends))
    what = "task" if wanted is None else f"task of the structure {structure_text(wanted)}"
    raise ConfigurationError(
        f"no random {what} was found in {settings.worlds} worlds; widen the settings' chances, effect or "
        "contribution, or try more worlds"
    )


def structure_text(structure: Structure) -> str:
    """A structure on one line, for instance ``FG p & F !p | G p``."""
    return " | ".join(
        " & ".join(f"{operator.value} {'!' if complemented else ''}p" for operator, complemented in disjunct)
        for disjunct in structure
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Arena:
    """A world and a deadline, in which formulas are tried."""

    mdp: TabularMDP
    deadline: int
    settings: RandomTaskSettings

    def table(self, *disjuncts: SequentialConjunction) -> TaskTable:
        # the same chances as without an early end, in less time
        return sdnf_table(SDNF(disjuncts), self.mdp, self.deadline, ends="decided")

    def chance(self, *disjuncts: SequentialConjunction) -> float:
        return success_probability(self.mdp, self.table(*disjuncts))

    def solvable(self, table: TaskTable) -> bool:
        return best_success_probability(self.mdp, table) >= self.settings.solvable


def _checked(structure: Structure) -> Structure:
    try:
        kinds = tuple(tuple((Operator(operator), bool(no)) for operator, no in disjunct) for disjunct in structure)
    except (TypeError, ValueError):
        kinds = ()
    if not kinds or not all(kinds):
        raise ConfigurationError(
            f"{structure!r} is no structure; give for each disjunct its pairs (operator, whether complemented), such "
            "as ((('FG', False), ('F', True)),)"
        )
    return kinds


def _between(rng: np.random.Generator, ends: tuple[int, int]) -> int:
    return int(rng.integers(ends[0], ends[1], endpoint=True))


def _structure(rng: np.random.Generator, settings: RandomTaskSettings) -> Structure:
    return tuple(
        tuple(KINDS[rng.integers(len(KINDS))] for _ in range(_between(rng, settings.primitives)))
        for _ in range(_between(rng, settings.disjuncts))
    )


def _formula(rng: np.random.Generator, structure: Structure, size: int, arena: _Arena) -> SDNF | None:
    """A formula within all bounds, unless the trials are used up."""
    settings = arena.settings
    low, high = settings.chances
    # what follows for each disjunct, since it must matter and not be all that matters
    bounds = (low, high) if len(structure) == 1 else (low * settings.contribution, high * (1 - settings.contribution))
    for _ in range(settings.compositions):
        disjuncts: list[SequentialConjunction] = []
        for kinds in structure:
            tried = (_conjunction(rng, kinds, size, arena, bounds) for _ in range(settings.trials))
            found = next((conjunction for conjunction in tried if conjunction is not None), None)
            if found is None:
                return None
            disjuncts.append(found)
        if len(disjuncts) == 1 or _all_contribute(disjuncts, arena):
            return SDNF(tuple(disjuncts))
    return None


def _all_contribute(disjuncts: Sequence[SequentialConjunction], arena: _Arena) -> bool:
    """Whether the chance of the whole is within bounds, and without any one disjunct clearly less."""
    low, high = arena.settings.chances
    whole = arena.chance(*disjuncts)
    most = (1 - arena.settings.contribution) * whole
    return low <= whole <= high and all(arena.chance(*rest) <= most for rest in _without_one(disjuncts))


def _conjunction(
    rng: np.random.Generator, kinds: Sequence[Kind], size: int, arena: _Arena, chances: tuple[float, float]
) -> SequentialConjunction | None:
    """A conjunction that is solvable, of a chance within bounds, and whose primitives all matter; or None."""
    primitives = _primitives(rng, kinds, size, arena)
    if primitives is None or (len(primitives) == 1 and _too_likely(primitives[0], size, chances[1])):
        return None
    several = len(primitives) > 1
    if several and not all(_may_serve(primitive, arena, chances[0]) for primitive in primitives):
        return None
    whole = SequentialConjunction(primitives)
    table = arena.table(whole)
    chance = success_probability(arena.mdp, table)
    if not chances[0] <= chance <= chances[1]:
        return None
    rests = (SequentialConjunction(rest) for rest in _without_one(primitives)) if several else ()
    if any(arena.chance(rest) < arena.settings.effect * chance for rest in rests):
        return None
    return whole if arena.solvable(table) else None


def _too_likely(primitive: Primitive, size: int, most: float) -> bool:
    """Whether ◇ has about too great a chance at any single tick, by the share of the cells where it holds."""
    width, height = (int(bound.upper - bound.lower) for bound in primitive.box.bounds)
    share = width * height / size**2
    return primitive.operator is Operator.EVENTUALLY and (1 - share if primitive.complemented else share) > most


def _may_serve(primitive: Primitive, arena: _Arena, least: float) -> bool:
    """What a primitive of a longer conjunction must satisfy alone; it costs less than trying the conjunction."""
    table = arena.table(SequentialConjunction((primitive,)))
    return success_probability(arena.mdp, table) >= least * arena.settings.effect and arena.solvable(table)


def _without_one(parts: Sequence[_Part]) -> list[tuple[_Part, ...]]:
    return [(*parts[:index], *parts[index + 1 :]) for index in range(len(parts))]


def _primitives(
    rng: np.random.Generator, kinds: Sequence[Kind], size: int, arena: _Arena
) -> tuple[Primitive, ...] | None:
    """Random primitives with consecutive effect windows (Definition 5), or None where they do not fit."""
    count = len(kinds)
    if arena.deadline + 1 < count:
        return None
    # sorted draws without repetition, moved together so that a window may be a single tick
    ticks = np.sort(rng.choice(arena.deadline + 1 + count, 2 * count, replace=False))
    starts = (ticks[::2] - np.arange(count)).tolist()
    ends = (ticks[1::2] - np.arange(1, count + 1)).tolist()
    primitives = []
    for (operator, complemented), start, end in zip(kinds, starts, ends, strict=True):
        duration = _between(rng, arena.settings.durations) if operator.nested else 0
        box = _box(rng, size, complemented, arena.settings)
        if complemented and operator in (Operator.EVENTUALLY, Operator.EVENTUALLY_ALWAYS) and rng.random() < 0.5:
            # the outside of a box is a row of cells or more: in a long window chance nearly always finds it
            end = min(end, start + duration + arena.settings.windows[0] + _between(rng, (-1, 1)))
        if not arena.settings.windows[0] <= end - duration - start + 1 <= arena.settings.windows[1]:
            return None
        window = Interval(start, end - duration)
        primitives.append(Primitive(operator, window, duration, Not(box) if complemented else box))
    if arena.settings.disjoint and any(_overlap(*pair, size) for pair in combinations(primitives, 2)):
        return None
    return tuple(primitives)


def _overlap(one: Primitive, other: Primitive, size: int) -> bool:
    """Whether the predicates of two primitives hold in a cell of a world together."""
    return bool((_cells(one, size) & _cells(other, size)).any())


def _cells(primitive: Primitive, size: int) -> NDArray[np.bool_]:
    """The cells where the predicate of a primitive holds, shape ``(size, size)``."""
    cells = np.zeros((size, size), dtype=np.bool_)
    x, y = (slice(int(bound.lower), int(bound.upper)) for bound in primitive.box.bounds)
    cells[x, y] = True
    return ~cells if primitive.complemented else cells


def _box(rng: np.random.Generator, size: int, complemented: bool, settings: RandomTaskSettings) -> Box:
    """A random rectangle of whole cells: first its sides, then its place."""
    width, height = np.indices((size, size)).reshape(2, -1) + 1
    area = width * height
    if complemented:
        least = min(settings.complemented_region * size**2, size**2 - size)
        fits = (area >= least) & (area < size**2)
    else:
        fits = area <= max(1, math.floor(settings.region * size**2))
    chosen = rng.choice(np.flatnonzero(fits))
    sides = int(width[chosen]), int(height[chosen])
    left, bottom = (int(rng.integers(size - side, endpoint=True)) for side in sides)
    return Box.of(x=(left, left + sides[0]), y=(bottom, bottom + sides[1]))
