"""The cache of compiled code never makes an import fail. Each case runs in an interpreter of its own."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import tickwise
from tickwise._jit import njit
from tickwise.rl.kernels import draw_state

PACKAGE = Path(tickwise.__file__).parent

# What a system administrator's installation looks like from a user without a home. The rights of a file do not
# bind root, so the answers of os.access stand in for them.
NOTHING_WRITABLE = """
import os
real_access = os.access
os.access = lambda path, mode, **named: not mode & os.W_OK and real_access(path, mode, **named)
"""


def run(code: str, cwd: Path, before: Callable[[], None] | None = None, **environment: str) -> str:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-B", "-c", code],
        cwd=cwd,
        env=kept | environment,
        preexec_fn=before,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder with a copy of the package that cannot be written, and a temporary folder that can."""
    shutil.copytree(PACKAGE, tmp_path / "site" / "tickwise", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "tmp").mkdir()
    for folder in (tmp_path / "site").rglob("*"):
        if folder.is_dir():
            folder.chmod(0o555)
    return tmp_path


USE = """
import numba, numpy, tickwise._jit
from tickwise.rl.kernels import draw_state
print(tickwise._jit.__file__)
print(draw_state(numpy.array([0.5, 1.0]), 0.7))
print(numba.config.CACHE_DIR)
"""


def test_without_a_place_for_the_cache_it_goes_to_the_temporary_folder(copy: Path):
    environment = {
        "PYTHONPATH": str(copy / "site"),
        "HOME": "/nonexistent",
        "XDG_CACHE_HOME": "/nonexistent",
        "TMPDIR": str(copy / "tmp"),
    }
    module, drawn, cache = run(NOTHING_WRITABLE + USE, copy, **environment).splitlines()
    assert Path(module) == copy / "site" / "tickwise" / "_jit.py"
    assert drawn == "1"
    assert Path(cache).parent == copy / "tmp"
    assert Path(cache).stat().st_mode & 0o777 == 0o700
    assert list(Path(cache).rglob("*draw_state*.nbi")), "nothing was cached"
    assert not list((copy / "site").rglob("*.nbi"))
    # and again, now that the folder is there
    assert run(NOTHING_WRITABLE + USE, copy, **environment).splitlines()[1] == "1"


def obey_the_rights_of_files() -> None:
    """Give up root's right to write everywhere, for this process and what it becomes (PR_CAPBSET_DROP, Linux)."""
    override_rights, drop = 1, 24
    if os.geteuid() == 0 and ctypes.CDLL(None, use_errno=True).prctl(drop, override_rights, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "root keeps its rights")


REFUSED = """
from pathlib import Path
import tickwise
for folder in (Path(tickwise.__file__).parent, Path.home()):
    try:
        (folder / "new").touch()
    except PermissionError:
        continue
    print("writable:", folder)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="how root gives up its rights is Linux's")
def test_where_neither_package_nor_home_can_be_written(copy: Path):
    """Without any pretence: the rights of the folders say so, and root obeys them."""
    site, home, temporary = copy / "site", copy / "home", copy / "tmp"
    home.mkdir()
    for folder in (site, home):
        folder.chmod(0o555)
    environment = {"PYTHONPATH": str(site), "HOME": str(home), "XDG_CACHE_HOME": str(home), "TMPDIR": str(temporary)}
    try:
        assert run(REFUSED, copy, obey_the_rights_of_files, **environment) == ""
    except subprocess.SubprocessError:
        pytest.skip("root may not give up its rights here")
    for _ in range(2):  # the second finds what the first cached
        module, drawn, cache = run(USE, copy, obey_the_rights_of_files, **environment).splitlines()
        assert Path(module).parent == site / "tickwise"
        assert drawn == "1"
        assert Path(cache).parent == temporary
    assert list(Path(cache).rglob("*draw_state*.nbi")), "nothing was cached"
    assert not [*site.rglob("__pycache__"), *home.iterdir()]


def test_a_chosen_folder_is_left_alone(copy: Path):
    chosen = copy / "tmp" / "chosen"
    code = NOTHING_WRITABLE + USE
    out = run(code, copy, PYTHONPATH=str(copy / "site"), HOME="/nonexistent", NUMBA_CACHE_DIR=str(chosen))
    assert out.splitlines()[2] == str(chosen)
    assert list(chosen.rglob("*draw_state*.nbi"))


def test_a_package_that_can_be_written_keeps_its_own_cache():
    assert run("import numba, tickwise._jit; print(repr(numba.config.CACHE_DIR))", PACKAGE) == "''"


def test_where_numba_finds_no_place_it_compiles_anew(copy: Path):
    """Numba raises where it finds no place for a cache; the function must be compiled all the same."""
    code = """
import numba
compile_ = numba.njit
def refuse(*functions, cache=False, **options):
    if cache:
        raise RuntimeError("cannot cache function 'f': no locator available for file 'f.py'")
    return compile_(*functions, **options)
numba.njit = refuse
"""
    out = run(code + USE, copy, PYTHONPATH=str(copy / "site"), HOME=str(copy / "tmp"))
    assert out.splitlines()[1] == "1"
    assert not list(copy.rglob("*.nbi"))


def test_the_plain_function_stays_at_hand():
    thresholds = np.array([0.25, 0.5, 1.0])
    for uniform in (0.0, 0.25, 0.3, 0.99):
        assert draw_state(thresholds, uniform) == draw_state.py_func(thresholds, uniform)


def test_compiled_functions_divide_as_numpy_does():
    @njit
    def ratio(a: float, b: float) -> float:
        return a / b

    assert ratio(1.0, 0.0) == np.inf
