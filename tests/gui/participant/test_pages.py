"""Pages to read: their texts, keys to continue, timed breaks, long texts, and the choice of language."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence, QPointingDevice, QTextDocument
from PySide6.QtWidgets import QAbstractButton, QLabel

from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import PausePage
from study_app.session.transitions.events import Continue, EndRequested, LanguageChosen, ResumeRequested
from tests.gui.participant.driver import KEY, Participant, tap
from tests.gui.small import QUESTIONS, choice, form, number, questionnaire, text_page

Opening = Callable[..., Participant]
FULL = (1366, 768)
ENGLISH = words("en")


def consent(*languages: str, language: str = "en") -> Any:
    return text_page("consent", languages=languages or ("en", "nl", "de"), language=language)


@pytest.mark.parametrize("by_key", [False, True])
def test_consent_can_be_declined_in_every_language(opening: Opening, by_key: bool) -> None:
    for language, said in LANGUAGES.items():
        participant = opening(text_page("consent", language=language), FULL, language)
        decline = participant.find(said.decline)
        assert participant.page.rect().contains(decline.geometry())
        assert not decline.geometry().intersects(participant.page.button.geometry())
        if by_key:
            decline.setFocus()
            participant.press(KEY.Key_Return)
        else:
            participant.click(decline)
        (end,) = participant.told
        assert (type(end), end.status, end.reason) == (EndRequested, "withdrawn", "no consent")
    with pytest.raises(LookupError):
        opening(text_page(), FULL).find(ENGLISH.decline)


def test_texts_languages_and_a_pause_work_by_touch(opening: Opening, finger: QPointingDevice) -> None:
    participant = opening(consent(), FULL)
    tap(finger, participant.find("Nederlands"))
    tap(finger, participant.find("Go on"))
    participant.show(PausePage(force_off=False))
    tap(finger, participant.page.button)
    assert participant.kinds == [LanguageChosen, Continue, ResumeRequested]


MARKUP = "<b>&amp;</b> <img src=x> & _"


def with_markup(page: Any) -> Any:
    """Return a page with markup after each of its texts and those of its questions."""
    if isinstance(page, str):
        return f"{page} {MARKUP}"
    if isinstance(page, tuple):
        return tuple(with_markup(part) for part in page)
    names = {"title", "intro", "text", "paragraphs", "button", "item", "items", "unit", "low", "high", "labels"}
    changed = {each.name: getattr(page, each.name) for each in fields(page) if each.name in names}
    marked = {name: with_markup(value) for name, value in changed.items() if value is not None}
    if hasattr(page, "options"):
        marked["options"] = tuple((value, with_markup(text)) for value, text in page.options)
    return replace(page, **marked)


@pytest.mark.parametrize("page", [choice(4), number(), text_page(), questionnaire(), form(*QUESTIONS)])
def test_markup_in_texts_of_a_study_is_shown_as_it_is(opening: Opening, page: Any) -> None:
    participant = opening(with_markup(page), FULL)
    labels = [label for label in participant.page.findChildren(QLabel) if "img" in label.text()]
    for label in labels:
        plain = label.textFormat() is Qt.TextFormat.PlainText
        document = QTextDocument()
        (document.setPlainText if plain else document.setHtml)(label.text())
        assert MARKUP in document.toPlainText()
    buttons = participant.page.findChildren(QAbstractButton)
    assert [button.text() for button in buttons if not QKeySequence.mnemonic(button.text()).isEmpty()] == []
    marked_texts = [button.text().replace("&&", "&") for button in buttons if "img" in button.text()]
    assert all(MARKUP in text for text in marked_texts)
    assert labels or marked_texts or participant.page.accessibleName().count(MARKUP)


def test_languages_read_in_their_own_direction_and_enter_or_an_arrow_chooses_one(opening: Opening) -> None:
    languages = ("ar", "en", "nl")
    for key, language in ((KEY.Key_Right, "nl"), (KEY.Key_Left, "ar")):
        participant = opening(consent(*languages), FULL)
        buttons = {code: participant.find(words(code).name) for code in languages}
        directions = {code: button.layoutDirection() for code, button in buttons.items()}
        left, right = Qt.LayoutDirection.LeftToRight, Qt.LayoutDirection.RightToLeft
        assert directions == {"ar": right, "en": left, "nl": left}
        assert [code for code, button in buttons.items() if button.isChecked()] == ["en"]
        focusable = [code for code, button in buttons.items() if button.focusPolicy() & Qt.FocusPolicy.TabFocus]
        assert focusable == ["en"]
        assert buttons["ar"].x() < buttons["en"].x() < buttons["nl"].x()
        buttons["en"].setFocus()
        participant.press(key)
        assert participant.kinds == [LanguageChosen]
        assert participant.told[0].language == language
    participant = opening(consent(*languages), FULL)
    participant.find(words("nl").name).setFocus()
    participant.press(KEY.Key_Return)
    assert participant.kinds == [LanguageChosen]
    assert participant.told[0].language == "nl"
