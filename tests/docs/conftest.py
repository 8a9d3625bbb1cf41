"""The documentation's own modules are beside its pages, and are imported by their plain names as Sphinx does."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "_ext"))
