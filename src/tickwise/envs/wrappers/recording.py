"""Recorded episodes on disk: one NPZ file, and a journal beside it that loses nothing when a process is killed."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tickwise._files import write_bytes
from tickwise.errors import ConfigurationError, DataError, StoreError

JOURNAL = ".part"
"""What the journal's name has beyond the file's."""


class Recording:
    """Finished episodes, in memory and in a file.

    Each episode is appended to the journal as soon as it has finished; `write` puts all of them into the file, all or
    nothing, and ends the journal.

    Args:
        path: The file, which must end in ``.npz``; None keeps the episodes in memory only.
        names: The names of the features.
        resume: Whether to go on with what is there already.

    Attributes:
        episodes: The features at each tick, for each episode an array of shape ``(ticks, features)``.
        labels: 1 or -1 for each episode.

    Raises:
        ConfigurationError: If the file has another ending, or is there already and is not to be gone on with.
        DataError: If what is there are no episodes with these features.
    """

    def __init__(self, path: Path | None, names: tuple[str, ...], *, resume: bool = False) -> None:
        self.episodes: list[NDArray[np.float64]] = []
        self.labels: list[int] = []
        self._path, self._names, self._written = path, names, 0
        if path is None:
            return
        if path.suffix.lower() != ".npz":
            raise ConfigurationError(f"{path} does not end in .npz; use that ending")
        self._journal = path.with_name(path.name + JOURNAL)
        there = [file for file in (path, self._journal) if file.exists()]
        if there and not resume:
            raise ConfigurationError(f"{there[0]} is there already; use resume=True to go on with it, or another name")
        if path.exists():
            self._read_file(path)
        if self._journal.exists():
            self._read_journal()

    def add(self, features: NDArray[np.float64], label: int) -> None:
        """Keep an episode.

        Args:
            features: The features at each tick, shape ``(ticks, features)``.
            label: 1 or -1.

        Raises:
            StoreError: If the journal cannot be written.
        """
        if self._path is not None:
            self._append({"label": label, "ticks": features.tolist()})
        self.episodes.append(features)
        self.labels.append(label)

    def write(self) -> None:
        """Write the file, if one was named and there is something new.

        Raises:
            StoreError: If it cannot be written; what is there already stays.
        """
        if self._path is None or len(self.episodes) == self._written:
            return
        lengths = np.array([len(each) for each in self.episodes], dtype=np.int64)
        values = np.full((len(lengths), int(lengths.max()), len(self._names)), np.nan)
        for row, each in zip(values, self.episodes, strict=True):
            row[: len(each)] = each
        content = io.BytesIO()
        np.savez_compressed(content, X=values, y=np.array(self.labels), names=np.array(self._names), lengths=lengths)
        write_bytes(self._path, content.getvalue())
        self._written = len(lengths)
        self._journal.unlink(missing_ok=True)

    def _append(self, episode: dict[str, Any]) -> None:
        lines = [episode]
        try:
            if not self._journal.exists():
                self._journal.parent.mkdir(parents=True, exist_ok=True)
                # how many episodes the file has, so that none counts twice if the journal outlives the next `write`
                lines = [{"names": self._names, "after": self._written}, episode]
            with self._journal.open("a", encoding="utf-8") as journal:
                journal.write("".join(json.dumps(line) + "\n" for line in lines))
        except OSError as error:
            raise StoreError(f"cannot write {self._journal}: {error.strerror}; make room or choose another") from None

    def _read_file(self, path: Path) -> None:
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                names, values, lengths, labels = (arrays[name] for name in ("names", "X", "lengths", "y"))
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
            raise DataError(f"{path} is no recording: {error}; choose another name") from None
        self._check_names(path, names.tolist())
        self.episodes = [row[:length].copy() for row, length in zip(values, lengths, strict=True)]
        self.labels = [int(label) for label in labels]
        self._written = len(self.episodes)

    def _read_journal(self) -> None:
        """Add what the file does not have; a last line that a killed process left unfinished is taken away."""
        content = self._journal.read_bytes()
        whole = content[: content.rfind(b"\n") + 1]
        try:
            lines = [json.loads(line) for line in whole.splitlines()]
            if not lines:
                self._journal.unlink()
                return
            self._check_names(self._journal, lines[0]["names"])
            new = lines[1 + len(self.episodes) - lines[0]["after"] :]
            episodes = [np.array(line["ticks"], dtype=np.float64) for line in new]
            labels = [int(line["label"]) for line in new]
        except (ValueError, KeyError, TypeError) as error:
            raise DataError(f"{self._journal} is no journal of a recording: {error}; choose another name") from None
        if len(whole) < len(content):
            write_bytes(self._journal, whole)
        self.episodes += episodes
        self.labels += labels

    def _check_names(self, path: Path, names: list[str]) -> None:
        if tuple(names) != self._names:
            theirs, ours = ", ".join(map(str, names)), ", ".join(self._names)
            raise DataError(f"{path} has the features {theirs}, not {ours}; choose another name")
