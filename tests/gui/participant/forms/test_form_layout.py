"""Forms: everything fits without scrolling, can be hit, and is mirrored from right to left."""

from itertools import pairwise
from typing import Any

import pytest
from PySide6.QtWidgets import QLabel, QWidget

from study_app.gui.participant.forms.question_field import LEAST_TARGET
from study_app.protocol.questions.choice import ChoiceView
from study_app.protocol.questions.question import ItemView
from study_app.protocol.questions.rating import RatingView
from study_app.protocol.questions.slider import SliderView
from tests.gui.participant.forms.opened_form import FIVE, QUESTIONS, form, place_of

pytestmark = pytest.mark.slow

TLX = tuple(
    SliderView(
        f"scale{n}", n, "How much of it was required, and how easy or demanding was it, taken as a whole? " * 2, True,
        low="Low", high="High", step=5,
    )
    for n in range(1, 7)
)  # fmt: skip
SUS = tuple(RatingView(f"sus{n}", n, "I found the system unnecessarily complex.", True, labels=FIVE) for n in range(10))
ELEVEN = (RatingView("r", 1, "How rough?", True, labels=tuple("abcdefghijk"), cannot_judge="Cannot judge"),)
TWELVE = (ChoiceView("c", 1, "Which?", True, options=tuple((f"o{n}", f"The option number {n}") for n in range(12))),)


def test_six_sliders_are_one_part(opening: Any) -> None:
    opened = opening(form(TLX))
    assert len(opened.page.part) == 6


@pytest.mark.variants(10)
@pytest.mark.parametrize("items", [QUESTIONS, TLX, SUS, ELEVEN, TWELVE], ids=["all", "tlx", "sus", "eleven", "twelve"])
@pytest.mark.parametrize(
    ("size", "language", "text_scale"),
    [
        ((1366, 768), "en", 1.0),
        ((1366, 768), "ar", 1.0),
        ((1024, 640), "de", 1.0),
        ((1920, 1080), "fr", 1.0),
        ((1366, 768), "nl", 2.0),
    ],
)
def test_every_part_fits_and_can_be_hit(
    opening: Any, items: tuple[ItemView, ...], size: tuple[int, int], language: str, text_scale: float
) -> None:
    opened = opening(form(items), size, language, text_scale)
    opened.page.submit()  # the notes take room as well
    seen: list[str] = []
    for part in opened.page.parts:
        opened.page.go_to(part[0])
        opened.settle()
        seen += [field.view.id for field in opened.page.part]
        for field in part:
            assert field.isVisible()
            assert opened.page.rect().contains(field.geometry())
            assert field.geometry().bottom() <= opened.page.foot.geometry().top()
            assert field.statement.height() >= field.statement.heightForWidth(field.statement.width()) - 1
            for label in field.findChildren(QLabel):
                if label.isVisible() and label.wordWrap():
                    assert label.height() >= label.heightForWidth(label.width()) - 1, label.text()
            for hit in targets(field):
                assert min(hit.width(), hit.height()) >= LEAST_TARGET, (type(hit), hit.size())
                assert opened.page.rect().contains(place_of(opened, hit))
        for one, other in pairwise(opened.page.part):
            assert one.geometry().bottom() < other.geometry().top() + 1
    assert seen == opened.asked


def targets(field: Any) -> list[QWidget]:
    """Return everything in a question that can be hit."""
    parts = (getattr(field, name, []) for name in ("options", "options", "keys"))
    single = [getattr(field, name) for name in ("line", "entry") if hasattr(field, name)]
    return [one for many in parts for one in many] + single


def test_scale_keeps_its_order_from_right_to_left_and_all_else_is_mirrored(opening: Any) -> None:
    here, there = opening(form()), opening(form(), language="ar")
    for item, part in (("thick", "options"), ("age", "keys")):
        lefts = [place_of(there, one).left() for one in getattr(there.field(item), part)[:5]]
        assert lefts == sorted(lefts)
    options = [place_of(there, one).left() for one in there.field("hand").options]
    assert options == sorted(options, reverse=True)
    width = here.page.width()
    for item in ("hand", "comment"):
        words_here, words_there = (place_of(one, one.field(item).statement) for one in (here, there))
        assert words_here.left() == pytest.approx(width - words_there.right() - 1, abs=2)
