"""Run, record and analyse studies of how liquids feel through a haptic device.

docs/architecture.md lists the packages; an import may only point to a lower layer (``lint-imports``).
"""

import os

os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # none is used; the search reads every package

__version__ = "0.2.0"
