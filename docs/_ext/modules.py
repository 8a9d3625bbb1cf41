"""The directives ``package``, ``modules`` and ``facade``: the reference of all public modules, and what leads there."""

from __future__ import annotations

import inspect
import re
import sys
from importlib import import_module
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sources import imported, path_of, places, public_modules
from sphinx.application import Sphinx
from sphinx.domains.python import PyObject
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective
from sphinx.util.inspect import stringify_signature

LOGGER = logging.getLogger(__name__)
LEFT_OUT = ("tickwise.cli", "tickwise.__main__")
"""What has a reference of another kind: the commands."""


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directives, and show types as the source has them."""
    app.add_directive("package", Package)
    app.add_directive("modules", Modules)
    app.add_directive("facade", Facade)
    for field in PyObject.doc_field_types:
        if field.name == "variable":
            field.label = "Attributes"
    app.connect("autodoc-process-signature", _signature_of_the_source)
    app.connect("autodoc-skip-member", _skip_what_dataclasses_add)
    app.connect("env-check-consistency", _warn_of_missing_modules)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class Package(SphinxDirective):
    """A section for every public module of a package, or one for a module."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The sections, by the modules' names."""
        name = self.arguments[0]
        modules = public_modules(name) if path_of(name).name == "__init__.py" else (name,)
        documented = self.env.metadata[self.env.docname].setdefault("modules", "")
        self.env.metadata[self.env.docname]["modules"] = " ".join((documented, *modules)).strip()
        lines = []
        for module in _filled(modules):
            title = module.removeprefix("tickwise.")
            lines += [f"## `{title}`", "", "```{eval-rst}", f".. automodule:: {module}", "```", ""]
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


class Modules(SphinxDirective):
    """A table of the public modules of a package, with the first sentence on each."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The table, whose names lead to the sections."""
        lines = ["```{eval-rst}", ".. list-table::", "   :widths: 30 70", ""]
        for module in _filled(public_modules(self.arguments[0])):
            about = (import_module(module).__doc__ or "").split("\n\n")[0].replace("\n", " ")
            lines += [f"   * - :py:mod:`{module.removeprefix(f'{self.arguments[0]}.')} <{module}>`", f"     - {about}"]
        return self.parse_text_to_nodes("\n".join((*lines, "```")))


def _filled(modules: tuple[str, ...]) -> list[str]:
    """The modules that define something; a package's own file may have nothing but a description."""
    return [module for module in modules if set(places(module)) - {"__all__"}]


class Facade(SphinxDirective):
    """A table for every package whose names ``tickwise`` offers: the name and the first sentence on it."""

    def run(self) -> list[nodes.Node]:
        """The tables in the order of the data flow."""
        import tickwise

        homes: dict[str, list[Any]] = {}
        for name in tickwise.__all__:
            value = getattr(tickwise, name)
            homes.setdefault(value.__module__.split(".")[1], []).append(value)
        lines = []
        for package in sorted(homes, key=_PACKAGES.index):
            about = (import_module(f"tickwise.{package}").__doc__ or "").split("\n")[0]
            lines += [f"**{package}**" if package == "errors" else f"**{package}**: {about}", ""]
            lines += [".. list-table::", "   :widths: 34 66", ""]
            for value in homes[package]:
                first = (inspect.getdoc(value) or "").split("\n\n")[0].replace("\n", " ")
                lines += [f"   * - :py:obj:`{value.__name__} <{value.__module__}.{value.__qualname__}>`"]
                lines += [f"     - {first}"]
            lines += [""]
        node = nodes.container()
        text = "\n".join(("```{eval-rst}", *lines, "```"))
        self.state.nested_parse(StringList(text.split("\n"), "facade"), 0, node)
        return node.children


_PACKAGES = ("logic", "automata", "envs", "inference", "rl", "transfer", "library", "experiments", "errors")


def _signature_of_the_source(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str, str | None] | None:
    """The signature with annotations as they are written: evaluated, an alias such as NDArray fills three lines."""
    del app, name, options, returns
    if what not in ("function", "method", "class") or signature is None:
        return None
    if not str(getattr(obj, "__module__", "")).startswith("tickwise."):
        return None  # what a module only imports is asked for too, and then left out
    try:
        found = inspect.signature(obj)
    except (TypeError, ValueError):
        return None
    if what == "method" and next(iter(found.parameters), "") in ("self", "cls"):
        found = found.replace(parameters=list(found.parameters.values())[1:])
    known = {**imported(obj.__module__), **vars(sys.modules[obj.__module__])}
    parameters = [each.replace(annotation=_full(each.annotation, known)) for each in found.parameters.values()]
    text = stringify_signature(found.replace(parameters=parameters), show_return_annotation=False)
    returned = _full(found.return_annotation, known)
    return text, None if what == "class" or returned is inspect.Signature.empty else str(returned)


def _full(annotation: Any, known: dict[str, Any]) -> Any:
    """An annotation with the full names of what is ours: several modules have, for instance, a Task."""
    if annotation is inspect.Signature.empty:
        return annotation
    text = annotation if isinstance(annotation, str) else getattr(annotation, "__name__", str(annotation))
    return re.sub(r"(?<![\w.'\"])[A-Z]\w*", lambda match: _home(match.group(), known), text)


def _home(name: str, known: dict[str, Any]) -> str:
    """The full name; a text among what is known is one that only a type checker imports."""
    value = known.get(name)
    if isinstance(value, str):
        return value
    home = getattr(value, "__module__", None) if inspect.isclass(value) else None
    if value is None or (home is not None and not home.startswith("tickwise")):
        return name
    homes = (home,) if home else tuple(module for module in public_modules("tickwise") if name in places(module))
    return next((f"{module}.{name}" for module in homes if _has(module, name, value)), name)


def _has(module: str, name: str, value: object) -> bool:
    return getattr(import_module(module), name, None) is value


def _skip_what_dataclasses_add(app: Sphinx, what: str, name: str, obj: Any, skip: bool, options: Any) -> bool | None:
    """Leave out attributes that the class's own description already lists."""
    del app, what, skip, options
    return True if inspect.ismemberdescriptor(obj) or name.startswith("_") else None


def _warn_of_missing_modules(app: Sphinx, env: Any) -> None:
    del app
    documented = {name for metadata in env.metadata.values() for name in str(metadata.get("modules", "")).split()}
    for module in sorted(set(public_modules("tickwise")) - documented):
        if module != "tickwise" and not module.startswith(LEFT_OUT):
            LOGGER.warning("the module %s is on no page; add its package to docs/reference/api", module)
