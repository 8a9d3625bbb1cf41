from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.experiments.tiny import TINY
from tickwise.errors import ConfigurationError
from tickwise.experiments import remote
from tickwise.experiments.identity import difference, identity
from tickwise.experiments.job import Job
from tickwise.experiments.plain import from_plain
from tickwise.experiments.store import Store

ASKED = remote.request(Job("learn", "IV", 0), TINY)


def test_a_request_is_plain_data():
    assert from_plain(json.loads(ASKED)) == (Job("learn", "IV", 0), TINY)


def test_a_job_needs_no_folder(finished: Path, monkeypatch: pytest.MonkeyPatch):
    told: list[tuple[int, int]] = []
    monkeypatch.setattr(remote, "_reporter", lambda _topic, _index: lambda *step: told.append(step))
    store = Store(finished)
    sent = [(name, store.get(name).manifest, store.get(name).arrays) for name in Job("learn", "IV", 0).needs(TINY)]
    cost, given = remote.carry_out(ASKED, identity(), sent, "topic", 3)
    wanted = store.get("learn-IV-0")
    assert given == (wanted.name, wanted.manifest, wanted.arrays)
    assert cost[0] == "cost-learn-IV-0"
    assert told[0] == (0, 20_000)


@pytest.mark.parametrize("name", identity())
def test_a_worker_refuses_what_another_version_asks_for(name: str):
    wanted = {**identity(), name: "9.9"}
    with pytest.raises(
        ConfigurationError, match=f"a worker has {name} .* instead of 9.9; .* install the same versions"
    ):
        remote.carry_out(ASKED, wanted, [], "topic", 0)


def test_identities_differ_in_the_first_thing():
    ours = identity()
    assert set(ours) == {"Python", "tickwise", "numpy", "numba", "the code of tickwise"}
    assert difference(ours, ours) is None
    assert difference({**ours, "numpy": "1.0"}, ours) == f"numpy 1.0 instead of {ours['numpy']}"
    assert difference({}, ours) == f"Python None instead of {ours['Python']}"


def test_a_scheduler_need_not_load_what_computes():
    code = "import sys, tickwise.experiments.remote; print({'numpy', 'numba', 'distributed'} & set(sys.modules))"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout == "set()\n"
