"""The field of a free text counts and cuts characters as a person sees them."""

import pytest
from PySide6.QtGui import QInputMethodEvent
from PySide6.QtWidgets import QApplication, QWidget

from study_app.gui.participant.forms.questions import TextField
from study_app.protocol.questions import Context, Text, TextView
from study_app.protocol.wording.languages import LANGUAGES

SMILE, FAMILY, FLAG, ACCENT = "\U0001f600", "👨\u200d👩\u200d👧", "🇫🇷", "e\u0301"


def commit_text(app: QApplication, *parts: str, longest: int = 500, at: int | None = None) -> tuple[object, int]:
    """Return the answer after an input method committed each part, and the cursor position in UTF-16 units.

    The last part goes to the place ``at``, if there is one.
    """
    page = QWidget()
    view = TextView("w", 1, "Describe", required=False, longest=longest)
    field = TextField(view, LANGUAGES["en"], page)
    page.show()
    for number, part in enumerate(parts):
        if at is not None and number == len(parts) - 1:
            cursor = field.entry.textCursor()
            cursor.setPosition(at)
            field.entry.setTextCursor(cursor)
        event = QInputMethodEvent("", [])
        event.setCommitString(part)
        QApplication.sendEvent(field.entry, event)
    field.finish()
    place = field.entry.textCursor().position()
    page.close()
    page.deleteLater()
    return field.value, place


def test_typing_goes_on_behind_a_line_break_after_emoji(qapp: QApplication) -> None:
    assert commit_text(qapp, f"{SMILE}{SMILE} one", "\ntwo", "!") == (f"{SMILE}{SMILE} one two!", 13)


def test_removed_control_characters_leave_the_cursor_between_the_same_characters(qapp: QApplication) -> None:
    assert commit_text(qapp, f"{SMILE}ab", "\x07x", at=3) == (f"{SMILE}axb", 4)


@pytest.mark.parametrize("character", [SMILE, FAMILY, FLAG, ACCENT, "👍🏽"])
def test_the_length_counts_visible_characters_and_never_splits_one(qapp: QApplication, character: str) -> None:
    assert commit_text(qapp, character * 5, longest=3)[0] == character * 3
    assert commit_text(qapp, f"ab{character}", longest=2)[0] == "ab"
    question = Text(id="w", kind="text", text="Describe", short="Words", longest=3)
    assert question.problem(character * 3, Context({}, None, "en")) is None
    assert question.problem(character * 4, Context({}, None, "en")) == "the text has 4 characters: write at most 3"


def test_endless_combining_marks_do_not_count_as_one_character(qapp: QApplication) -> None:
    assert commit_text(qapp, "e" + "\u0301" * 100, longest=1) == ("e" + "\u0301" * 31, 32)
