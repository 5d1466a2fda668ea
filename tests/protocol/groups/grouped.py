"""A study with two groups, as text, and edits of it."""

from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from tests.protocol.edited_studies import text_of

_WHOLE = text_of("grouped")
STUDY = _WHOLE[: _WHOLE.index("\n[groups.")]
GROUPS = _WHOLE.removeprefix(STUDY)


def grouped(*edits: tuple[str, str], groups: str = GROUPS) -> Protocol:
    """Return the study with some of its text replaced."""
    text = STUDY + groups
    for old, new in edits:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    return parse(text.encode(), "grouped")
