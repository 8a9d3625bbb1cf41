from __future__ import annotations

import ast
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import tickwise


def run(*lines: str) -> str:
    """What an interpreter of its own prints."""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", "\n".join(lines)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.parametrize("name", tickwise.__all__)
def test_every_public_name_is_there(name: str):
    value = getattr(tickwise, name)
    assert value.__name__ == name
    assert value.__module__.startswith("tickwise.")
    assert value.__doc__
    assert name in dir(tickwise)


def test_the_three_lists_of_names_agree():
    """What type checkers see, what is imported late, and what ``import *`` gives."""
    tree = ast.parse(Path(tickwise.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    typed = {f"tickwise.{module}": set(names) for module, names in tickwise._HOMES.items()}
    seen = {
        node.module: {alias.name for alias in node.names} for node in block.body if isinstance(node, ast.ImportFrom)
    }
    assert seen == typed
    assert sorted(tickwise.__all__) == sorted(name for names in typed.values() for name in names)


def test_import_is_light():
    heavy = ("numba", "numpy", "scipy", "gymnasium", "matplotlib", "lark", "typer", "rich", "jinja2")
    out = run("import sys, tickwise", f"print(*(name for name in {heavy} if name in sys.modules))")
    assert out == ""


def test_a_name_brings_only_what_it_needs():
    heavy = ("numba", "scipy", "gymnasium", "matplotlib", "typer")
    out = run(
        "import sys, tickwise",
        "tickwise.TickwiseError, tickwise.Box.of(x=(0, 1)), tickwise.parse('F[0,2] (x > 1)')",
        f"print(*(name for name in {heavy} if name in sys.modules))",
    )
    assert out == ""


def test_parse_is_the_function_even_after_its_module_was_imported():
    assert run("import tickwise.logic.parse, tickwise", "print(tickwise.parse('F[0,2] (x > 1)'))") == "F[0,2] (x > 1)"


def test_star_import():
    assert run("from tickwise import *", "print(parse.__name__, Verdict.TRUE.name)") == "parse TRUE"


def test_version_is_that_of_the_distribution():
    assert tickwise.__version__ == version("tickwise")


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'tickwise' has no attribute 'nothing'"):
        _ = tickwise.nothing
    assert not hasattr(tickwise, "_nothing")
    with pytest.raises(ImportError):
        exec("from tickwise import nothing")


def test_environments_come_with_the_package():
    out = run(
        "import gymnasium",
        "env = gymnasium.make('tickwise:CaseStudy2Target-v0')",
        "print(env.unwrapped.specification.name)",
    )
    assert out == "CaseStudy2Target"


def test_the_module_is_the_command():
    done = subprocess.run([sys.executable, "-m", "tickwise", "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.split()) == (0, ["tickwise", version("tickwise")])


def test_workers_may_import_the_main_module():
    assert run("import tickwise.__main__", "print('quiet')") == "quiet"
