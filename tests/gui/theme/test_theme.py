"""Contrast computed by WCAG 2.2, fonts that really are there, icons that paint."""

import itertools
from typing import Any

import numpy as np
import pytest
from PySide6.QtGui import QColor, QFontInfo, QImage
from PySide6.QtWidgets import QAbstractButton, QLineEdit, QPlainTextEdit, QVBoxLayout, QWidget

from study_app.gui.theme import icons
from study_app.gui.theme.theme import DARK, LIGHT, PARTICIPANT, TANK, Theme, font, load_fonts, stylesheet
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.controls import Check, Radio

THEMES = [LIGHT, DARK, PARTICIPANT]


def luminance(colour: str) -> float:
    """Return the relative luminance of WCAG 2.2."""
    shares = (QColor(colour).redF(), QColor(colour).greenF(), QColor(colour).blueF())
    red, green, blue = (s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(colour: str, other_colour: str) -> float:
    lighter, darker = sorted((luminance(colour), luminance(other_colour)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


TEXTS = (
    *itertools.product(("text", "text2", "text3"), ("window", "surface")),
    *itertools.product(("text", "text2"), ("hover", "selected", "warn_bg")),
    *itertools.product(("accent", "ok", "warn", "bad"), ("surface",)),
    ("accent", "window"), ("on_accent", "accent"), ("on_accent", "accent_hover"), ("on_stop", "stop"),
    ("ok", "ok_bg"), ("warn", "warn_bg"), ("bad", "bad_bg"), ("text", "warn_bg"),
)  # fmt: skip
EDGES = tuple(itertools.product(("ctl", "trace_x", "trace_y", "trace_z", "accent"), ("surface", "window")))


def test_texts_reach_4_5_and_edges_of_controls_and_traces_3() -> None:
    weak = {
        (theme.name, ink, ground): ratio
        for theme in THEMES
        for least, pairs in ((4.5, TEXTS), (3.0, EDGES))
        for ink, ground in pairs
        if (ratio := contrast(getattr(theme, ink), getattr(theme, ground))) < least
    }
    assert weak == {}
    assert min(contrast(getattr(TANK, role), TANK.water_light) for role in ("lit", "proxy_light")) >= 3.0


def test_inter_is_the_packages_own_and_has_its_four_weights(qapp: object) -> None:
    assert "Inter" in load_fonts()
    for weight in (400, 500, 600, 700):
        info = QFontInfo(font("body", weight=weight))
        assert (info.family(), info.weight()) == ("Inter", weight)


@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
@pytest.mark.parametrize("kind", [QLineEdit, QPlainTextEdit])
def test_a_refused_field_with_the_keyboard_shows_both(
    qtbot: Any, theme: Theme, kind: type[QLineEdit | QPlainTextEdit]
) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    column = QVBoxLayout(window)
    fields = [kind(), kind()]
    for field in fields:
        field.setProperty("dense", "true")
        field.setProperty("state", "refused")
        column.addWidget(field)
    window.setStyleSheet(stylesheet(theme))
    window.show()
    window.activateWindow()
    fields[0].setFocus()
    qtbot.waitUntil(fields[0].hasFocus)
    colours = []
    for field in fields:
        image = field.grab().toImage()
        row = {image.pixelColor(x, image.height() // 2).name().upper() for x in range(image.width())}
        colours.append(row & {theme.accent, theme.bad})
    assert colours == [{theme.accent, theme.bad}, {theme.bad}]


@pytest.mark.parametrize("kind", [Check, Radio])
def test_a_marked_button_with_the_keyboard_has_a_ring(qtbot: Any, kind: type[QAbstractButton]) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    column = QVBoxLayout(window)
    buttons = [kind(), kind()]
    for button in buttons:
        button.setAutoExclusive(False)
        button.setChecked(True)
        column.addWidget(button)
    apply_theme(window, LIGHT)
    window.show()
    window.activateWindow()
    buttons[0].setFocus()
    qtbot.waitUntil(buttons[0].hasFocus)
    drawn = [button.grab().toImage() for button in buttons]
    inked = [[image.pixelColor(x, image.height() // 2).lightnessF() < 0.6 for x in (1, 2)] for image in drawn]
    assert inked == [[True, False], [False, False]]


def test_every_icon_paints_inside_its_square(qapp: object) -> None:
    for name in icons.PATHS:
        icon = icons.icon_pixmap(name, "#FF0000", 24, ratio=2.0).toImage()
        image = icon.convertToFormat(QImage.Format.Format_RGBA8888)
        inked = np.argwhere(np.frombuffer(image.constBits(), np.uint8).reshape(48, 48, 4)[..., 3] > 128)
        assert len(inked) > 40, name
        assert inked.min() > 0, name
        assert inked.max() < 47, name
        assert image.pixelColor(*inked[0][::-1].tolist()).red() == 255
