"""Contrast, sizes and positions of texts and targets on the participant's pages, measured on real widgets."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QRect, QRectF
from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QLineEdit

from study_app.gui.participant.window import ParticipantWindow
from study_app.protocol.wording.languages import words
from study_app.session.pages import (
    EndPage,
    FeedbackPage,
    NumberPage,
    Page,
    PausePage,
    Progress,
    QuestionnairePage,
    TroublePage,
)
from tests.gui.drawn import Drawn, drawn_by
from tests.gui.participant.driver import KEY, Participant
from tests.gui.small import choice, explore, number, questionnaire, task_page, text_page, view

pytestmark = pytest.mark.slow

Opening = Callable[..., Participant]
SIZES = [(1366, 768), (1920, 1080)]
SCALES = [1.0, 1.25, 1.5, 1.75, 2.0]
PARAGRAPHS = ("In this study you move a small ball through simulated liquids and feel them push.", "No name is kept.")


def pages() -> dict[str, Page]:
    """Return one page of each kind with all optional parts."""
    part = Progress(part=1, parts=2, label="", index=4, of=3)
    return {
        "consent": text_page("consent", paragraphs=PARAGRAPHS, languages=("en", "nl", "de", "fr", "ar")),
        "break": text_page("break", paragraphs=PARAGRAPHS, stays_until_s=1000.0, progress=part),
        "explore": task_page(explore(), progress=Progress(part=1, parts=2, label="Liquid setting 1", index=1, of=3)),
        "reach": task_page(),
        "choice": choice(4),
        "number": number(),
        "feedback": FeedbackPage(False),
        "answers": questionnaire(cannot_judge="Cannot judge", chosen=(("item1", 6), ("item2", None))),
        "pause": PausePage(force_off=False),
        "stopped": PausePage(force_off=True),
        "trouble": TroublePage(words("en").trouble_title, words("en").trouble_body),
        "end": EndPage(words("en").end_title, words("en").end_body),
    }


def show(participant: Participant, page: Page) -> None:
    """Show a page with all optional parts: ball, ring, notes on missing answers and a pointed option."""
    window = participant.window
    participant.show(page)
    if window.tank is not None:
        lit = 1 if page == pages()["reach"] else None
        window.show_view(view((0.02, 0.0, 0.0), lit=lit, dwell=0.6, elapsed_s=3.0))
    if isinstance(page, NumberPage):
        participant.press(KEY.Key_Return)  # what is wrong is reported
    if isinstance(page, QuestionnairePage):
        participant.page.submit()
        QTest.mouseMove([row for row in participant.page.fields if row.isVisible()][-1].options[2])
    QApplication.processEvents()


def luminances(image: QImage) -> np.ndarray:
    """Return the relative luminance of WCAG 2.2 of every pixel (height, width)."""
    image = image.convertToFormat(QImage.Format.Format_RGB32)
    raw = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine() // 4, 4)
    shares = np.arange(256) / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    red, green, blue = (linear[raw[:, : image.width(), channel]] for channel in (2, 1, 0))
    return np.asarray(0.2126 * red + 0.7152 * green + 0.0722 * blue)


def contrast(light: np.ndarray, place: QRect) -> float:
    """Return the contrast of the strongest ink in a region to its background, the most frequent luminance."""
    part = light[max(place.top(), 0) : place.bottom() + 1, max(place.left(), 0) : place.right() + 1]
    values, counts = np.unique(np.round(part, 3), return_counts=True)
    ground = values[counts.argmax()]
    ratios = (np.maximum(part, ground) + 0.05) / (np.minimum(part, ground) + 0.05)
    return float(ratios.max())


@pytest.mark.variants(9)
@pytest.mark.parametrize("name", pages())
@pytest.mark.parametrize("size", SIZES, ids=str)
def test_every_word_stands_out_from_its_ground(opening: Opening, size: tuple[int, int], name: str) -> None:
    participant = opening(size=size)
    show(participant, pages()[name])
    texts = drawn_by(participant.window)
    light = luminances(participant.window.grab().toImage())
    assert texts
    weak = {drawn.text: contrast(light, drawn.ink.toAlignedRect()) for drawn in texts}
    assert {text: ratio for text, ratio in weak.items() if ratio < 4.5} == {}


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_edges_of_cells_and_the_ring_of_the_keyboard_stand_out(opening: Opening, size: tuple[int, int]) -> None:
    participant = opening(size=size)
    show(participant, pages()["answers"])
    window = participant.window
    light = luminances(window.grab().toImage())
    for cell in (cell for row in participant.page.fields for cell in row.options):
        if cell.accessibleName() == "Cannot judge" and not cell.isChecked():
            continue  # its dashes are tested with the words beside them: the column has a name and a dash
        middle = cell.mapTo(window, cell.rect().center())
        left = cell.mapTo(window, QPoint(0, 0)).x()
        assert contrast(light, QRect(left - 4, middle.y(), 12, 1)) >= 3.0, cell.accessibleName()
    row = next(row for row in participant.page.fields if row.hasFocus())
    top = row.mapTo(window, QPoint(row.width() // 2, 0))
    assert contrast(light, QRect(top.x(), top.y() - 3, 1, 8)) >= 3.0


@pytest.mark.variants(15)
@pytest.mark.parametrize("name", pages())
@pytest.mark.parametrize("size", [*SIZES, (1024, 640), (880, 640)], ids=str)
def test_whatever_can_be_hit_is_44_px_high_and_wide(opening: Opening, size: tuple[int, int], name: str) -> None:
    participant = opening(size=size)
    show(participant, pages()[name])
    window = participant.window
    kinds = (QAbstractButton, QLineEdit)
    targets = [widget for kind in kinds for widget in window.findChildren(kind) if widget.isVisible()]
    for target in targets:
        ring = 8 if type(target).__name__ in {"GoButton", "LanguageButton"} else 0
        assert min(target.width(), target.height()) - ring >= 44, target.accessibleName() or target.text()
        place = QRect(target.mapTo(window, QPoint(0, 0)), target.size())
        assert window.rect().contains(place)
    for first, second in combinations(targets, 2):
        here, there = (QRect(part.mapTo(window, QPoint(0, 0)), part.size()) for part in (first, second))
        assert not here.intersects(there)


def longer(text: str) -> str:
    """Return a text that is a third longer, as a translation may be."""
    return f"{text} {text[: len(text) // 3]}".rstrip()


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


def misplaced(window: ParticipantWindow, texts: list[Drawn]) -> list[str]:
    """Return the texts that are cut off, leave the window or overlap others."""
    wrong = [f"cut: {drawn.text}" for drawn in texts if not drawn.room.adjusted(-2, -2, 2, 2).contains(drawn.ink)]
    inside = QRectF(window.rect())
    wrong += [f"outside: {drawn.text}" for drawn in texts if not inside.contains(drawn.ink)]
    for first, second in combinations(texts, 2):
        shared = first.ink.intersected(second.ink)
        if min(shared.width(), shared.height()) > 2:
            wrong.append(f"{first.text} × {second.text}")
    return wrong


ROOMS = [*(((1366, 768), text_scale) for text_scale in SCALES), ((1920, 1080), 1.0), ((1920, 1080), 2.0)]


@pytest.mark.variants(36)
@pytest.mark.parametrize("name", ["break", "explore", "reach", "choice", "number", "answers"])
@pytest.mark.parametrize(("size", "text_scale"), [*ROOMS, ((1024, 640), 1.0), ((1024, 640), 2.0)], ids=str)
@pytest.mark.parametrize("said", ["en", "de", "ar"])
def test_no_word_is_cut_or_runs_into_another(
    opening: Opening, size: tuple[int, int], text_scale: float, name: str, said: str
) -> None:
    page = pages()[name]
    if isinstance(page, QuestionnairePage) and said == "de":
        items = tuple(replace(item, text=longer(item.text)) for item in page.items)
        page = replace(page, items=items, labels=tuple(map(longer, page.labels)), intro=longer(page.intro))
    if isinstance(page, QuestionnairePage) and said == "ar":
        items = tuple(replace(item, text=ARABIC) for item in page.items)
        page = replace(page, items=items, labels=ARABIC_LABELS, cannot_judge="لا أستطيع الحكم", intro=ARABIC)
    if name in ("choice", "number"):
        page = {"choice": choice(4, said), "number": number(said)}[name]
    if name == "break":
        page = replace(page, language="ar" if said == "ar" else "en")  # type: ignore[type-var]
    participant = opening(None, size, said, text_scale)
    show(participant, page)
    assert misplaced(participant.window, drawn_by(participant.window)) == []


@pytest.mark.parametrize("said", ["en", "de", "ar"])
def test_in_a_narrow_window_two_lines_of_instruction_do_not_overlap_the_tank(opening: Opening, said: str) -> None:
    participant = opening(None, (880, 420), said, 1.0)
    long = "Move the ball through the liquid in all directions, slowly and fast, and feel what it does to your arm."
    show(participant, task_page(explore(), instruction=long))
    assert misplaced(participant.window, drawn_by(participant.window)) == []
