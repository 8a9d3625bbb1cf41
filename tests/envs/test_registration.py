"""Each case runs in an interpreter of its own, because what is imported first is the point."""

from __future__ import annotations

import subprocess
import sys

import pytest


def run(*lines: str) -> str:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(lines)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


REGISTER = "from tickwise.envs.registration import register_with_gymnasium; register_with_gymnasium()"
MAKE = "print(gymnasium.make('CaseStudy1Source-v0').unwrapped.specification.name)"


@pytest.mark.parametrize(
    "lines",
    [
        ("import gymnasium", REGISTER, MAKE),
        (REGISTER, "import gymnasium", MAKE),
        (REGISTER, REGISTER, "import gymnasium", MAKE),
        (REGISTER, "import gymnasium.spaces", MAKE),
        (REGISTER, "import importlib.util; importlib.util.find_spec('gymnasium')", "import gymnasium", MAKE),
    ],
    ids=["gymnasium first", "registration first", "twice", "a submodule first", "looked for first"],
)
def test_environments_are_known_in_whatever_order(lines: tuple[str, ...]):
    assert run(*lines) == "CaseStudy1Source"


@pytest.mark.parametrize(
    "lines",
    [("import gymnasium",), ("import tickwise", "import gymnasium")],
    ids=["gymnasium alone", "tickwise first"],
)
def test_make_with_the_module_in_the_id(lines: tuple[str, ...]):
    for name in ("CaseStudy1Source", "CaseStudy1Target", "CaseStudy2Source", "CaseStudy2Target"):
        make = f"print(gymnasium.make('tickwise:{name}-v0').unwrapped.specification.name)"
        assert run(*lines, make) == name


def test_waiting_imports_nothing_and_leaves_no_trace():
    out = run(
        "import sys",
        "before = list(sys.meta_path)",
        REGISTER,
        "print('gymnasium' in sys.modules, 'numpy' in sys.modules, len(sys.meta_path) - len(before))",
        "import gymnasium",
        "loaders = gymnasium.__spec__.loader, gymnasium.__loader__",
        "print(sys.meta_path == before, *(type(loader).__name__ for loader in loaders))",
    )
    assert out.splitlines() == ["False False 1", "True SourceFileLoader SourceFileLoader"]


def test_registering_brings_no_compiler():
    assert run("import sys, gymnasium", REGISTER, "print('numba' in sys.modules)") == "False"
