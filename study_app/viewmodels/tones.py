"""The tone of a message: neutral, good, warning or bad."""

from __future__ import annotations

from typing import Literal, TypeAlias

Tone: TypeAlias = Literal["ok", "warn", "bad", "accent", "neutral"]
