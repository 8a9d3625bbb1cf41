from __future__ import annotations

from hypothesis import settings

# the first call of a compiled kernel takes seconds
settings.register_profile("compiled", deadline=None)
settings.load_profile("compiled")
