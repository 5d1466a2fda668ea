"""Replacements of the shipped studies' sentences about force and feeling, for devices without force.

Only the displayed pages change, and only where a sentence is word for word one of these; the study's file, hash,
receipt and key do not change. Rated statements are never changed, because they are the instrument.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from study_app.protocol.model import Protocol

SENTENCES: Final[Mapping[str, str]] = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
_PATTERNS: Final = tuple(
    (re.compile(r"\s+".join(map(re.escape, pattern.split()))), replacement)
    for pattern, replacement in SENTENCES.items()
)


def without_force(protocol: Protocol) -> Protocol:
    """Return a study whose pages, introductions and instructions do not mention force.

    It is for display only and must not be saved or hashed.
    """
    key_by_table = {"pages": "body", "questionnaires": "intro", "tasks": "instruction"}
    tables = {
        table: {
            name: entry.model_copy(update={key: _without_force_sentences(getattr(entry, key))})
            for name, entry in entries.items()
        }
        for table, key in key_by_table.items()
        for entries in (getattr(protocol, table),)
    }
    return protocol.model_copy(update=tables)


def _without_force_sentences(text: Any) -> Any:
    """Return a localised text with its sentences about force replaced."""
    if isinstance(text, Mapping):
        return {language: _without_force_sentences(sentence) for language, sentence in text.items()}
    for pattern, replacement in _PATTERNS if isinstance(text, str) else ():
        text = pattern.sub(replacement, text)
    return text
