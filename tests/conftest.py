"""What all tests share: Hypothesis' profile, one finished run of a tiny study, and a browser."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from tests import browsers

# the first call of a compiled kernel takes seconds; on a server the same cases are tried each time
settings.register_profile("tickwise", deadline=None, derandomize="CI" in os.environ)
settings.load_profile("tickwise")

# what a script starts in the background ignores Ctrl-C, and so would every process that the tests start
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run folder of the tiny study with all artefacts and its report; not to be changed."""
    from rich.console import Console

    from tests.experiments.tiny import TINY
    from tickwise.experiments.progress import Display
    from tickwise.experiments.publish import publish
    from tickwise.experiments.runner import run_study

    folder = tmp_path_factory.mktemp("finished") / "tiny"
    publish(TINY, run_study(TINY, folder, 1, Display(Console(quiet=True))), 1, 1.5)
    return folder


@pytest.fixture
def studies(monkeypatch: pytest.MonkeyPatch) -> None:
    """The tiny studies on the command line."""
    from tests.experiments import tiny
    from tickwise.experiments import case_studies

    for name, study in tiny.STUDIES.items():
        monkeypatch.setitem(case_studies.STUDIES, name, study)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A headless browser. It ends with each module: its event loop would get in the way of other tests' loops."""
    with browsers.headless() as browser:
        yield browser
