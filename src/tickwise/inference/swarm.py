"""Particle swarm optimisation (Eberhart and Kennedy) with inertia, restarts and a final local search.

The swarm moves in a box of real vectors and knows nothing of formulas: whole numbers and constraints are the
objective's matter, which decodes a position. So the objective is a step function, and the swarm's best point is
often a step away from a better one; a pattern search with whole steps finishes each restart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ConfigurationError

_EVERY_STEP = 32  # steps of 1, 2, 3, … units up to here, then doubling

BatchObjective = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]
"""Values at positions ``(particles, dimensions)``; -inf is allowed where the given incumbent cannot be beaten."""


@dataclass(frozen=True, slots=True)
class SwarmSettings:
    """How hard a swarm searches; the defaults were chosen by measurement on Case Study 1.

    Attributes:
        particles: Number of particles.
        iterations: Most iterations of a restart.
        inertia: Share of the velocity that is kept (Clerc and Kennedy's constriction by default).
        cognitive: Pull towards the particle's own best position.
        social: Pull towards the best position of the particle's neighbours.
        restarts: Number of independent swarms.
        stall: Iterations without a better best after which a restart ends.
        climbers: How many of a swarm's best particles are finished by the local search.

    Raises:
        ConfigurationError: If a count is below 1 or a factor is negative.
    """

    particles: int = 60
    iterations: int = 80
    inertia: float = 0.7298
    cognitive: float = 1.4962
    social: float = 1.4962
    restarts: int = 2
    stall: int = 20
    climbers: int = 4

    def __post_init__(self) -> None:
        for name in ("particles", "iterations", "restarts", "stall", "climbers"):
            if getattr(self, name) < 1:
                raise ConfigurationError(f"swarm setting {name} is {getattr(self, name)}; use 1 or more")
        for name in ("inertia", "cognitive", "social"):
            if getattr(self, name) < 0:
                raise ConfigurationError(f"swarm setting {name} is {getattr(self, name)}; use 0 or more")


@dataclass(frozen=True, slots=True, eq=False)
class SwarmResult:
    """The best position found.

    Attributes:
        position: Shape ``(dimensions,)``.
        value: The objective there.
        evaluations: How many positions were evaluated.
    """

    position: NDArray[np.float64]
    value: float
    evaluations: int


def maximise(
    objective: BatchObjective,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    units: NDArray[np.float64],
    settings: SwarmSettings,
    rng: np.random.Generator,
    starts: NDArray[np.float64] | None = None,
) -> SwarmResult:
    """Maximise an objective over a box.

    Args:
        objective: See `BatchObjective`.
        lower: Lower ends of the box, shape ``(dimensions,)``.
        upper: Upper ends.
        units: The smallest step that matters in each dimension, shape ``(dimensions,)``.
        settings: How hard to search.
        rng: The source of all randomness.
        starts: Positions to begin from, shape ``(any, dimensions)``, dealt out over the restarts; the other
            particles begin anywhere, uniformly.

    Returns:
        The best position; of equal ones, the first found.
    """
    given = np.zeros((0, len(lower))) if starts is None else starts
    moves = _moves(units, upper - lower)
    best, evaluations = SwarmResult(lower, -np.inf, 0), 0
    for restart in range(settings.restarts):
        mine = given[restart :: settings.restarts][: settings.particles]
        own, value, spent = _one_swarm(objective, lower, upper, settings, rng, mine)
        evaluations += spent
        for particle in _best_distinct(np.rint(own / units), value, settings.climbers):
            peak = SwarmResult(own[particle].copy(), float(value[particle]), 0)
            found = climb(objective, lower, upper, moves, peak)
            evaluations += found.evaluations
            if found.value > best.value:
                best = found
    return replace(best, evaluations=evaluations)


def _best_distinct(places: NDArray[np.float64], value: NDArray[np.float64], most: int) -> list[int]:
    """The particles with the best values, best first, of those at the same place and of equal value only the first."""
    chosen: dict[tuple[float, ...], int] = {}
    for particle in np.argsort(-value, kind="stable"):
        chosen.setdefault((value[particle], *places[particle]), int(particle))
    return list(chosen.values())[:most]


def _one_swarm(
    objective: BatchObjective,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    settings: SwarmSettings,
    rng: np.random.Generator,
    starts: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """One swarm: each particle's own best position and its value, and the number of evaluations."""
    shape = (settings.particles, len(lower))
    width = upper - lower
    position = lower + width * rng.random(shape)
    position[: len(starts)] = np.clip(starts, lower, upper)
    velocity = (rng.random(shape) - 0.5) * width * 0.5
    own = position.copy()
    own_value = objective(position, np.full(settings.particles, -np.inf))
    record, stalled, evaluations = float(own_value.max()), 0, settings.particles
    for _ in range(settings.iterations):
        pull = settings.cognitive * rng.random(shape) * (own - position)
        pull += settings.social * rng.random(shape) * (_neighbours_best(own, own_value) - position)
        velocity = np.clip(settings.inertia * velocity + pull, -width / 2, width / 2)
        position = position + velocity
        outside = (position < lower) | (position > upper)
        velocity[outside] *= -0.5  # bounce off the walls
        position = np.clip(position, lower, upper)
        value = objective(position, own_value)
        evaluations += settings.particles
        better = value > own_value
        own[better], own_value[better] = position[better], value[better]
        stalled = 0 if own_value.max() > record else stalled + 1
        record = float(own_value.max())
        if stalled >= settings.stall:
            break
    return own, own_value, evaluations


def _neighbours_best(own: NDArray[np.float64], value: NDArray[np.float64]) -> NDArray[np.float64]:
    """The best own position among each particle and its two neighbours on a ring (Kennedy's local best)."""
    ring = np.stack((np.roll(value, 1), value, np.roll(value, -1)))
    step = ring.argmax(axis=0) - 1
    best: NDArray[np.float64] = own[(np.arange(len(own)) + step) % len(own)]
    return best


def climb(
    objective: BatchObjective,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    moves: NDArray[np.float64],
    start: SwarmResult,
) -> SwarmResult:
    """Pattern search from a position: take the best of many whole steps, in one or two dimensions, while one is better.

    Args:
        objective: See `BatchObjective`.
        lower: Lower ends of the box.
        upper: Upper ends.
        moves: The steps to try, shape ``(moves, dimensions)``.
        start: Where to begin.

    Returns:
        A position that none of the steps improves; its evaluations include those of ``start``.
    """
    while True:
        positions = np.clip(start.position + moves, lower, upper)
        values = objective(positions, np.full(len(moves), start.value))
        best = int(np.argmax(values))
        better = values[best] > start.value
        start = SwarmResult(
            positions[best] if better else start.position,
            float(values[best]) if better else start.value,
            start.evaluations + len(moves),
        )
        if not better:
            return start


def _moves(units: NDArray[np.float64], width: NDArray[np.float64]) -> NDArray[np.float64]:
    """Steps of many sizes along each dimension, and of one unit along each pair of dimensions."""
    basis = np.diag(units)
    rows = []
    for unit, span, direction in zip(units, width, basis, strict=True):
        size = 1
        while size * unit <= span:
            rows += [size * direction, -size * direction]
            size += 1 if size < _EVERY_STEP else size
    for i in range(len(units)):
        for j in range(i):
            rows += [a * basis[i] + b * basis[j] for a in (1, -1) for b in (1, -1)]
    return np.array(rows)
