"""What a worker of a cluster does: a job, from bytes to bytes, with no file of the run folder in sight.

A scheduler imports this module as well, so that it imports little.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from tickwise.errors import ConfigurationError
from tickwise.experiments.identity import difference, identity
from tickwise.experiments.plain import from_plain, to_plain

if TYPE_CHECKING:
    from tickwise.experiments.job import Job
    from tickwise.experiments.study import StudySpec

Sent = tuple[str, bytes, bytes | None]
"""An artefact on its way: its name, its manifest, and its arrays if there are any."""

_QUIET = 0.25
"""The least seconds between two words of a job on how far it is."""

_given_up: set[str] = set()


class GivenUpError(Exception):
    """Nobody waits any more for the job at hand."""


def request(job: Job, spec: StudySpec) -> bytes:
    """A job and its study, for `carry_out`."""
    return json.dumps(to_plain((job, spec))).encode()


def carry_out(
    asked: bytes, wanted: Mapping[str, str], inputs: Sequence[Sent], topic: str, index: int
) -> tuple[Sent, ...]:
    """Do a job on a worker.

    Args:
        asked: What `request` gave.
        wanted: The identity of who asks for it.
        inputs: The artefacts that the job needs.
        topic: Where to tell how far it is.
        index: Its number there.

    Returns:
        What it cost, and what it gives.

    Raises:
        ConfigurationError: If this worker has another version, so that its results would be others.
        TickwiseError: If the job cannot be done.
    """
    wrong = difference(identity(), wanted)
    if wrong is not None:
        raise ConfigurationError(f"a worker has {wrong}; {REMEDY}")
    from tickwise.experiments.artefacts import Artefact, Parcel
    from tickwise.experiments.jobs import compute

    job, spec = from_plain(json.loads(asked))
    parcel = Parcel({name: Artefact(name, manifest, arrays) for name, manifest, arrays in inputs})
    given = compute(job, spec, parcel, _reporter(topic, index))
    return tuple((artefact.name, artefact.manifest, artefact.arrays) for artefact in given)


REMEDY = "its results would not be the same, so install the same versions on all machines"
"""What to do about another version."""


def give_up(topic: str) -> None:
    """Let the jobs that tell something there end soon: a thread cannot be killed."""
    _given_up.add(topic)


def _reporter(topic: str, index: int) -> Callable[[int, int], None]:
    """What tells the one who waits for a job how far it is, now and then."""
    from distributed import get_worker

    worker = get_worker()
    told = -_QUIET

    def report(done: int, total: int) -> None:
        nonlocal told
        if topic in _given_up or worker.status.name in ("closing", "closed"):
            raise GivenUpError
        now = time.monotonic()
        if now - told >= _QUIET:
            told = now
            worker.log_event(topic, {"index": index, "done": done, "total": total})

    return report
