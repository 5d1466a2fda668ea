"""Haptic devices: interface, drivers, emulators and measurement."""

from typing import Final

NAME_PATTERN: Final = "[a-z][a-z0-9-]*"
DEFAULT_DEVICE: Final = "mouse"
WITHOUT_FORCE: Final = {"mouse": "Mouse", "spacemouse": "SpaceMouse"}
"""The titles of devices that give no force, by name."""
