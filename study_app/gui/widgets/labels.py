"""Labels with the fonts of the type scale and the colours of the palette."""

from typing import Literal, TypeAlias

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QAccessible, QFont, QFontMetrics, QFontMetricsF, QResizeEvent, QTextLayout
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from study_app.gui.theme.theme import TypeRole, font
from study_app.gui.widgets.accessible import HeadingLabel, PlainLabel, give_role, plain_tip

_HEADINGS: frozenset[TypeRole] = frozenset({"display", "title", "title_dense", "card"})
"""The type roles of headings, which screen readers announce as such."""
Ink: TypeAlias = Literal["text", "text2", "text3", "ok", "warn", "bad", "accent"]


def label(
    text: str = "",
    role: TypeRole = "body",
    ink: Ink = "text",
    *,
    wraps: bool = False,
    heading: bool | None = None,
    weight: int | None = None,
    tabular: bool | None = None,
) -> QLabel:
    """Return a label in the type ``role`` and the colour role ``ink``; by default titles are headings.

    ``tabular`` figures have equal widths.
    """
    widget = HeadingLabel(text) if (role in _HEADINGS if heading is None else heading) else PlainLabel(text)
    widget.setFont(font(role, weight=weight, tabular=tabular))
    widget.setProperty("role", ink)
    widget.setWordWrap(wraps)
    if wraps:
        policy = QSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
        policy.setHeightForWidth(True)
        widget.setSizePolicy(policy)
    return widget


def figures(text: str = "", role: TypeRole = "label", ink: Ink = "text", *, weight: int | None = None) -> QLabel:
    """Return a label with tabular figures, for numbers that change or are in a column."""
    return label(text, role, ink, heading=False, weight=weight, tabular=True)


class Elided(QLabel):
    """A label that is elided if it is too narrow; the complete text is in its tip."""

    def __init__(self, role: TypeRole = "body", ink: Ink = "text") -> None:
        super().__init__()
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setFont(font(role))
        self.setProperty("role", ink)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        if role in _HEADINGS:
            give_role(self, QAccessible.Role.Heading)
        self.whole = ""

    def show_text(self, text: str) -> None:
        if text != self.whole:
            self.whole = text
            self.setAccessibleName(text)
            self.updateGeometry()
            self._show_elided()

    def sizeHint(self) -> QSize:
        metrics = QFontMetricsF(self.font())
        return QSize(round(metrics.horizontalAdvance(self.whole)) + 2, round(metrics.height()) + 2)

    def minimumSizeHint(self) -> QSize:
        return QSize(24, self.sizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_elided()

    def _show_elided(self) -> None:
        shown = self.fontMetrics().elidedText(self.whole, Qt.TextElideMode.ElideRight, self.width())
        self.setText(shown)
        self.setToolTip(plain_tip(self.whole if shown != self.whole else ""))


class Clamped(QLabel):
    """A label with at most ``lines`` lines; a longer text is elided and complete in the tip.

    A ``steady`` label is as high as all its lines, even if the text needs fewer.
    """

    def __init__(
        self, text: str, lines: int, role: TypeRole = "body", ink: Ink = "text", *, steady: bool = True
    ) -> None:
        super().__init__()
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setFont(font(role))
        self.setProperty("role", ink)
        self.setWordWrap(steady)
        if not steady:  # a scrollable column with a wrapping label takes its preferred height
            self.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.setAlignment(Qt.AlignmentFlag.AlignTop)
        self.setAccessibleName(text)
        self.whole, self._most, self._steady = text, lines, steady
        self.setFixedHeight(lines * self.fontMetrics().lineSpacing() + 2)
        if role in _HEADINGS:
            give_role(self, QAccessible.Role.Heading)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._show_clamped()

    def show_text(self, text: str) -> None:
        if text != self.whole:
            self.whole = text
            self.setAccessibleName(text)
            self._show_clamped()

    def _show_clamped(self) -> None:
        lines = _clamp_lines(self.whole, self._most, self.font(), self.width())
        self.setText("\n".join(lines))
        if not self._steady:
            self.setFixedHeight(max(1, len(lines)) * self.fontMetrics().lineSpacing() + 2)
        self.setToolTip(plain_tip(self.whole if lines and lines[-1].endswith("…") else ""))


def _clamp_lines(text: str, most: int, font: QFont, width: int) -> list[str]:
    """Return a text broken into at most ``most`` lines of ``width`` px; the last one is elided if it is too long."""
    layout = QTextLayout(text, font)
    layout.beginLayout()
    lines = []
    while (line := layout.createLine()).isValid():
        line.setLineWidth(width)
        lines.append(text[line.textStart() : line.textStart() + line.textLength()].strip())
    layout.endLayout()
    if len(lines) <= most:
        return lines
    rest = QFontMetrics(font).elidedText(" ".join(lines[most - 1 :]), Qt.TextElideMode.ElideRight, width)
    return [*lines[: most - 1], rest]


def set_ink(widget: QLabel, ink: Ink) -> None:
    """Set the colour role of a label."""
    set_property(widget, "role", ink)


def set_property(widget: QWidget, name: str, value: str) -> None:
    """Set a property used by the style sheet, and apply the style sheet again."""
    if (widget.property(name) or "") != value:
        widget.setProperty(name, value)
        widget.style().unpolish(widget)
        widget.style().polish(widget)
