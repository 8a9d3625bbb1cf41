"""Exact search over data in parts that are never held all at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from tickwise.errors import ConfigurationError, DataError
from tickwise.inference.exact import ExactResult, ExactSettings
from tickwise.inference.levels import Coded, Levels, code_parts
from tickwise.inference.objective import trajectory_weights
from tickwise.inference.prior import Prior
from tickwise.inference.space import SearchSpace
from tickwise.inference.trajectories import LabelledTrajectories
from tickwise.inference.tree import InferenceSettings, best_primitive


def scan_parts(
    parts: Iterable[LabelledTrajectories],
    space: SearchSpace,
    prior: Prior,
    settings: InferenceSettings,
    limits: ExactSettings,
) -> ExactResult:
    """Find the best primitive for data in parts: what an exact search finds at the root of the tree for all at once.

    The parts are gone through once, and each is held until the next has come. What is kept of a trajectory is its coded
    bits, ``2 * variables * levels + 1`` words of 8 bytes for every 64 ticks up to the horizon, and 9 bytes: 337 bytes
    for two variables with 10 levels and 41 ticks.

    The thresholds of a continuous variable come from the data. Where there is one, the parts are gone through once
    before, to keep the values of the continuous variables alone, 8 bytes each, those of one variable twice; they are
    let go before anything is coded.

    Args:
        parts: The labelled trajectories, such as `tickwise.inference.reading.read_parts` gives of a folder; with a
            continuous variable something that can be iterated twice, as that can.
        space: What boxes and times may be chosen.
        prior: The prior G_L.
        settings: λ, class weights and what a nested structure costs; the rest is not read.
        limits: The limits of the search.

    Returns:
        The best primitive.

    Raises:
        ConfigurationError: If a part's variables are not the space's, or an iterator comes with a continuous variable.
        DataError: If there is no part, or a label is missing.
        UnknownVariableError: If the prior lacks a variable.
    """
    if any(space.continuous) and isinstance(parts, Iterator):
        raise ConfigurationError(
            "continuous variables take two passes, but an iterator gives one; give a list, or what read_parts gives"
        )
    levels = Levels.of_parts(space, _checked(parts, space), limits.levels)
    coded = _weighed(code_parts(_checked(parts, space), levels, space.horizon), settings)
    return best_primitive(coded, levels, prior, space.gaps(), settings, limits)


def _checked(parts: Iterable[LabelledTrajectories], space: SearchSpace) -> Iterator[LabelledTrajectories]:
    part = None
    for part in parts:
        if part.variables != space.variables:
            raise ConfigurationError(
                f"the space has variables {', '.join(space.variables)}, the data {', '.join(part.variables)}; "
                "use the same"
            )
        yield part
    if part is None:
        raise DataError("there is no part; give at least one")


def _weighed(coded: Coded, settings: InferenceSettings) -> Coded:
    """With the class weights, which are known once all labels are."""
    if coded.positive.all() or not coded.positive.any():
        missing = -1 if coded.positive.all() else 1
        raise DataError(f"no trajectory has label {missing}; give trajectories of both labels, 1 and -1")
    labels = np.where(coded.positive, 1, -1).astype(np.int8)
    return coded._replace(weights=trajectory_weights(labels, settings.class_weight))
