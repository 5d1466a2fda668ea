"""Where the session is now: part, trial and time in it; and what has been counted so far.

In the rail they stand above and below the steps; in a small window they lie flat at the head of the middle.
"""

from PySide6.QtCore import Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from study_app.gui.theme.theme import TypeRole, font
from study_app.gui.widgets.boxes import STRETCH, hbox, vbox
from study_app.gui.widgets.cards import Bar
from study_app.gui.widgets.labels import Elided, figures, label
from study_app.viewmodels.number_words import minutes
from study_app.viewmodels.operator import OperatorView

HEADINGS: tuple[TypeRole, ...] = ("display", "title", "title_dense", "card")


class Now(QWidget):
    """Part, trial, what is done in it, and for how long."""

    def __init__(self) -> None:
        super().__init__()
        self.part = Elided("label", "text2")
        self.heading = label("", "display")
        self.heading.setMinimumWidth(1)
        self.setting = label("", "body", "text2", wraps=True)
        self.elapsed_word = label("Elapsed", "label", "text2")
        self.elapsed = figures("", "label")
        self.bar = Bar()
        keep = self.bar.sizePolicy()
        keep.setRetainSizeWhenHidden(True)
        self.bar.setSizePolicy(keep)
        self.least = figures("", "small", "text2")
        self._words, self._time = QWidget(), QWidget()
        row = hbox(self.elapsed_word, STRETCH, self.elapsed)
        vbox(self.part, self.heading, self.setting, STRETCH, spacing=6, margins=0, parent=self._words)
        vbox(row, self.bar, self.least, STRETCH, spacing=6, margins=0, parent=self._time)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(24)
        self._grid.setVerticalSpacing(12)
        self.lie_flat(False)

    def lie_flat(self, yes: bool) -> None:
        """Put the time next to the words instead of under them."""
        self._grid.addWidget(self._words, 0, 0)
        self._grid.addWidget(self._time, 0 if yes else 1, 1 if yes else 0)
        self._grid.setColumnStretch(0, 3)
        self._grid.setColumnStretch(1, 2 if yes else 0)

    def show_view(self, view: OperatorView) -> None:
        self.part.show_text(view.part_line)
        if view.heading != self.heading.text():
            self.heading.setText(view.heading)
            self._fit_heading()
        self.setting.setText(view.setting_line)
        self._show_time(view)

    def _show_time(self, view: OperatorView) -> None:
        time = view.trial_time
        self.elapsed_word.setText("Elapsed" if time else "")
        self.elapsed.setText(time.words if time else "")
        self.bar.setVisible(time is not None and bool(time.most_s))
        if time is None or not time.most_s:
            self.least.setText("")
            return
        self.bar.show_share(time.elapsed_s / time.most_s, time.least_s / time.most_s if time.least_s else None)
        self.least.setText(f"at least {minutes(time.least_s)}" if time.least_s else "")

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit_heading()

    def _fit_heading(self) -> None:
        for role in HEADINGS:
            self.heading.setFont(font(role, tabular=True))
            if self.heading.fontMetrics().horizontalAdvance(self.heading.text()) <= self._words.width():
                break


class Tally(QWidget):
    """What is on disk, how many trials were within limits, marks and repeats; the limit broken last; the track."""

    def __init__(self) -> None:
        super().__init__()
        self.counts: list[tuple[QLabel, QLabel]] = []
        self.beyond = label("", "small", "warn", wraps=True)
        self.beyond.hide()
        self.track = label("", "small", "text2", wraps=True)
        self.track.hide()
        self._flat = False
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(8)
        self._grid.setVerticalSpacing(8)

    def lie_flat(self, yes: bool) -> None:
        """Stand in one row instead of one below the other."""
        self._flat = yes
        self._place()

    def show_view(self, view: OperatorView) -> None:
        """Show the counts, the newest limit that was broken (the tip has all of them), and how the track is doing."""
        if len(self.counts) < len(view.counts):
            for _ in range(len(view.counts) - len(self.counts)):
                value = figures("", "label")
                value.setFont(font("label", weight=600, tabular=True))
                self.counts.append((label("", "label", "text2"), value))
            self._place()
        for (name, value), (word, count) in zip(self.counts, view.counts, strict=True):
            name.setText(word)
            value.setText(count)
        self.beyond.setVisible(bool(view.beyond))
        self.beyond.setText(f"{view.beyond[0]}." if view.beyond else "")
        self.beyond.setToolTip("\n".join(view.beyond) if len(view.beyond) > 1 else "")
        self.track.setVisible(bool(view.track))
        self.track.setText("  ·  ".join(view.track))

    def _place(self) -> None:
        left, right = Qt.AlignmentFlag.AlignLeft, Qt.AlignmentFlag.AlignRight
        for index, (name, value) in enumerate(self.counts):
            row, column = (0, 3 * index) if self._flat else (index, 0)
            self._grid.addWidget(name, row, column, left)
            self._grid.addWidget(value, row, column + 1, left if self._flat else right)
        for column in range(9):
            self._grid.setColumnStretch(column, int(column in {2, 5} if self._flat else column == 1))
        for row, line in enumerate((self.beyond, self.track), start=len(self.counts)):
            self._grid.addWidget(line, row, 0, 1, 9 if self._flat else 2)
