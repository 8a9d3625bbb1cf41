"""The extended state by definition: the run of an automaton on all that was recorded so far; and episodes to record."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from tests.strategies import VARIABLES, random_trajectories
from tickwise.automata.build import timed_automata
from tickwise.automata.run import EdgeStep, run
from tickwise.logic.sdnf import SDNF
from tickwise.logic.semantics import verdict


def chosen(sdnf: SDNF, first: np.ndarray) -> int:
    """The disjunct whose first region's centre (where it is open, whose near side) is nearest at tick 0."""
    distances = []
    for disjunct in sdnf.disjuncts:
        total = 0.0
        for bound in disjunct.primitives[0].box.bounds:
            value = first[VARIABLES.index(bound.variable)]
            closed = np.isfinite(bound.lower) and np.isfinite(bound.upper)
            nearest = (bound.lower + bound.upper) / 2 if closed else min(max(value, bound.lower), bound.upper)
            total += (value - nearest) ** 2
        distances.append(np.sqrt(total))
    return distances.index(min(distances))


def extended_state(sdnf: SDNF, X: np.ndarray, *, reduce: bool = False) -> dict[str, Any]:
    """Location, clocks, stage and verdict after the last row of X, shape (ticks, variables)."""
    index = chosen(sdnf, X[0])
    automata = timed_automata(sdnf)
    automaton = automata[index]
    last = run(automaton, X, variables=VARIABLES).steps[-1]
    assert isinstance(last, EdgeStep)
    # clocks stop where no guard can tell values apart any more, and rest at 0 where they are not in use
    constants = [atom.value for edge in automaton.edges for atom in edge.guard]
    highest = max([automaton.conjunction.primitives[-1].end, *constants])
    clocks = [min(value, highest) for value in last.after]
    if reduce:
        clocks = [value if clock in automaton.active[last.target] else 0 for clock, value in enumerate(clocks)]
    width = max(len(each.clocks) for each in automata)
    return {
        "location": sum(len(each.locations) for each in automata[:index]) + last.target,
        "clocks": clocks + [0] * (width - len(clocks)),
        "stage": automaton.stages[last.target],
        "verdict": int(verdict(sdnf.formula, X, variables=VARIABLES)),
        "disjunct": index,
    }


class Replay(gymnasium.Env[Any, Any]):
    """Goes along given trajectories, one an episode, whatever is done; each ends as it is said to."""

    def __init__(self, episodes: list[np.ndarray], truncated: bool = False) -> None:
        self.observation_space = spaces.Box(-100, 100, (2,), dtype=np.float64)
        self.action_space = spaces.Discrete(2)
        self.episodes, self.number, self.tick, self.truncated = episodes, -1, 0, truncated

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        super().reset(seed=seed)
        del options
        self.number, self.tick = (self.number + 1) % len(self.episodes), 0
        return self.episodes[self.number][0].copy(), {"episode": self.number}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        del action
        self.tick += 1
        rows = self.episodes[self.number]
        over = self.tick == len(rows) - 1
        ends = over and not self.truncated, over and self.truncated
        return rows[self.tick].copy(), float(self.tick), *ends, {"episode": self.number}


def episodes(seed: int) -> list[np.ndarray]:
    """Three trajectories of 2 to 14 ticks."""
    rng = np.random.default_rng(seed)
    return [random_trajectories(seed + n, 1, int(rng.integers(2, 15)), 2)[0] for n in range(3)]
