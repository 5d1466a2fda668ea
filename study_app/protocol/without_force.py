"""The shipped studies' sentences about force and feeling, as they read with a device that gives no force.

A study's file stays as it is, and so do its hash, its receipt and its key: only pages differ, and only in sentences
that are word for word one of these. The statements that are rated are never changed: they are the instrument.
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
    (re.compile(r"\s+".join(map(re.escape, pattern.split()))), seen) for pattern, seen in SENTENCES.items()
)


def without_force(protocol: Protocol) -> Protocol:
    """Return a study whose pages, introductions and instructions do not mention force.

    It is for display only and must not be saved or hashed.
    """
    reworded = {"pages": "body", "questionnaires": "intro", "tasks": "instruction"}
    tables = {
        table: {
            name: entry.model_copy(update={key: _without_force_sentences(getattr(entry, key))})
            for name, entry in given.items()
        }
        for table, key in reworded.items()
        for given in (getattr(protocol, table),)
    }
    return protocol.model_copy(update=tables)


def _without_force_sentences(text: Any) -> Any:
    """Return a localised text without its sentences about force."""
    if isinstance(text, Mapping):
        return {language: _without_force_sentences(sentence) for language, sentence in text.items()}
    for pattern, seen in _PATTERNS if isinstance(text, str) else ():
        text = pattern.sub(seen, text)
    return text
