"""Imports go one way, and each heavy third-party library is imported in one place only.

Late imports inside functions and those for type checking count too: a layer must not know what lies above it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import tickwise

ROOT = Path(tickwise.__file__).parent

# A module may import its own layer and those of lower rank. Layers of equal rank do not know each other.
RANKS = {
    "errors": 0, "_arrays": 0, "_jit": 0, "_seeding": 0, "_wording": 0, "_files": 0.5, "_archives": 0.5,
    "logic": 1,
    "automata": 2,
    "envs": 3,
    "inference": 4, "rl": 4,
    "transfer": 5,
    "library": 5.5,
    "experiments": 6,
    "cli": 7,
    "__main__": 8, "__init__": 8,
}  # fmt: skip
FORBIDDEN = {"inference": {"envs", "rl"}}

CONFINED = {
    "numba": ("_jit.py",),
    "lark": ("logic/parse.py",),
    "gymnasium": ("envs/",),
    "matplotlib": ("experiments/figures/",),
    "stable_baselines3": ("transfer/deep.py",),
    "torch": ("transfer/deep.py",),
    "distributed": ("experiments/cluster.py", "experiments/remote.py"),
    "typer": ("cli/",),
    "rich": ("cli/", "experiments/progress.py", "experiments/tables.py"),
}
UNSAFE = {"pickle", "cPickle", "_pickle", "dill", "cloudpickle", "shelve", "marshal"}


def imported_modules(tree: ast.Module, package: tuple[str, ...]) -> Iterator[tuple[int, str]]:
    """Line and full name of every imported module; ``from a import b`` gives ``a.b``."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = list(package[: len(package) - node.level + 1]) if node.level else []
            base += node.module.split(".") if node.module else []
            yield from ((node.lineno, ".".join([*base, alias.name])) for alias in node.names)
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in ("import_module", "__import__") and isinstance(node.args[0].value, str):
                yield node.lineno, node.args[0].value


def layer_problems(path: str, layer: str, line: int, module: str) -> Iterator[str]:
    parts = module.split(".")
    target = parts[1] if len(parts) > 1 else "__init__"
    if target not in RANKS:
        target = "__init__"  # a name of the facade
    if target in FORBIDDEN.get(layer, ()):
        yield f"{path}:{line}: {layer} imports {module}, which it never may"
    elif target != layer and RANKS[target] >= RANKS[layer]:
        yield f"{path}:{line}: {layer} imports {module}, but imports go down: {target} is not below it"


def problems(path: str, source: str) -> list[str]:
    """What one module, named by its path within the package, does against the rules."""
    parts = Path(path).parts
    layer = parts[0].removesuffix(".py")
    if layer not in RANKS:
        return [f"{path}: {layer} is in no layer; give it a rank in {Path(__file__).name}"]
    tree = ast.parse(source)
    found: list[str] = []
    for line, module in imported_modules(tree, ("tickwise", *parts[:-1])):
        top = module.split(".")[0]
        if top == "tickwise":
            found += layer_problems(path, layer, line, module)
        if top in CONFINED and not path.startswith(CONFINED[top]):
            found.append(f"{path}:{line}: {top} is imported only in {' and '.join(CONFINED[top])}")
        if top in UNSAFE:
            found.append(f"{path}:{line}: {top} runs code when it loads; use npz without pickle, and JSON")
    return found + list(pickling(path, tree))


def pickling(path: str, tree: ast.Module) -> Iterator[str]:
    """Calls that pickle without importing pickle."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in ("read_pickle", "to_pickle"):
            yield f"{path}:{node.lineno}: {node.attr} uses pickle; use npz without pickle, and JSON"
        if isinstance(node, ast.keyword) and node.arg == "allow_pickle" and ast.unparse(node.value) != "False":
            yield f"{path}:{node.value.lineno}: allow_pickle is not False; arrays are stored without pickle"


MODULES = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.py"))


@pytest.mark.parametrize("path", MODULES)
def test_module_keeps_the_rules(path: str):
    found = problems(path, (ROOT / path).read_text(encoding="utf-8"))
    assert not found, "\n" + "\n".join(found)


@pytest.mark.parametrize(
    ("path", "source", "message"),
    [
        ("logic/parse.py", "from tickwise.automata import model", "logic imports tickwise.automata.model"),
        ("logic/parse.py", "import tickwise", "logic imports tickwise, but"),
        ("logic/parse.py", "from tickwise import parse", "logic imports tickwise.parse, but"),
        ("envs/tasks.py", "from ..rl.states import States", "envs imports tickwise.rl.states.States"),
        ("envs/tasks.py", "from .. import transfer", "envs imports tickwise.transfer"),
        ("inference/tree.py", "from tickwise.envs.gridworld import GridWorld", "which it never may"),
        ("inference/tree.py", "def f():\n    import tickwise.rl.qtable", "inference/tree.py:2: .* never may"),
        ("rl/states.py", "from tickwise.inference.tree import Tree", "rl imports tickwise.inference.tree"),
        ("errors.py", "from tickwise.logic import syntax", "errors imports tickwise.logic.syntax"),
        (
            "errors.py",
            "import importlib\nimportlib.import_module('tickwise.cli')",
            "errors imports tickwise.cli",
        ),
        ("experiments/store.py", "from tickwise.cli import main", "experiments imports tickwise.cli.main"),
        ("logic/kernels.py", "from numba import njit", "numba is imported only in _jit.py"),
        ("logic/render.py", "import lark.lexer", "lark is imported only in logic/parse.py"),
        ("rl/states.py", "import gymnasium as gym", "gymnasium is imported only in envs/"),
        ("experiments/report.py", "import matplotlib.pyplot as plt", "matplotlib is imported only in"),
        ("experiments/progress.py", "import typer", "typer is imported only in cli/"),
        (
            "experiments/store.py",
            "import rich",
            "rich is imported only in cli/ and experiments/progress.py and experiments/tables.py",
        ),
        ("experiments/store.py", "import pickle", "pickle runs code"),
        ("experiments/store.py", "np.load(path, allow_pickle=True)", "allow_pickle is not False"),
        ("experiments/store.py", "frame.to_pickle(path)", "to_pickle uses pickle"),
        ("utils.py", "", "utils is in no layer"),
    ],
)
def test_a_broken_rule_is_found(path: str, source: str, message: str):
    found = problems(path, source)
    assert len(found) == 1
    with pytest.raises(AssertionError, match=message):
        raise AssertionError(found[0])


@pytest.mark.parametrize(
    ("path", "source"),
    [
        ("_jit.py", "import numba"),
        ("logic/parse.py", "import lark\nfrom tickwise.errors import ParseError\nfrom .syntax import Box"),
        ("automata/build.py", "from tickwise.logic.sdnf import SDNF\nfrom . import model"),
        ("envs/environment.py", "import gymnasium"),
        ("transfer/hypothesis.py", "from tickwise.inference import tree\nfrom tickwise.rl import qtable"),
        ("cli/app.py", "import typer, rich\nfrom tickwise.experiments import runner"),
        ("__init__.py", "from tickwise.envs.registration import register_with_gymnasium"),
        ("experiments/store.py", "np.load(path, allow_pickle=False)"),
        ("rl/states.py", "import numbagg, richer"),
    ],
)
def test_what_is_allowed_passes(path: str, source: str):
    assert problems(path, source) == []
