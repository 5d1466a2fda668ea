"""Pages to read: what they say, which keys go on, breaks that last, long texts, languages to choose from."""

from collections.abc import Callable
from html import unescape
from typing import Any

import pytest
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QPointingDevice
from PySide6.QtWidgets import QScrollArea, QScroller

from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import EndPage, PausePage, TroublePage
from study_app.session.transitions.events import Continue, EndAsked, LanguageChosen, ResumeAsked
from tests.gui.participant.driver import KEY, Participant, name_of, tap
from tests.gui.small import text_page

Opening = Callable[..., Participant]
FULL, SMALL = (1366, 768), (1024, 640)
ENGLISH = words("en")
LONG = ("A sentence about the study. " * 30,) * 4
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
        assert (type(end), end.status, end.reason) == (EndAsked, "withdrawn", "no consent")
    with pytest.raises(LookupError):
        opening(text_page(), FULL).find(ENGLISH.decline)


def test_a_pause_resumes_with_enter_and_says_whether_the_force_is_off(opening: Opening) -> None:
    seen = opening(PausePage(force_off=False), FULL)
    seen.press(KEY.Key_Space)
    assert seen.told == []
    seen.press(KEY.Key_Return)
    assert seen.kinds == [ResumeAsked]
    assert ENGLISH.pause_title in seen.texts
    seen = opening(PausePage(force_off=True), FULL)
    assert ENGLISH.force_off_title in seen.texts
    assert ENGLISH.pause_title not in seen.texts.replace(ENGLISH.force_off_title, "")
    seen.click(ENGLISH.force_on)
    assert seen.kinds == [ResumeAsked]


@pytest.mark.parametrize("language", ["en", "nl"])
@pytest.mark.parametrize("page", [PausePage(True, "force"), PausePage(True, "pause"), PausePage(False, "pause")])
def test_what_the_operator_stopped_and_trouble_have_nothing_to_press(
    opening: Opening, page: PausePage, language: str
) -> None:
    said, seen = words(language), opening(page, FULL, language)
    assert seen.page.button is None
    seen.press(*GO)
    assert seen.told == []
    assert (said.force_held_title in seen.texts) is (page.held == "force")
    assert (said.force_held_body if page.force_off else said.pause_held_body) in seen.texts
    seen.show(TroublePage("One moment", "Help comes."))
    seen.press(*GO)
    assert (seen.page.button, seen.told) == (None, [])
    assert "Help comes." in seen.texts


@pytest.mark.parametrize("held", [None, "pause", "force"])
@pytest.mark.parametrize("mouse", [False, True])
def test_a_stop_speaks_of_force_but_where_the_device_is_the_mouse(opening: Opening, held: Any, mouse: bool) -> None:
    seen = opening(PausePage(force_off=True, held=held), captures_pointer=mouse)
    assert seen.texts
    assert ("force" in seen.texts or "push" in seen.texts) is not mouse


@pytest.mark.parametrize("mouse", [False, True])
def test_the_last_page_asks_to_let_go_of_the_device_unless_that_is_the_mouse(opening: Opening, mouse: bool) -> None:
    for language, said in LANGUAGES.items():
        seen = opening(said=language, captures_pointer=mouse)
        for page in (EndPage(said.end_title, said.end_body), EndPage(said.ended_early_title, said.ended_early_body)):
            seen.show(page)
            assert page.paragraph in unescape(seen.texts)
            assert (said.let_go in unescape(seen.texts)) is not mouse


def test_a_break_counts_down_and_then_offers_its_button(opening: Opening, qtbot: Any) -> None:
    seen = opening(size=FULL)
    seen.clock.step_s = 0.0
    seen.show(text_page("break", stays_until_s=seen.clock.now_s + 30))
    assert not seen.page.button.isVisible()
    assert seen.page.count == ENGLISH.continue_in.format(seconds=30)
    seen.press(KEY.Key_Space, KEY.Key_Return)
    assert seen.told == []
    seen.clock.now_s += 29.4
    qtbot.waitUntil(lambda: seen.page.count == ENGLISH.continue_in.format(seconds=1))
    seen.clock.now_s += 0.6
    qtbot.waitUntil(seen.page.button.isVisible)
    assert seen.page.count == ""
    assert not seen.page.findChild(QTimer).isActive()
    assert seen.focus is seen.page.button
    seen.press(KEY.Key_Space)
    assert seen.kinds == [Continue]
    seen.show(text_page("break", stays_until_s=90.0))
    assert seen.page.count == "", "it comes back after its time"
    seen.press(KEY.Key_Space)
    assert seen.kinds == [Continue, Continue]


def test_a_long_text_is_read_by_the_keyboard_or_a_finger_and_keeps_its_button(opening: Opening) -> None:
    seen = opening(text_page(paragraphs=LONG), SMALL)
    area = seen.page.findChild(QScrollArea)
    bar = area.verticalScrollBar()
    assert seen.page.rect().contains(seen.page.button.geometry())
    assert area.verticalScrollBarPolicy() == Qt.ScrollBarPolicy.ScrollBarAlwaysOn
    assert QScroller.hasScroller(area.viewport())
    seen.press(KEY.Key_Down, KEY.Key_Down)
    assert bar.value() > 0
    assert seen.focus is seen.page.button
    seen.press(KEY.Key_Up, KEY.Key_Up)
    assert bar.value() == 0
    seen.press(KEY.Key_PageDown)
    assert 0.5 * bar.pageStep() < bar.value() < bar.pageStep(), "a line of the page before stays"
    seen.press(*[KEY.Key_PageDown] * 12)
    assert bar.value() == bar.maximum() > 0
    seen.press(*[KEY.Key_PageUp] * 13)
    assert bar.value() == 0
    seen.press(KEY.Key_Space)
    assert seen.kinds == [Continue]


@pytest.mark.parametrize("key", GO)
def test_a_key_on_a_language_chooses_it_and_does_not_agree(opening: Opening, key: KEY) -> None:
    seen = opening(consent(), FULL)
    seen.find("Nederlands").setFocus(Qt.FocusReason.TabFocusReason)
    seen.press(key)
    assert [(type(event), event.language) for event in seen.told] == [(LanguageChosen, "nl")]


def test_tab_goes_round_to_the_language_of_the_page_and_arrows_choose(opening: Opening) -> None:
    for language, key, chosen in (("en", KEY.Key_Right, "nl"), ("nl", KEY.Key_Left, "en")):
        seen = opening(consent(language=language), FULL, language)
        order = []
        for _ in range(5):
            seen.press(KEY.Key_Tab)
            order.append(seen.focus)
        names = [name_of(one) for one in order]
        assert names[0] == names[3] == {"en": "English", "nl": "Nederlands"}[language]
        assert names[1:3] == ["Go on", words(language).decline]
        seen.find(names[0]).setFocus(Qt.FocusReason.TabFocusReason)
        seen.press(key)
        assert [event.language for event in seen.told] == [chosen]


def test_another_language_changes_every_page_that_follows(opening: Opening) -> None:
    seen = opening(consent("en", "nl", "ar"), FULL)
    seen.click("العربية")
    assert [event.language for event in seen.told] == ["ar"]
    seen.show(consent("en", "nl", "ar", language="ar"))
    assert seen.page.layoutDirection() == Qt.LayoutDirection.RightToLeft
    assert seen.window.windowTitle() == words("ar").window_title
    seen.show(PausePage(force_off=False))
    assert words("ar").pause_title in seen.texts
    seen.show(text_page("break"))
    assert seen.page.layoutDirection() == Qt.LayoutDirection.LeftToRight


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
    assert seen.kinds == [LanguageChosen, Continue, ResumeAsked]


def test_pages_grow_with_the_window_and_never_shrink(opening: Opening) -> None:
    heights = {}
    for size in ((1366, 768), (1024, 640), (1920, 1080)):
        seen = opening(text_page(), size)
        heights[size] = seen.find("Go on").fontMetrics().height()
    assert heights[1024, 640] == heights[1366, 768] < heights[1920, 1080]
