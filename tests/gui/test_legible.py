"""Contrast, sizes and places of what the participant reads and hits, taken from the real widgets."""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect, QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel

from study_app.gui.participant.forms.option_button import RadioOption
from study_app.gui.participant.pages.questionnaire import QuestionnaireWidget
from study_app.gui.participant.pages.statement_field import StatementField
from study_app.gui.participant.window import ParticipantWindow
from study_app.gui.theme.theme import font
from study_app.protocol.wording.languages import Words, words
from study_app.session.pages import EndPage, Page, PausePage, Progress, QuestionnairePage, TroublePage
from tests.gui.drawn import Drawn, drawn_by
from tests.gui.small import STATEMENTS, ManualClock, explore, questionnaire, task_page, text_page, view

pytestmark = pytest.mark.slow

SIZES = [(1366, 768), (1920, 1080), (3840, 2160)]
SCALES = [1.0, 1.25, 1.5, 1.75, 2.0]
PARAGRAPHS = ("In this study you move a small ball through simulated liquids and feel them push.", "No name is kept.")


def pages() -> dict[str, Page]:
    """Return one page of each kind, as full as it can be."""
    part = Progress(1, 2, "", 4, 3)
    return {
        "consent": text_page("consent", paragraphs=PARAGRAPHS, languages=("en", "nl", "de", "fr", "ar")),
        "break": text_page("break", paragraphs=PARAGRAPHS, stays_until_s=1000.0, progress=part),
        "explore": task_page(explore(), progress=Progress(1, 2, "Liquid setting 1", 1, 3)),
        "reach": task_page(),
        "answers": questionnaire(cannot_judge="Cannot judge", chosen=(("item1", 6), ("item2", None))),
        "pause": PausePage(force_off=False),
        "stopped": PausePage(force_off=True),
        "trouble": TroublePage(words("en").trouble_title, words("en").trouble_body),
        "end": EndPage(words("en").end_title, words("en").end_body),
    }


@pytest.fixture
def open_window(qtbot: Any) -> Iterator[Callable[..., ParticipantWindow]]:
    made: list[ParticipantWindow] = []

    def show(size: tuple[int, int], said: Words | None = None, text_scale: float = 1.0) -> ParticipantWindow:
        window = ParticipantWindow(said or words("en"), clock=ManualClock(), windowed=True, text_scale=text_scale)
        qtbot.addWidget(window)
        window.resize(*size)
        window.show()
        window.activateWindow()
        qtbot.waitExposed(window)
        made.append(window)
        return window

    yield show
    for window in made:
        QTest.mouseMove(window, QPoint(1, 1))  # or the next test's page comes with the mouse on a cell
        window.may_close = True
        window.close()


def show(window: ParticipantWindow, page: Page) -> None:
    """Show a page with everything on it that can be: ball and ring, what is missing, what is pointed at."""
    window.show_page(page)
    QApplication.processEvents()
    if window.tank is not None:
        lit = 1 if page == pages()["reach"] else None
        window.show_view(view((0.02, 0.0, 0.0), lit=lit, dwell=0.6, elapsed_s=3.0))
    if isinstance(window.widget, QuestionnaireWidget):
        window.widget.submit()
        QTest.mouseMove([row for row in window.widget.fields if row.isVisible()][-1].options[2])
    QApplication.processEvents()


# contrast


def luminances(image: QImage) -> np.ndarray:
    """Return the relative luminance of WCAG 2.2 of every pixel (height, width)."""
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    raw = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    shares = np.arange(256) / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    red, green, blue = (linear[raw[:, : image.width(), channel]] for channel in (2, 1, 0))
    return np.asarray(0.2126 * red + 0.7152 * green + 0.0722 * blue)


def contrast(light: np.ndarray, place: QRect) -> float:
    """Return the contrast of the strongest ink in a place to its ground, the luminance that most of it has."""
    part = light[max(place.top(), 0) : place.bottom() + 1, max(place.left(), 0) : place.right() + 1]
    values, counts = np.unique(np.round(part, 3), return_counts=True)
    ground = values[counts.argmax()]
    ratios = (np.maximum(part, ground) + 0.05) / (np.minimum(part, ground) + 0.05)
    return float(ratios.max())


@pytest.mark.variants(9)
@pytest.mark.parametrize("name", pages())
@pytest.mark.parametrize("size", SIZES, ids=str)
def test_every_word_stands_out_from_its_ground(
    open_window: Callable[..., ParticipantWindow], size: tuple[int, int], name: str
) -> None:
    window = open_window(size)
    show(window, pages()[name])
    found = drawn_by(window)
    light = luminances(window.grab().toImage())
    assert len(found) >= 2
    weak = {one.text: contrast(light, one.ink.toAlignedRect()) for one in found}
    assert {text: ratio for text, ratio in weak.items() if ratio < 4.5} == {}


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_edges_of_cells_and_the_ring_of_the_keyboard_stand_out(
    open_window: Callable[..., ParticipantWindow], size: tuple[int, int]
) -> None:
    window = open_window(size)
    show(window, pages()["answers"])
    light = luminances(window.grab().toImage())
    for cell in window.findChildren(RadioOption):
        if cell.accessibleName() == "Cannot judge" and not cell.isChecked():
            continue  # its dashes are tested with the words beside them: the column has a name and a dash
        middle = cell.mapTo(window, cell.rect().center())
        left = cell.mapTo(window, QPoint(0, 0)).x()
        assert contrast(light, QRect(left - 4, middle.y(), 12, 1)) >= 3.0, cell.accessibleName()
    row = next(row for row in window.findChildren(StatementField) if row.hasFocus())
    top = row.mapTo(window, QPoint(row.width() // 2, 0))
    assert contrast(light, QRect(top.x(), top.y() - 3, 1, 8)) >= 3.0


# sizes


@pytest.mark.variants(15)
@pytest.mark.parametrize("name", pages())
@pytest.mark.parametrize("size", [*SIZES, (1024, 640), (880, 640)], ids=str)
def test_whatever_can_be_hit_is_44_px_high_and_wide(
    open_window: Callable[..., ParticipantWindow], size: tuple[int, int], name: str
) -> None:
    window = open_window((1024, 640))
    window.setMinimumSize(1, 1)
    window.resize(*size)
    show(window, pages()[name])
    targets = [button for button in window.findChildren(QAbstractButton) if button.isVisible()]
    for target in targets:
        ring = 8 if type(target).__name__ in {"GoButton", "LanguageButton"} else 0
        assert min(target.width(), target.height()) - ring >= 44, target.accessibleName() or target.text()
        place = QRect(target.mapTo(window, QPoint(0, 0)), target.size())
        assert window.rect().contains(place)
    for one, other in combinations(targets, 2):
        here, there = (QRect(part.mapTo(window, QPoint(0, 0)), part.size()) for part in (one, other))
        assert not here.intersects(there)


def test_words_are_as_large_as_they_must_be_read(open_window: Callable[..., ParticipantWindow]) -> None:
    window = open_window((1366, 768), text_scale=1.6)
    for page in pages().values():
        show(window, page)
        least = 0.8 * QFontMetricsF(font("label", scale=1.6)).height()  # the smallest words that carry something
        for one in drawn_by(window):
            small = one.text in {"Esc", "Enter", "Space", "1–7", "↑ ↓"} or one.text.startswith("Please answer")
            if not small and not isinstance(one.widget, QLabel):
                assert one.ink.height() >= least, one.text


# places


def longer(text: str, share: float = 0.35) -> str:
    """Return a text that is ``share`` longer, as a translation may be."""
    letters = re.sub(r"\{[^}]*\}", "", text)
    more, words_of = "", letters.split() or ["more"]
    while len(more) < share * len(letters):
        more += " " + words_of[len(more) % len(words_of)]
    return text + more[: max(2, round(share * len(letters)))].rstrip()


def in_longer_words() -> Words:
    english = words("en")
    kept = {"language", "small_numbers", "space_key", "enter_key", "escape_key"}
    named = {one.name: getattr(english, one.name) for one in fields(Words) if one.name not in kept}
    return replace(english, **{name: _longer(value) for name, value in named.items()})


def _longer(value: str | tuple[str, ...] | Mapping[str, str]) -> Any:
    if isinstance(value, str):
        return longer(value)
    if isinstance(value, Mapping):
        return {name: longer(text) for name, text in value.items()}
    return tuple(map(longer, value))


def with_longer_texts(page: QuestionnairePage) -> QuestionnairePage:
    items = tuple(replace(item, text=longer(item.text)) for item in page.items)
    return replace(page, items=items, labels=tuple(map(longer, page.labels)), intro=longer(page.intro))


ARABIC_LABELS = (
    "لا أوافق إطلاقاً",
    "لا أوافق غالباً",
    "لا أوافق إلى حد ما",
    "محايد",
    "أوافق إلى حد ما",
    "أوافق غالباً",
    "أوافق تماماً",
)
ARABIC = "يتصرف السائل كما أتوقع في كل الاتجاهات."


def misplaced(window: ParticipantWindow, found: list[Drawn]) -> list[str]:
    """Return which words are cut, run out of the window or into others."""
    wrong = [f"cut: {one.text}" for one in found if not one.room.adjusted(-2, -2, 2, 2).contains(one.ink)]
    inside = QRectF(window.rect())
    wrong += [f"outside: {one.text}" for one in found if not inside.contains(one.ink)]
    for one, other in combinations(found, 2):
        shared = one.ink.intersected(other.ink)
        if min(shared.width(), shared.height()) > 2:
            wrong.append(f"{one.text} × {other.text}")
    return wrong


ROOMS = [*(((1366, 768), text_scale) for text_scale in SCALES), ((1920, 1080), 1.0), ((1920, 1080), 2.0)]


@pytest.mark.variants(36)
@pytest.mark.parametrize("name", ["break", "explore", "reach", "answers"])
@pytest.mark.parametrize(("size", "text_scale"), [*ROOMS, ((1024, 640), 1.0), ((1024, 640), 2.0)], ids=str)
@pytest.mark.parametrize("said", ["en", "longer", "ar"])
def test_no_word_is_cut_or_runs_into_another(
    open_window: Callable[..., ParticipantWindow], size: tuple[int, int], text_scale: float, name: str, said: str
) -> None:
    page = pages()[name]
    if isinstance(page, QuestionnairePage) and said == "longer":
        page = with_longer_texts(page)
    if isinstance(page, QuestionnairePage) and said == "ar":
        items = tuple(replace(item, text=ARABIC) for item in page.items)
        page = replace(page, items=items, labels=ARABIC_LABELS, cannot_judge="لا أستطيع الحكم", intro=ARABIC)
    if name == "break":
        page = replace(page, language="ar" if said == "ar" else "en")  # type: ignore[type-var]
    window = open_window(size, in_longer_words() if said == "longer" else words(said), text_scale)
    show(window, page)
    assert misplaced(window, drawn_by(window)) == []


def test_nine_statements_stand_on_one_page_as_long_as_their_words_can_be_read(
    open_window: Callable[..., ParticipantWindow],
) -> None:
    shown = []
    for text_scale in SCALES:
        window = open_window((1366, 768), text_scale=text_scale)
        show(window, questionnaire())
        assert isinstance(window.widget, QuestionnaireWidget)
        shown.append(sum(row.isVisible() for row in window.widget.fields))
    assert shown[:3] == [9, 9, 9]
    assert all(one >= other for one, other in pairwise(shown))


# right to left


def test_all_is_mirrored_but_the_order_of_the_scale(open_window: Callable[..., ParticipantWindow]) -> None:
    here, there = open_window((1366, 768)), open_window((1366, 768), words("ar"))
    page = questionnaire(cannot_judge="Cannot judge")
    for window in (here, there):
        show(window, page)
    assert isinstance(here.widget, QuestionnaireWidget)
    assert isinstance(there.widget, QuestionnaireWidget)
    row, mirror = here.widget.fields[0], there.widget.fields[0]
    width = row.width()
    assert mirror.geometry() == row.geometry()
    here_at, there_at = ([left for left, _ in one.columns] for one in (row, mirror))
    assert there_at[:7] == sorted(there_at[:7])
    assert there_at[7] < there_at[0]
    assert there_at[0] == pytest.approx(width - here_at[6] - row.columns[6][1], abs=2)
    assert there.widget.button.geometry().left() < 60 < here.widget.button.geometry().left()
    told = {one.text: one for one in drawn_by(there)}
    assert told[STATEMENTS[0]].ink.right() > mirror.options[6].mapTo(there, QPoint(0, 0)).x() + 120


def test_right_and_left_keys_go_along_the_scale_in_every_language(
    open_window: Callable[..., ParticipantWindow],
) -> None:
    window = open_window((1366, 768), words("ar"))
    window.show_page(questionnaire())
    assert isinstance(window.widget, QuestionnaireWidget)
    row = window.widget.fields[0]
    QTest.keyClick(row, Qt.Key.Key_Right)
    QTest.keyClick(row, Qt.Key.Key_Right)
    QTest.keyClick(row, Qt.Key.Key_Space)
    assert row.value == 2
