"""Jobs on a Dask cluster: they travel as bytes, and this side alone writes to the run folder.

This uses Dask's own client. joblib on top of it would hide what is needed here: how far a job is, which worker has
which version, and that the scheduler was restarted.
"""

from __future__ import annotations

import asyncio
import json
import logging
import queue
import re
import threading
import time
import warnings
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np
from numpy.typing import NDArray

from tickwise.errors import ClusterError, ConfigurationError, MissingExtraError, MissingFileError, TickwiseError
from tickwise.experiments.artefacts import Artefact
from tickwise.experiments.executors import Run, Task
from tickwise.experiments.identity import difference, identity
from tickwise.experiments.progress import Board
from tickwise.experiments.remote import REMEDY, GivenUpError, carry_out, give_up, request

PATIENCE = 600.0
"""Seconds to wait for workers, and for a scheduler that was there before."""

_ANSWER = 10.0
"""Seconds for a scheduler to answer."""

_MOST_TRIES = 5
"""How often a job is sent to a cluster that gets lost each time."""

_LEAST_SENT = 32
"""Jobs that are at the cluster at least, so that one that grows by need sees the need."""

_ADDRESS = re.compile(r"((tcp|tls|ws|wss|ucx)://)?([\w.-]+|\[[0-9a-fA-F:]+\]):\d{1,5}")

_AGAIN = "run the same command again: what is finished is kept"


class Cluster:
    """The workers of a Dask cluster.

    Args:
        address: The address of its scheduler, such as ``tcp://host:8786``, or the scheduler's file.

    Raises:
        MissingExtraError: If Dask is not installed.
        ConfigurationError: If it is no address.
        MissingFileError: If there is no such file.
    """

    def __init__(self, address: str) -> None:
        try:
            import distributed  # noqa: F401
        except ImportError:
            raise MissingExtraError("a cluster needs Dask; pip install tickwise[cluster]") from None
        _resolve(address)
        self.address = address
        self.workers = 1

    @contextmanager
    def start(self, say: Callable[[str], None]) -> Iterator[Run]:
        """Connect; an error or Ctrl-C cancels what is at the cluster, and lets what runs there end soon.

        Raises:
            ClusterError: If there is no scheduler, or it is lost for good, or has no workers for too long.
            ConfigurationError: If a worker has another version.
        """
        try:
            session = _Session(self.address, say)
        except _LostError:
            raise ClusterError(f"the cluster at {self.address} was lost at once; see its log, then {_AGAIN}") from None
        try:
            yield session.run
        except BaseException:
            session.link.give_up()
            raise
        finally:
            self.workers = max(session.most, 1)
            session.link.close()


class _LostError(Exception):
    """The scheduler is gone, or has forgotten what it was given."""


class _Session:
    """Tasks that go to one cluster, even if its scheduler is another one later."""

    def __init__(self, address: str, say: Callable[[str], None]) -> None:
        self._address = address
        self._say = say
        self._alone: float | None = None  # since when there are no workers
        self.link = _Link(address)
        self.most = self.link.threads

    def run(self, tasks: Sequence[Task], shared: Board) -> Iterator[int]:
        """Carry out tasks; see `Run`."""
        waiting, tries = deque(tasks), Counter[int]()
        self.link.listen(shared.rows())
        while waiting or self.link.sent:
            try:
                self._send(waiting, tries)
                done = self.link.next()
                if done is None:
                    self._watch()
            except _LostError:
                waiting.extendleft(reversed(self.link.sent.values()))
                self._connect_again()
                self.link.listen(shared.rows())
            else:
                if done is not None:
                    self._alone = None
                    yield done.index

    def _send(self, waiting: deque[Task], tries: Counter[int]) -> None:
        """Give the cluster enough to do, and not all at once: what the jobs need is sent with them."""
        while waiting and len(self.link.sent) < max(_LEAST_SENT, 2 * self.link.threads):
            task = waiting[0]
            tries[task.index] += 1
            if tries[task.index] > _MOST_TRIES:
                raise ClusterError(
                    f"{task.job.title} was sent to the cluster at {self._address} {_MOST_TRIES} times, and it got lost "
                    f"each time; see the log of its scheduler, then {_AGAIN}"
                )
            self.link.send(task)
            waiting.popleft()

    def _watch(self) -> None:
        """See to it that there are workers."""
        self.most = max(self.most, self.link.look())
        if self.link.threads:
            self._alone = None
            return
        now = time.monotonic()
        if self._alone is None:
            self._alone = now
            self._say(f"the cluster at {self._address} has no workers; waiting up to {_minutes()} for one")
        elif now - self._alone > PATIENCE:
            raise ClusterError(
                f"the cluster at {self._address} had no workers for {_minutes()}; start some, then {_AGAIN}"
            )

    def _connect_again(self) -> None:
        self._say(f"lost the cluster at {self._address}; waiting up to {_minutes()} for it to come back")
        self.link.close()
        end = time.monotonic() + PATIENCE
        while True:
            try:
                self.link = _Link(self._address)
            except (_LostError, ClusterError, MissingFileError) as error:
                if time.monotonic() > end:
                    raise ClusterError(
                        f"the cluster at {self._address} did not come back within {_minutes()}; start it, then {_AGAIN}"
                    ) from error
                time.sleep(0.5)
            else:
                self._say(f"the cluster at {self._address} is back; what it had not finished begins anew")
                return


class _Link:
    """One connection to a scheduler, and the tasks that were sent through it."""

    def __init__(self, address: str) -> None:
        self.sent: dict[Any, Task] = {}
        self.threads = 0
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._topic = ""
        self._client = _client(address)
        try:
            self._check_versions()
            self.look()
        except BaseException:
            self.close()
            raise

    def listen(self, rows: NDArray[np.float64]) -> None:
        """Let what workers tell of the jobs that are sent from now on show in the rows of a board."""
        self._topic = f"tickwise-{uuid4().hex}"  # what comes late is of other rows

        def note(event: tuple[float, dict[str, Any]]) -> None:
            told = event[1]
            rows[told["index"]] = told["done"], told["total"]

        self._client.subscribe_topic(self._topic, note)

    def send(self, task: Task) -> None:
        """Send a task with what it needs."""
        inputs = [
            (found.name, found.manifest, found.arrays) for found in map(task.store.get, task.job.needs(task.spec))
        ]
        key = f"{task.job.kind}-{uuid4().hex}"
        asked = request(task.job, task.spec)
        with _or_lost():
            future = self._client.submit(
                carry_out, asked, identity(), inputs, self._topic, task.index, key=key, pure=False
            )
        self.sent[future] = task
        future.add_done_callback(self._done.put)

    def next(self) -> Task | None:
        """A task whose artefact has come and is written; None if there is none for a second."""
        try:
            future = self._done.get(timeout=1.0)
        except queue.Empty:
            return None
        task = self.sent[future]
        if future.status == "error":
            self._raise(future, task)
            return None
        with _or_lost():
            given = future.result(timeout=60)
        for name, manifest, arrays in given:
            task.store.put(Artefact(name, manifest, arrays))
        del self.sent[future]
        return task

    def look(self) -> int:
        """The number of jobs that the workers there are can do at the same time."""
        if self._client.status != "running":
            raise _LostError
        with _or_lost():
            self.threads = sum(self._client.nthreads().values())
        return self.threads

    def give_up(self) -> None:
        """Cancel all that was sent, and let what runs end soon."""

        def tell() -> None:
            with suppress(Exception):
                self._client.cancel(list(self.sent))
                self._client.run(give_up, self._topic, on_error="ignore")

        telling = threading.Thread(target=tell, daemon=True)  # a scheduler that hangs must not keep this process
        telling.start()
        telling.join(5.0)

    def close(self) -> None:
        """End the connection."""
        with suppress(Exception):
            self._client.close(timeout=2)

    def _raise(self, future: Any, task: Task) -> None:
        """Raise the error of a task as a person should see it; one that a worker gave back as it ended is sent anew."""
        error = future.exception()
        if not isinstance(error, GivenUpError):
            raise _explained(error, task)
        self.send(task)
        del self.sent[future]

    def _check_versions(self) -> None:
        """Refuse workers with other versions before they get work; those that come later refuse it themselves."""
        with _or_lost():
            # a function of the standard library, since nothing of ours need be there
            found = self._client.run(version, "tickwise", on_error="return")
            try:
                found["scheduler"] = self._client.run_on_scheduler(version, "tickwise")
            except ImportError as error:
                found["scheduler"] = error
        ours = identity()
        for where, theirs in found.items():
            _require(where, {**ours, "tickwise": theirs} if isinstance(theirs, str) else theirs)
        with _or_lost():
            for where, theirs in self._client.run(identity, on_error="return").items():
                _require(where, theirs)


def _require(where: str, theirs: Any) -> None:
    if isinstance(theirs, OSError):  # a worker that ended in the meantime
        return
    if isinstance(theirs, ImportError):
        wrong: str | None = f"no tickwise of version {identity()['tickwise']}"
    elif isinstance(theirs, Exception):
        wrong = f"no tickwise that works ({theirs})"
    else:
        wrong = difference(theirs, identity())
    if wrong is not None:
        what = where if where == "scheduler" else f"worker {where}"
        raise ConfigurationError(f"the {what} has {wrong}; {REMEDY}")


@contextmanager
def _or_lost() -> Iterator[None]:
    """Call it a lost cluster where the connection breaks or what was sent is cancelled."""
    from distributed import CancelledError

    try:
        yield
    except TickwiseError:
        raise
    except (CancelledError, OSError, RuntimeError) as error:
        raise _LostError from error


def _explained(error: BaseException, task: Task) -> BaseException:
    """The error of a job, as a person should see it."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return ClusterError(
            f"{task.job.title} was lost with one worker after the other, perhaps for want of memory; give workers "
            f"more memory or fewer threads, then {_AGAIN}"
        )
    if isinstance(error, ImportError) and not isinstance(error, TickwiseError):
        return ConfigurationError(f"a worker cannot run tickwise ({error}); {REMEDY}")
    return error


def _client(address: str) -> Any:
    """A client of the scheduler at an address.

    Raises:
        ClusterError: If none answers.
    """
    from distributed import Client
    from distributed.versions import VersionMismatchWarning

    for name in ("distributed", "tornado"):  # what goes wrong is told by our own messages
        logging.getLogger(name).setLevel(logging.CRITICAL)
    for name in ("distributed.client", "distributed.core", "distributed.batched"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        scheduler = _resolve(address)
        _greet(scheduler)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", VersionMismatchWarning)  # `identity` is stricter
            return Client(scheduler, timeout=_ANSWER, set_as_default=False, name="tickwise")
    except (OSError, ValueError, RuntimeError, ImportError, TypeError) as error:
        raise ClusterError(
            f"no Dask scheduler answers at {address}; start one with `dask scheduler`, or correct --cluster"
        ) from error


def _greet(address: str) -> None:
    """See that Dask answers: a client would wait for ever for something else that says nothing.

    Raises:
        OSError: If it does not answer in time.
    """
    from distributed.comm import connect
    from distributed.security import Security
    from distributed.utils import LoopRunner

    async def greet() -> None:
        settings = Security().get_connection_args("client")
        comm = await asyncio.wait_for(connect(address, timeout=_ANSWER, **settings), _ANSWER + 1)
        comm.abort()

    runner = LoopRunner(asynchronous=False)
    runner.start()
    try:
        runner.run_sync(greet)
    finally:
        runner.stop()


def _resolve(address: str) -> str:
    """The address itself, or the one that a scheduler's file has now."""
    if address.endswith(".json"):
        try:
            address = json.loads(Path(address).read_text(encoding="utf-8"))["address"]
        except FileNotFoundError:
            raise MissingFileError(
                f"there is no scheduler file {address}; start one with `dask scheduler --scheduler-file {address}`"
            ) from None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ConfigurationError(f"{address} is no scheduler file ({error!r}); correct --cluster") from error
    if not _ADDRESS.fullmatch(address):
        raise ConfigurationError(
            f"{address!r} is no address of a Dask scheduler; use one such as tcp://host:8786, or a scheduler file"
        )
    return address


def _minutes() -> str:
    return f"{PATIENCE / 60:.0f} min" if PATIENCE >= 60 else f"{PATIENCE:.0f} s"
