"""Run, record and analyse studies of how liquids feel through a haptic device.

docs/architecture.md lists the packages; an import may only point to a lower layer (``lint-imports``).
"""

__version__ = "0.3.0"
