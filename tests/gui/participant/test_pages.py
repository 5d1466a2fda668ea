"""Pages to read: what they say, which keys go on, breaks that last, long texts, languages to choose from."""

from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QPointingDevice

from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import PausePage
from study_app.session.transitions.events import Continue, EndRequested, LanguageChosen, ResumeRequested
from tests.gui.participant.driver import KEY, Participant, tap
from tests.gui.small import text_page

Opening = Callable[..., Participant]
FULL = (1366, 768)
ENGLISH = words("en")
GO = (KEY.Key_Space, KEY.Key_Return, KEY.Key_Enter)


def consent(*languages: str, language: str = "en") -> Any:
    return text_page("consent", languages=languages or ("en", "nl", "de"), language=language)


@pytest.mark.parametrize("kind", ["instructions", "break", "debrief", "consent"])
def test_keys_and_the_button_go_on_but_no_space_bar_agrees(opening: Opening, kind: str) -> None:
    for key in (*GO, None):
        seen = opening(text_page(kind), FULL)
        if key is None:
            seen.click("Go on")
        else:
            seen.press(key)
        assert seen.kinds == ([] if kind == "consent" and key == KEY.Key_Space else [Continue]), key


@pytest.mark.parametrize("by_key", [False, True])
def test_consent_can_be_declined_in_every_language(opening: Opening, by_key: bool) -> None:
    for language, said in LANGUAGES.items():
        seen = opening(text_page("consent", language=language), FULL, language)
        decline = seen.find(said.decline)
        assert seen.page.rect().contains(decline.geometry())
        assert not decline.geometry().intersects(seen.page.button.geometry())
        if by_key:
            decline.setFocus()
            seen.press(KEY.Key_Return)
        else:
            seen.click(decline)
        (end,) = seen.told
        assert (type(end), end.status, end.reason) == (EndRequested, "withdrawn", "no consent")
    with pytest.raises(LookupError):
        opening(text_page(), FULL).find(ENGLISH.decline)


@pytest.mark.parametrize("key", GO)
def test_a_key_on_a_language_chooses_it_and_does_not_agree(opening: Opening, key: KEY) -> None:
    seen = opening(consent(), FULL)
    seen.find("Nederlands").setFocus(Qt.FocusReason.TabFocusReason)
    seen.press(key)
    assert [(type(event), event.language) for event in seen.told] == [(LanguageChosen, "nl")]


def test_the_page_in_another_language_begins_with_the_keyboard_where_it_begins(opening: Opening) -> None:
    pages = {code: consent("en", "nl", language=code) for code in ("en", "nl")}
    seen = opening(pages["en"], FULL)

    def answer(event: Any) -> None:
        if isinstance(event, LanguageChosen):
            seen.window.show_page(pages[event.language])

    seen.window.event.connect(answer)
    for keys, language in (((KEY.Key_Tab, KEY.Key_Right), "nl"), ((KEY.Key_Tab, KEY.Key_Left), "en")):
        seen.press(*keys)
        assert seen.window.page == pages[language]
        assert seen.focus is seen.page


def test_texts_languages_and_a_pause_work_by_touch(opening: Opening, finger: QPointingDevice) -> None:
    seen = opening(consent(), FULL)
    tap(finger, seen.find("Nederlands"))
    tap(finger, seen.find("Go on"))
    seen.show(PausePage(force_off=False))
    tap(finger, seen.page.button)
    assert seen.kinds == [LanguageChosen, Continue, ResumeRequested]
