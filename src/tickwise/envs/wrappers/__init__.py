"""Wrappers that make any Gymnasium environment one whose time matters, or can be seen to matter."""

from tickwise.envs.wrappers.collect import CollectTrajectories
from tickwise.envs.wrappers.extended import ExtendedState
from tickwise.envs.wrappers.labelled import Labelled
from tickwise.envs.wrappers.shaping import PotentialShaping
from tickwise.envs.wrappers.tau import TauState
from tickwise.envs.wrappers.timed import TimedTask
from tickwise.envs.wrappers.vector import VectorExtendedState, VectorLabelled

__all__ = [
    "CollectTrajectories",
    "ExtendedState",
    "Labelled",
    "PotentialShaping",
    "TauState",
    "TimedTask",
    "VectorExtendedState",
    "VectorLabelled",
]
