"""Makes the environments known to Gymnasium without importing it before anyone else does.

Gymnasium 1.x has no plug-in entry points: ``gymnasium.make("tickwise:CaseStudy1Source-v0")`` only imports
``tickwise``. Importing Gymnasium takes several times as long as all the rest of ``import tickwise``, so it
waits until it is needed.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # importlib.abc alone would take most of the time that `import tickwise` takes
    from collections.abc import Sequence
    from importlib.abc import Loader
    from importlib.machinery import ModuleSpec
    from types import ModuleType


def _register() -> None:
    from tickwise.envs.catalog import register_all

    register_all()


class _ThenRegister:
    """Loads Gymnasium as its own loader does, then registers the environments."""

    def __init__(self, loader: Loader) -> None:
        self._loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        # from here on the module looks as if it had never been intercepted
        module.__loader__ = self._loader
        if module.__spec__ is not None:
            module.__spec__.loader = self._loader
        self._loader.exec_module(module)
        sys.meta_path[:] = (finder for finder in sys.meta_path if not isinstance(finder, _WaitForGymnasium))
        _register()


class _WaitForGymnasium:
    """Intercepts the import of Gymnasium; it leaves ``sys.meta_path`` once that has succeeded."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != "gymnasium":
            return None
        for finder in sys.meta_path:
            if finder is not self and (spec := finder.find_spec(fullname, path, target)) is not None:
                if spec.loader is not None:
                    spec.loader = _ThenRegister(spec.loader)  # type: ignore[assignment]  # duck-typed: see the imports
                return spec
        return None


def register_with_gymnasium() -> None:
    """Register the environments now if Gymnasium is imported, or else as soon as it is."""
    if "gymnasium" in sys.modules:
        _register()
    elif not any(isinstance(finder, _WaitForGymnasium) for finder in sys.meta_path):
        sys.meta_path.insert(0, _WaitForGymnasium())
