"""How devices may be named, and the name of the default device."""

from typing import Final

NAME_PATTERN: Final = "[a-z][a-z0-9-]*"
DEFAULT_DEVICE: Final = "mouse"
