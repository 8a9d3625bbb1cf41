"""Labelled trajectories, recorded while any agent acts."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from tickwise.envs.wrappers.labelled import FEATURES, feature_names
from tickwise.envs.wrappers.recording import Recording
from tickwise.errors import DataError


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """A finished episode.

    Attributes:
        features: The features at each tick, shape ``(ticks, features)``.
        total: The undiscounted return.
        truncated: Whether it was cut off before an end of its own.
        info: The last ``info``.
    """

    features: NDArray[np.float64]
    total: float
    truncated: bool
    info: dict[str, Any]


def succeeded(episode: Episode) -> bool:
    """Whether an episode was good: by ``info["is_success"]`` where it is told, else by a return above 0."""
    return bool(episode.info.get("is_success", episode.total > 0))


class CollectTrajectories(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Record the trajectory and the label of every finished episode, whoever acts (the data collection phase).

    The file is an NPZ file as `read_trajectories` and ``tickwise infer`` read it. `write` and `close` write it, all or
    nothing, and so does the end of the program, be it by Ctrl-C or an error. Until then each episode is in a journal,
    the file's name with ``.part``, as soon as it has finished: of a process that was killed, ``resume=True`` finds all
    of them. An episode that is cut off by another `reset` is not recorded: it has no label.

    Args:
        env: An environment with named features: wrap it in `Labelled` first.
        path: The file, which must end in ``.npz``; None keeps the trajectories in memory only.
        label: Whether an episode was good (label 1, else -1); by default `succeeded`.
        resume: Whether to go on with a file that is there already, or was begun; without it such a file is refused.

    Attributes:
        feature_names: The names of the trajectories' columns.

    Raises:
        ConfigurationError: If the environment has no named features, or the file has another ending or is there
            already.
        DataError: If a file to go on with has other features, or no episodes.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        path: str | Path | None = None,
        label: Callable[[Episode], bool] = succeeded,
        *,
        resume: bool = False,
    ) -> None:
        RecordConstructorArgs.__init__(self, path=path, label=label, resume=resume)
        super().__init__(env)
        self.feature_names = feature_names(env, "CollectTrajectories")
        self._label = label
        self._recording = Recording(None if path is None else Path(path), self.feature_names, resume=resume)
        weakref.finalize(self, self._recording.write)
        self._ticks: list[NDArray[np.float64]] = []
        self._total = 0.0

    def __len__(self) -> int:
        """The number of recorded episodes."""
        return len(self._recording.episodes)

    def trajectories(self) -> tuple[list[NDArray[np.float64]], NDArray[np.int64]]:
        """What was recorded, as `MITLClassifier.fit` and `LabelledTrajectories.from_arrays` take it.

        Returns:
            A list of arrays of shape ``(ticks, features)``, and the labels 1 or -1, shape ``(episodes,)``.
        """
        return list(self._recording.episodes), np.array(self._recording.labels, dtype=np.int64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; see the wrapped environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._ticks, self._total = [self._finite(info[FEATURES])], 0.0
        return observation, info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick; at the last one of an episode its trajectory is recorded.

        Raises:
            DataError: If a feature is infinite.
            StoreError: If the journal cannot be written.
        """
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._ticks.append(self._finite(info[FEATURES]))
        self._total += float(reward)
        if terminated or truncated:
            episode = Episode(np.array(self._ticks), self._total, truncated and not terminated, info)
            self._recording.add(episode.features, 1 if self._label(episode) else -1)
        return observation, reward, terminated, truncated, info

    def write(self) -> None:
        """Write what was recorded, if a file was named.

        Raises:
            StoreError: If it cannot be written; what is there already stays.
        """
        self._recording.write()

    def _finite(self, features: NDArray[np.float64]) -> NDArray[np.float64]:
        if not np.isfinite(features).all():
            name = self.feature_names[int(np.argmin(np.isfinite(features)))]
            raise DataError(f"the feature {name!r} is infinite; trajectories need finite numbers, so clip it")
        return features

    def close(self) -> None:
        """Write what was recorded, and close the environment."""
        self.write()
        super().close()
