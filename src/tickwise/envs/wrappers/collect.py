"""Labelled trajectories, recorded while any agent acts."""

from __future__ import annotations

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, SupportsFloat

import gymnasium
import numpy as np
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import NDArray

from tickwise._files import write_bytes
from tickwise.envs.wrappers.labelled import FEATURES, feature_names
from tickwise.errors import ConfigurationError

_MOST_UNWRITTEN = 1_000


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """A finished episode.

    Attributes:
        features: The features at each tick, shape ``(ticks, features)``.
        total: The undiscounted return.
        info: The last ``info``.
    """

    features: NDArray[np.float64]
    total: float
    info: dict[str, Any]


def succeeded(episode: Episode) -> bool:
    """Whether an episode was good: by ``info["is_success"]`` where it is told, else by a return above 0."""
    return bool(episode.info.get("is_success", episode.total > 0))


class CollectTrajectories(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Record the trajectory and the label of every finished episode, whoever acts (the data collection phase).

    The file is an NPZ file as `read_trajectories` and ``tickwise infer`` read it. It is written, all or nothing, each
    time that the number of episodes has doubled, or that 1,000 more have come, and by `close`. An episode that is cut
    off by another `reset` is not recorded: it has no label.

    Args:
        env: An environment with named features: wrap it in `Labelled` first.
        path: The file, which must end in ``.npz``; None keeps the trajectories in memory only.
        label: Whether an episode was good (label 1, else -1); by default `succeeded`.

    Attributes:
        feature_names: The names of the trajectories' columns.

    Raises:
        ConfigurationError: If the environment has no named features, or the file another ending.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        path: str | Path | None = None,
        label: Callable[[Episode], bool] = succeeded,
    ) -> None:
        RecordConstructorArgs.__init__(self, path=path, label=label)
        super().__init__(env)
        self.feature_names = feature_names(env, "CollectTrajectories")
        self._path = None if path is None else Path(path)
        if self._path is not None and self._path.suffix.lower() != ".npz":
            raise ConfigurationError(f"{path} does not end in .npz; use that ending")
        self._label = label
        self._finished: list[NDArray[np.float64]] = []
        self._labels: list[int] = []
        self._written = 0
        self._ticks: list[NDArray[np.float64]] = []
        self._total = 0.0

    def __len__(self) -> int:
        """The number of recorded episodes."""
        return len(self._finished)

    def trajectories(self) -> tuple[list[NDArray[np.float64]], NDArray[np.int64]]:
        """What was recorded, as `MITLClassifier.fit` and `LabelledTrajectories.from_arrays` take it.

        Returns:
            A list of arrays of shape ``(ticks, features)``, and the labels 1 or -1, shape ``(episodes,)``.
        """
        return list(self._finished), np.array(self._labels, dtype=np.int64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; see the wrapped environment."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._ticks, self._total = [info[FEATURES]], 0.0
        return observation, info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Go to the next tick; at the last one of an episode its trajectory is recorded."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        self._ticks.append(info[FEATURES])
        self._total += float(reward)
        if terminated or truncated:
            episode = Episode(np.array(self._ticks), self._total, info)
            self._finished.append(episode.features)
            self._labels.append(1 if self._label(episode) else -1)
            if len(self) - self._written >= min(max(self._written, 1), _MOST_UNWRITTEN):
                self.write()
        return observation, reward, terminated, truncated, info

    def write(self) -> None:
        """Write what was recorded, if a file was named.

        Raises:
            StoreError: If it cannot be written; what is there already stays.
        """
        if self._path is None or len(self) == self._written:
            return
        lengths = np.array([len(each) for each in self._finished], dtype=np.int64)
        values = np.full((len(self), int(lengths.max()), len(self.feature_names)), np.nan)
        for row, each in zip(values, self._finished, strict=True):
            row[: len(each)] = each
        content = io.BytesIO()
        np.savez_compressed(
            content, X=values, y=np.array(self._labels), names=np.array(self.feature_names), lengths=lengths
        )
        write_bytes(self._path, content.getvalue())
        self._written = len(self)

    def close(self) -> None:
        """Write what was recorded, and close the environment."""
        self.write()
        super().close()
