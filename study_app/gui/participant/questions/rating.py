"""A rating: a row of points with their names."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar, Final

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from study_app.gui.participant.forms.scale_field import ScaleField
from study_app.gui.theme.theme import PARTICIPANT, font
from study_app.gui.widgets.boxes import hbox
from study_app.protocol.questions import ItemView, RatingView

if TYPE_CHECKING:
    from study_app.protocol.wording.languages import Words

JUDGE_SHARE = 2  # of the row, where every point has one
ALL_NAMED = 5  # points whose names stand side by side; of more the ends, the middle and the one pointed at


class RatingField(ScaleField):
    """Points with their names above them."""

    widget_id: ClassVar[str] = "rating"

    def __init__(self, view: ItemView, words: Words, parent: QWidget) -> None:
        assert isinstance(view, RatingView)  # noqa: S101 - the registry names this widget
        super().__init__(view, words, parent)
        self.build(view.labels, view.cannot_judge, view.cannot_judge)
        scale, area = QWidget(self), QWidget(self)
        scale.setLayoutDirection(Qt.LayoutDirection.LeftToRight)
        self.cells = QGridLayout(scale)
        self.cells.setContentsMargins(0, 0, 0, 0)
        self.row = hbox((scale, len(self.points)), margins=0, parent=area)
        if self.judge is not None:
            self.row.addWidget(self.judge, JUDGE_SHARE, Qt.AlignmentFlag.AlignBottom)
        self.put(area)
        self._names = [QLabel() for _ in self._columns()]
        for (first, last), label, side in zip(self._columns(), self._names, self._sides(), strict=True):
            label.setWordWrap(True)
            label.setAlignment(side | Qt.AlignmentFlag.AlignAbsolute | Qt.AlignmentFlag.AlignBottom)
            self.cells.addWidget(label, 0, first, 1, last - first + 1)
        for place, point in enumerate(self.points):
            self.cells.addWidget(point, 1, place)
            self.cells.setColumnStretch(place, 1)
        self.pointed_at.connect(self._name_points)
        self._name_points()

    def set_scale(self, scale: float) -> None:
        """Grow with the page."""
        super().set_scale(scale)
        self.cells.setSpacing(round(6 * scale))
        self.row.setSpacing(round(14 * scale))
        widest = max(point.sizeHint().width() for point in self.points)
        for point in self.points:
            point.setMinimumWidth(widest)
        for label in self._names:
            label.setFont(font("label", scale=scale, weight=600))

    def _columns(self) -> list[tuple[int, int]]:
        """Return over which columns each name stands, the first and the last of them."""
        points = len(self.labels)
        if points <= ALL_NAMED:
            return [(place, place) for place in range(points)]
        end = points // 3
        return [(0, end - 1), (end, points - end - 1), (points - end, points - 1)]

    def _sides(self) -> list[Qt.AlignmentFlag]:
        """Return to which side of its columns each name stands."""
        centre = Qt.AlignmentFlag.AlignHCenter
        if len(self.labels) <= ALL_NAMED:
            return [centre] * len(self.labels)
        return [Qt.AlignmentFlag.AlignLeft, centre, Qt.AlignmentFlag.AlignRight]

    def _name_points(self, _place: int = -1) -> None:
        """Show the names: all of a short scale; of a long one the ends, and in the middle the one pointed at."""
        texts = list(self.labels)
        if len(texts) > ALL_NAMED:
            middle = self.labels[len(texts) // 2] if len(texts) % 2 else ""
            if 0 < self.pointed < len(texts) - 1:
                middle = f"{self.pointed + 1} {self.labels[self.pointed]}"
            texts = [self.labels[0], middle, self.labels[-1]]
        for place, (label, text) in enumerate(zip(self._names, texts, strict=True)):
            at = self.pointed == place if len(self.labels) <= ALL_NAMED else place == 1 and self.pointed > 0
            ink = PARTICIPANT.accent if at else PARTICIPANT.text2
            label.setStyleSheet(f"color: {ink}; background: transparent;")
            label.setText(text)


FIELD: Final = RatingField
