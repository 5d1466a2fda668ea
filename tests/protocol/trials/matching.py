"""A study whose participants adjust a damper to a standard, as text."""

from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from tests.protocol.edited_studies import text_of as text_of_study

TEXT = text_of_study("matching")
ALONE = ('kind = "adjustment"\n\n[blocks', 'kind = "adjustment"\nstandard = false\n\n[blocks')
"""Without the interval of the standard."""
DELAY = ('vary = "damping_nspm"\nlevel = "value"\nlevels = [2, 18]', 'vary = "delay_ms"\nlevels = [20, 200]')
"""The visual delay is set, from the present one."""


def text_of(*edits: tuple[str, str]) -> str:
    """Return the study's text with edits."""
    text = TEXT
    for old, new in edits:
        assert old in text, old
        text = text.replace(old, new)
    return text


def matching(*edits: tuple[str, str]) -> Protocol:
    """Return the study with edits of its text."""
    return parse(text_of(*edits).encode(), "matching.toml")
