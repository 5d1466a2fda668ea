"""Contrast computed by WCAG 2.2, fonts that really are there, icons that paint."""

import itertools
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFontInfo, QFontMetricsF
from PySide6.QtWidgets import QLineEdit, QPlainTextEdit, QVBoxLayout, QWidget

from study_app.gui.theme import icons
from study_app.gui.theme.theme import DARK, LIGHT, PARTICIPANT, TANK, Theme, font, load_fonts, stylesheet

THEMES = [LIGHT, DARK, PARTICIPANT]


def luminance(colour: str) -> float:
    """Return the relative luminance of WCAG 2.2."""
    shares = (QColor(colour).redF(), QColor(colour).greenF(), QColor(colour).blueF())
    red, green, blue = (s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(one: str, other: str) -> float:
    lighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
@pytest.mark.parametrize(
    ("ink", "ground"),
    [
        *itertools.product(("text", "text2", "text3"), ("window", "surface")),
        *itertools.product(("text", "text2"), ("hover", "selected")),
        ("accent", "surface"),
        ("accent", "window"),
        ("on_accent", "accent"),
        ("on_accent", "accent_hover"),
        ("on_stop", "stop"),
        *itertools.product(("ok", "warn", "bad"), ("surface",)),
        ("ok", "ok_bg"),
        ("warn", "warn_bg"),
        ("bad", "bad_bg"),
        ("text", "warn_bg"),
        ("text2", "warn_bg"),
    ],
)
def test_text_reaches_4_5(theme: Theme, ink: str, ground: str) -> None:
    assert contrast(getattr(theme, ink), getattr(theme, ground)) >= 4.5


@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
@pytest.mark.parametrize("role", ["ctl", "trace_x", "trace_y", "trace_z", "accent"])
@pytest.mark.parametrize("ground", ["surface", "window"])
def test_edges_of_controls_and_traces_reach_3(theme: Theme, role: str, ground: str) -> None:
    assert contrast(getattr(theme, role), getattr(theme, ground)) >= 3.0


@pytest.mark.parametrize("role", ["lit", "proxy_light"])
def test_ring_and_ball_stand_out_from_the_lightest_water(role: str) -> None:
    assert contrast(getattr(TANK, role), TANK.water_light) >= 3.0


def test_inter_is_the_packages_own_and_has_its_four_weights(qapp: object) -> None:
    assert "Inter" in load_fonts()
    for weight in (400, 500, 600, 700):
        found = QFontInfo(font("body", weight=weight))
        assert (found.family(), found.weight()) == ("Inter", weight)


def test_tabular_figures_are_equally_wide(qapp: object) -> None:
    metrics = QFontMetricsF(font("number"))
    widths = [metrics.horizontalAdvance(digit) for digit in "0123456789"]
    assert max(widths) - min(widths) < 0.1  # px: the glyphs' own rounding
    proportional = QFontMetricsF(font("number", tabular=False))
    assert proportional.horizontalAdvance("11111111") < proportional.horizontalAdvance("00000000")


@pytest.mark.parametrize("theme", THEMES, ids=lambda theme: theme.name)
def test_stylesheet_is_understood_by_qt(qtbot: object, theme: Theme) -> None:
    widget = QWidget()
    qtbot.addWidget(widget)  # type: ignore[attr-defined]
    widget.setProperty("role", "window")
    widget.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
    widget.setStyleSheet(stylesheet(theme))
    assert widget.grab().toImage().pixelColor(5, 5) == QColor(theme.window)


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


@pytest.mark.parametrize("name", sorted(icons.PATHS))
def test_every_icon_paints_inside_its_square(qapp: object, name: str) -> None:
    image = icons.icon_pixmap(name, "#FF0000", 24, ratio=2.0).toImage()
    inked = [
        (x, y) for x in range(image.width()) for y in range(image.height()) if image.pixelColor(x, y).alpha() > 128
    ]
    assert len(inked) > 40
    assert all(0 < x < 47 and 0 < y < 47 for x, y in inked)
    assert image.pixelColor(*inked[0]).red() == 255
