"""The tone of a message: neutral, good, warning or bad."""

from typing import Literal, TypeAlias

Tone: TypeAlias = Literal["ok", "warn", "bad", "accent", "neutral"]
