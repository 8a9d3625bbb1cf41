"""Where things are in the source: names with their lines, and the numbers of the paper that code cites."""

from __future__ import annotations

import ast
import io
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src"

_Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True, slots=True)
class Place:
    """A line of the source.

    Attributes:
        module: The module, such as ``tickwise.logic.sdnf``.
        name: What it belongs to, such as ``SDNF.size``; empty for the module itself.
        line: Counted from 1.
    """

    module: str
    name: str
    line: int

    @property
    def file(self) -> str:
        """The file's path below the package."""
        return str(path_of(self.module).relative_to(SOURCE / "tickwise"))

    @property
    def page(self) -> str:
        """The site's page that shows the module's source."""
        return f"_modules/{self.module.replace('.', '/')}"


def path_of(module: str) -> Path:
    """The file of a module.

    Raises:
        FileNotFoundError: If there is none.
    """
    path = SOURCE.joinpath(*module.split("."))
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    raise FileNotFoundError(f"there is no module {module}")


@cache
def public_modules(package: str) -> tuple[str, ...]:
    """The modules of a package and of those below it, without private ones, in alphabetical order."""
    folder = path_of(package).parent
    found = []
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(SOURCE).with_suffix("").parts
        parts = parts[:-1] if parts[-1] == "__init__" else parts
        if not any(part.startswith("_") for part in parts):
            found.append(".".join(parts))
    return tuple(sorted(found))


@cache
def places(module: str) -> dict[str, Place]:
    """Every name that a module defines at its top or in a class, by qualified name."""
    return {name: Place(module, name, line) for name, line, _ in _named(_tree(module))}


@cache
def imported(module: str) -> dict[str, str]:
    """The full names of what a module imports from tickwise, also where only a type checker does."""
    return {
        alias.asname or alias.name: f"{node.module}.{alias.name}"
        for node in ast.walk(_tree(module))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("tickwise")
        for alias in node.names
    }


def _named(tree: ast.Module | ast.ClassDef, prefix: str = "") -> Iterator[tuple[str, int, ast.stmt]]:
    for node in tree.body:
        if isinstance(node, _Definition):
            yield prefix + node.name, node.lineno, node
            if isinstance(node, ast.ClassDef):
                yield from _named(node, f"{prefix}{node.name}.")
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                if isinstance(target, ast.Name):
                    yield prefix + target.id, node.lineno, node


@dataclass(frozen=True, slots=True)
class Citation:
    """A number of the paper that the source cites.

    Attributes:
        item: For instance ``Definition 5`` or ``Algorithm 2``.
        lines: The lines of the algorithm; empty where the whole of it is meant.
        place: Where: the line of the definition for a docstring, its own line for a comment.
    """

    item: str
    lines: frozenset[int]
    place: Place


_NUMBERS = r"(\d+)(?:(?:,| and| to|-) (\d+)|-(\d+))?"
_ITEM = re.compile(rf"\b(Definition|Proposition|Remark|Problem|Step)s? {_NUMBERS}")
_ALGORITHM = re.compile(rf"\bAlgorithm (\d)(?:, [Ll]ines? {_NUMBERS})?")
_LINES_OF = re.compile(rf"\b[Ll]ines? {_NUMBERS}(?: of Algorithm (\d))?")


@cache
def citations(module: str) -> tuple[Citation, ...]:
    """What a module's docstrings and comments cite.

    In a module whose own docstring begins with an algorithm, bare line numbers are lines of that one.
    """
    tree = _tree(module)
    about = re.match(r"Algorithm (\d)", ast.get_docstring(tree) or "")
    algorithm = about.group(1) if about else ""
    found = []
    for text, place in (*_docstrings(tree, module), *_comments(tree, module)):
        found += [Citation(item, lines, place) for item, lines in _cited(text, algorithm)]
    return tuple(dict.fromkeys(found))


def _cited(text: str, algorithm: str) -> Iterator[tuple[str, frozenset[int]]]:
    text = " ".join(text.split())
    for match in _ITEM.finditer(text):
        for number in _range(match.group(0), match.groups()[1:]):
            yield f"{match.group(1)} {number}", frozenset()
    for match in _ALGORITHM.finditer(text):
        yield f"Algorithm {match.group(1)}", frozenset(_range(match.group(0), match.groups()[1:]))
    for match in _LINES_OF.finditer(text):
        owner = match.group(4) or algorithm
        if owner and not text[: match.start()].endswith(("Algorithm 1, ", "Algorithm 2, ")):
            yield f"Algorithm {owner}", frozenset(_range(match.group(0), match.groups()[:3]))


def _range(text: str, groups: tuple[str | None, ...]) -> list[int]:
    numbers = [int(group) for group in groups if group]
    if len(numbers) == 2 and not re.search(r"\d(?:,| and) \d", text):
        return list(range(numbers[0], numbers[1] + 1))
    return numbers


def _docstrings(tree: ast.Module, module: str) -> Iterator[tuple[str, Place]]:
    yield ast.get_docstring(tree) or "", Place(module, "", 1)
    for name, line, node in _named(tree):
        if isinstance(node, _Definition):
            yield ast.get_docstring(node) or "", Place(module, name, line)


def _comments(tree: ast.Module, module: str) -> Iterator[tuple[str, Place]]:
    text = path_of(module).read_text(encoding="utf-8")
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type == tokenize.COMMENT:
            line = token.start[0]
            around = [name for name, first, node in _named(tree) if first <= line <= (node.end_lineno or first)]
            yield token.string, Place(module, around[-1] if around else "", line)


@cache
def _tree(module: str) -> ast.Module:
    return ast.parse(path_of(module).read_text(encoding="utf-8"))
