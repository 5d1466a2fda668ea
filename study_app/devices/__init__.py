"""Haptic devices: interface, drivers, emulators and measurement."""

from typing import Final

NAME_PATTERN: Final = "[a-z][a-z0-9-]*"
DEFAULT_DEVICE: Final = "mouse"
