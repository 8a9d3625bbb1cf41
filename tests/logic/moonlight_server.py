"""Runs MoonLight in a process of its own: one JSON request a line on stdin, one JSON answer a line on stdout.

Its Java machine would disturb the test process. An answer is the value at time 0 or null where there is none.
"""

from __future__ import annotations

import json
import sys

from moonlight import ScriptLoader


def answer(request: dict) -> float | None:
    script = ScriptLoader.loadFromText(request["script"])
    if request["quantitative"]:
        script.setMinMaxDomain()
    rows = script.getMonitor("phi").monitor(request["times"], request["values"])
    return rows[0][1] if rows else None


for line in sys.stdin:
    print(json.dumps(answer(json.loads(line))), flush=True)
