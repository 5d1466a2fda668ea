"""Questions in lines: number, kind, and the text in each language side by side."""

from PySide6.QtCore import QRectF, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from study_app.designer.form.facts.questions import QuestionLine
from study_app.gui.theme.theme import TypeRole, font
from study_app.gui.theme.themed import Themed
from study_app.gui.widgets.boxes import STRETCH, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Icon, Rule, paint_ground
from study_app.gui.widgets.controls import ActionButton, IconButton
from study_app.gui.widgets.labels import Ink, figures, label

NUMBER_PX, ICON_PX, OPEN_PX = 18, 18, 32
INSET_PX = NUMBER_PX + ICON_PX + 2 * 8


class QuestionRow(Themed, QWidget):
    """One question.

    Signals: ``opened`` when it is clicked or its button is pressed, ``joined`` when it is clicked with Shift (True) or
    Ctrl (False).
    """

    opened = Signal()
    joined = Signal(bool)

    def __init__(self, line: QuestionLine) -> None:
        super().__init__()
        self.line, self.chosen = line, False
        title = next((text for text in line.texts if text), "without a text")
        self.setAccessibleName(f"Question {line.number}, {line.kind}: {title}")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setMinimumHeight(38)
        number = figures(str(line.number), "label", "bad" if line.faults else "text2")
        number.setFixedWidth(NUMBER_PX)
        across = hbox(number, Icon(line.icon, "text2", ICON_PX), spacing=8, margins=(0, 3, 0, 3), parent=self)
        self.write: ActionButton | None = None
        for at, text in enumerate(line.texts):
            across.addWidget(self._text(text, line.note if at == 0 else ""), 1)
        self.open = IconButton("chevron", f"Open question {line.number}, {title}", size=OPEN_PX, role="plain")
        self.open.clicked.connect(self.opened)
        across.addWidget(self.open)

    def _text(self, text: str, note: str) -> QWidget:
        if not text:
            return self._missing()
        if not note:
            return _column_text(text, "label")
        both = QWidget()
        vbox(_column_text(text, "label"), _column_text(note, "small", "text2"), spacing=0, margins=0, parent=both)
        both.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        return both

    def _missing(self) -> QWidget:
        made = QWidget()
        made.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Minimum)
        self.write = ActionButton("", "Write", height=32)
        self.write.setProperty("dense", "true")
        self.write.setFont(font("label"))
        self.write.setAccessibleName(f"Write the missing text of question {self.line.number}")
        self.write.clicked.connect(self.opened)
        missing = Icon("warning", "bad", 16), label("Missing", "label", "bad")
        hbox(*missing, STRETCH, self.write, spacing=6, margins=0, parent=made)
        return made

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() != Qt.MouseButton.LeftButton or not self.rect().contains(event.position().toPoint()):
            return
        shift = event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        if shift or event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.joined.emit(bool(shift))
        else:
            self.opened.emit()

    def show_chosen(self, chosen: bool) -> None:
        if chosen != self.chosen:
            self.chosen = chosen
            self.setAccessibleDescription("Selected" if chosen else "")
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.chosen:
            paint_ground(self, self.theme.selected)


def _column_text(text: str, role: TypeRole, ink: Ink = "text") -> QLabel:
    """Return a text as wide as its column, whatever its length."""
    made = label(text, role, ink, wraps=True)
    policy = made.sizePolicy()
    policy.setHorizontalPolicy(QSizePolicy.Policy.Ignored)
    made.setSizePolicy(policy)
    return made


class QuestionRows(QWidget):
    """Questions above or below the one that is edited.

    ``write_asked`` carries the path of one, ``join_asked`` also whether all between are selected with it.
    """

    write_asked = Signal(object)
    join_asked = Signal(object, bool)

    def __init__(self, lines: tuple[QuestionLine, ...], languages: tuple[str, ...] = ()) -> None:
        super().__init__()
        column = vbox(spacing=0, margins=0, parent=self)
        if len(languages) > 1:
            column.addWidget(LanguageNames(languages))
        self.rows: list[QuestionRow] = []
        for line in lines:
            made = QuestionRow(line)
            made.opened.connect(lambda path=line.path: self.write_asked.emit(path))
            made.joined.connect(lambda all_between, path=line.path: self.join_asked.emit(path, all_between))
            add_parts(column, made, Rule())
            self.rows.append(made)


class LanguageNames(QWidget):
    """Names of languages above the columns of questions."""

    def __init__(self, languages: tuple[str, ...], right: int = OPEN_PX) -> None:
        super().__init__()
        heads = ((_column_text(language, "small", "text2"), 1) for language in languages)
        hbox(*heads, spacing=8, margins=(INSET_PX, 0, right + 8, 0), parent=self)


class Panel(Themed, QWidget):
    """The tinted ground of the question that is edited, with an accent line at its left."""

    def paintEvent(self, _event: QPaintEvent) -> None:
        paint_ground(self, self.theme.selected)
        QPainter(self).fillRect(QRectF(0, 2, 3, self.height() - 4), QColor(self.theme.accent))
