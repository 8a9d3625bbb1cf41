"""An entry of a library: a task that was learned once, with all that is needed to go on from it in another one."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._arrays import frozen_array
from tickwise._wording import brief, listed
from tickwise.automata.ticks import TickTable
from tickwise.envs.tabulate import TabularMDP
from tickwise.errors import ConfigurationError, DataError
from tickwise.logic.sdnf import SDNF
from tickwise.rl.states import Memory, automaton_memory, disjunct_choice
from tickwise.transfer.hypothesis import tick_tables

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def check_name(name: str) -> str:
    """The name, if an entry may have it: it is the name of files on any system.

    Raises:
        ConfigurationError: If it may not.
    """
    if not isinstance(name, str) or not _NAME.fullmatch(name) or name.endswith("."):
        raise ConfigurationError(
            f"the name {brief(name)} is no name of an entry; use up to 64 letters, digits, '.', '_' and '-', a letter "
            "or digit first"
        )
    return name


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """A learned task: its formula, its world and its Q-function on extended states, and where it is from.

    Attributes:
        name: Its name in the library.
        formula: φ in SDNF; its timed automata follow from it.
        mdp: The world that it was learned in.
        horizon: The length L of an episode, in ticks.
        q: The extended Q-function Q̄, float32, shape ``(memory states, states, actions)``, in the order of `memory`.
        disjunct: The name of the strategy that chooses the disjunct (see `tickwise.rl.states.DISJUNCT_CHOICES`).
        landmarks: What places are compared relative to in a transfer (Algorithm 2, line 6): for each disjunct an array
            of shape ``(primitives, variables)`` in world units. If left out, the regions' centroids, as in the paper.
        facts: How well the formula classifies, and what else is known of it, as plain data.
        provenance: Where it is from, as plain data.

    Raises:
        ConfigurationError: If the name, the horizon or the strategy is none.
        DataError: If the formula names what the world does not have, or an array has a wrong shape or value.
    """

    name: str
    formula: SDNF
    mdp: TabularMDP
    horizon: int
    q: NDArray[np.float32]
    disjunct: str = "nearest_centroid"
    landmarks: tuple[NDArray[np.float64], ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_name(self.name)
        if isinstance(self.horizon, bool) or not isinstance(self.horizon, int | np.integer) or self.horizon < 1:
            raise ConfigurationError(f"the horizon of {self.name} is {brief(self.horizon)}; use ticks, 1 or more")
        object.__setattr__(self, "horizon", int(self.horizon))
        _check_variables(self.formula, self.mdp)
        q = np.asarray(self.q)
        wanted = (self.memory().n_states, self.mdp.n_states, self.mdp.n_actions)
        if q.shape != wanted or q.dtype.kind not in "iuf":
            raise DataError(
                f"the Q-function of {self.name} is of shape {q.shape} and type {q.dtype}; the formula and the world "
                f"need numbers of shape {wanted}: table states, states, actions"
            )
        with np.errstate(over="ignore"):  # what is infinite then is refused
            object.__setattr__(self, "q", frozen_array(q, np.float32))
        if not np.isfinite(self.q).all():
            raise DataError(f"the Q-function of {self.name} has a value that is not finite")
        found = self.landmarks or centroids(self.formula, self.mdp)
        shapes = [(len(disjunct.primitives), len(self.mdp.variables)) for disjunct in self.formula.disjuncts]
        arrays = tuple(frozen_array(array, np.float64) for array in found)
        if [array.shape for array in arrays] != shapes or not all(np.isfinite(array).all() for array in arrays):
            raise DataError(
                f"the landmarks of {self.name} do not fit; give finite numbers, an array of primitives × variables for "
                "each disjunct"
            )
        object.__setattr__(self, "landmarks", arrays)

    @property
    def tables(self) -> tuple[TickTable, ...]:
        """The tick table of each disjunct's timed automaton."""
        return tick_tables(self.formula, self.horizon)

    def memory(self) -> Memory:
        """The extended states that the Q-function is over."""
        return automaton_memory(self.mdp, self.tables, disjunct_choice(self.disjunct))


def centroids(formula: SDNF, mdp: TabularMDP) -> tuple[NDArray[np.float64], ...]:
    """Cr(ρ) of each region within a world, for each disjunct an array of shape ``(primitives, variables)``."""
    return tuple(
        np.array([primitive.box.centroid(mdp.variables, mdp.limits) for primitive in disjunct.primitives])
        for disjunct in formula.disjuncts
    )


def stamped(provenance: Mapping[str, Any]) -> dict[str, Any]:
    """A provenance with the version of Tickwise and the date, in UTC, where it has none."""
    now = datetime.now(UTC).isoformat(timespec="seconds")
    return {"version": version("tickwise"), "date": now.replace("+00:00", "Z"), **provenance}


def _check_variables(formula: SDNF, mdp: TabularMDP) -> None:
    boxes = (primitive.box for disjunct in formula.disjuncts for primitive in disjunct.primitives)
    unknown = sorted({name for box in boxes for name in box.variables} - set(mdp.variables))
    if unknown:
        raise DataError(
            f"the formula names {listed(unknown)}, which the world does not have; it has {listed(mdp.variables)}"
        )
