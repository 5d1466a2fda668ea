"""Pages to read: what they say, which keys go on, breaks that last, long texts, languages to choose from."""

from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtGui import QPointingDevice

from study_app.protocol.wording.languages import LANGUAGES, words
from study_app.session.pages import PausePage
from study_app.session.transitions.events import Continue, EndRequested, LanguageChosen, ResumeRequested
from tests.gui.participant.driver import KEY, Participant, tap
from tests.gui.small import text_page

Opening = Callable[..., Participant]
FULL = (1366, 768)
ENGLISH = words("en")


def consent(*languages: str, language: str = "en") -> Any:
    return text_page("consent", languages=languages or ("en", "nl", "de"), language=language)


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


def test_texts_languages_and_a_pause_work_by_touch(opening: Opening, finger: QPointingDevice) -> None:
    seen = opening(consent(), FULL)
    tap(finger, seen.find("Nederlands"))
    tap(finger, seen.find("Go on"))
    seen.show(PausePage(force_off=False))
    tap(finger, seen.page.button)
    assert seen.kinds == [LanguageChosen, Continue, ResumeRequested]
