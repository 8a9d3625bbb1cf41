"""Learn when things must happen: MITL formulas from labelled trajectories, timed automata, and transfer.

The names below are the public surface; each is imported when it is first used, so that ``import tickwise`` is
quick. ``gymnasium.make("tickwise:CaseStudy1Source-v0")`` finds the environments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tickwise.envs.registration import register_with_gymnasium

if TYPE_CHECKING:
    from tickwise.automata.build import timed_automata
    from tickwise.automata.model import TimedAutomaton
    from tickwise.automata.ticks import TickTable
    from tickwise.envs.gridworld import GridWorld
    from tickwise.envs.wrappers import (
        CollectTrajectories,
        ExtendedState,
        Labelled,
        PotentialShaping,
        TauState,
        TimedTask,
        VectorExtendedState,
        VectorLabelled,
    )
    from tickwise.errors import TickwiseError
    from tickwise.inference.classifier import MITLClassifier
    from tickwise.inference.information import information_gain, probability
    from tickwise.inference.prior import BoxPrior, MarkovPrior, PathPrior
    from tickwise.inference.reading import read_trajectories
    from tickwise.inference.trajectories import LabelledTrajectories
    from tickwise.logic.parse import parse
    from tickwise.logic.sdnf import SDNF, Primitive, to_sdnf
    from tickwise.logic.structure import structurally_equivalent, structurally_transferable
    from tickwise.logic.syntax import Box, Formula, Verdict
    from tickwise.transfer.observations import ObservationMap
    from tickwise.transfer.qtransfer import transfer_q

    __version__: str

__all__ = [
    "SDNF",
    "Box",
    "BoxPrior",
    "CollectTrajectories",
    "ExtendedState",
    "Formula",
    "GridWorld",
    "Labelled",
    "LabelledTrajectories",
    "MITLClassifier",
    "MarkovPrior",
    "ObservationMap",
    "PathPrior",
    "PotentialShaping",
    "Primitive",
    "TauState",
    "TickTable",
    "TickwiseError",
    "TimedAutomaton",
    "TimedTask",
    "VectorExtendedState",
    "VectorLabelled",
    "Verdict",
    "information_gain",
    "parse",
    "probability",
    "read_trajectories",
    "structurally_equivalent",
    "structurally_transferable",
    "timed_automata",
    "to_sdnf",
    "transfer_q",
]

_HOMES = {
    "automata.build": ("timed_automata",),
    "automata.model": ("TimedAutomaton",),
    "automata.ticks": ("TickTable",),
    "envs.gridworld": ("GridWorld",),
    "envs.wrappers": (
        "CollectTrajectories",
        "ExtendedState",
        "Labelled",
        "PotentialShaping",
        "TauState",
        "TimedTask",
        "VectorExtendedState",
        "VectorLabelled",
    ),
    "errors": ("TickwiseError",),
    "inference.classifier": ("MITLClassifier",),
    "inference.information": ("information_gain", "probability"),
    "inference.prior": ("BoxPrior", "MarkovPrior", "PathPrior"),
    "inference.reading": ("read_trajectories",),
    "inference.trajectories": ("LabelledTrajectories",),
    "logic.parse": ("parse",),
    "logic.sdnf": ("SDNF", "Primitive", "to_sdnf"),
    "logic.structure": ("structurally_equivalent", "structurally_transferable"),
    "logic.syntax": ("Box", "Formula", "Verdict"),
    "transfer.observations": ("ObservationMap",),
    "transfer.qtransfer": ("transfer_q",),
}
"""The public names, by the module they live in."""


def _import_late(name: str) -> object:
    """The value of a public name, imported from its module on first use."""
    if name == "__version__":
        from importlib.metadata import version

        value: object = version("tickwise")
    else:
        home = next((module for module, names in _HOMES.items() if name in names), None)
        if home is None:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        from importlib import import_module

        value = getattr(import_module(f"{__name__}.{home}"), name)
    globals()[name] = value
    return value


if not TYPE_CHECKING:  # a type checker would believe that every name exists
    __getattr__ = _import_late


def __dir__() -> list[str]:
    """The public names and what was imported so far."""
    return sorted({*globals(), *__all__, "__version__"})


register_with_gymnasium()
