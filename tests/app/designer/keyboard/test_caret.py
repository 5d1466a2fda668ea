"""A text that is typed while the form changes around it."""

from typing import Any

import pytest
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app.viewmodels.designer.requests import SetValue

pytestmark = pytest.mark.slow


def test_what_is_typed_into_a_missing_text_stays_in_its_language(qtbot: Any, designer: Any) -> None:
    designer.controller.open("kitchen")
    designer.editing.ask(SetValue(("study", "languages"), ("en", "de")))
    designer.editing.ask(SetValue(("study", "title"), {"en": "Kitchen"}))
    designer.editing.select(("study",))
    form = designer.place.form
    qtbot.waitUntil(lambda: bool(form.rows))
    row = next(one for one in form.rows if one.row.row.path == ("study", "title"))
    row.field.lines["de"].setFocus()
    for letter in "Kueche und Bad":
        field = QApplication.focusWidget()
        assert field is not None
        QTest.keyClicks(field, letter)
        qtbot.wait(60)
    qtbot.wait(400)
    form.flush()
    assert designer.editing.opened.study.document["study"]["title"] == {"en": "Kitchen", "de": "Kueche und Bad"}
