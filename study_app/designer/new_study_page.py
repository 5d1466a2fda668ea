"""The page of new studies: templates and studies to copy, with a card of the chosen one; and the list of studies."""

import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from pathlib import Path
from typing import Any, Final

from PySide6.QtCore import QPointF, QRectF, QSizeF, Qt, QTimer, Signal
from PySide6.QtGui import (
    QColor,
    QFocusEvent,
    QKeyEvent,
    QLinearGradient,
    QPainter,
    QPainterPath,
    QPaintEvent,
    QPen,
    QResizeEvent,
)
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import (
    QAbstractButton,
    QButtonGroup,
    QHBoxLayout,
    QLayout,
    QLineEdit,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from study_app.designer.document.document import Answers, Document, taken_names, template
from study_app.designer.document.elements import study_title, title_of
from study_app.designer.document.fields import row_at, unit_of
from study_app.designer.document.study import Study, read_study
from study_app.designer.header import HeaderState, StudyChoice, problems_chip
from study_app.designer.outline import icon_of
from study_app.designer.parts import cut_text, make_dense
from study_app.designer.problems import problem_rows
from study_app.designer.templates import FOLDER, QUESTIONS, templates
from study_app.designer.version_rows import VersionChip
from study_app.errors import StudyError
from study_app.gui.home import holds_liquids_alone, is_shipped, known_sources
from study_app.gui.kit import choose_protocol, command_tip, key_cap
from study_app.gui.theme import (
    PARTICIPANT,
    RADIUS_CARD,
    SHADOW,
    TANK,
    Themed,
    font,
    name_scroll_bars,
    remove_widget,
    replace_inside,
)
from study_app.gui.widgets import (
    STRETCH,
    ActionButton,
    Card,
    Check,
    Chip,
    Clamped,
    Icon,
    IconButton,
    Rule,
    add_layout,
    add_parts,
    figures,
    fill_rounded,
    hbox,
    label,
    last_focused,
    scrolled,
    smooth_painter,
    vbox,
)
from study_app.gui.widgets import grid as grid_of
from study_app.ids import MAX_SHORT_NAME, free_short_name, short_name_of
from study_app.number_text import capitalised, counted, duration, number_of, typed_numbers, unclear_number
from study_app.protocol.load import read_document
from study_app.protocol.model import Protocol
from study_app.protocol.orders import expected_duration_s, orders_of
from study_app.protocol.source import Path as Place
from study_app.protocol.source import names, protocol_file, shipped
from study_app.protocol.wording import LANGUAGES, languages_of
from study_app.store.versions import draft_of, drafted_files, kept_original, unsaved_files
from study_app.workspace import workspace

KNOWN_ANSWERS_FILE: Final = FOLDER / "known_answers.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownAnswer:
    """The true threshold of simulated studies (mean of ``people`` observers), and their estimates, in ``unit``.

    ``found`` is the mean of the estimates; ``low`` and ``high`` are the ends of their central 90 %.
    """

    planted: float
    unit: str
    source: str
    people: int
    found: float
    low: float
    high: float

    @property
    def recovered(self) -> bool:
        """Whether the mean estimate is within 10 % of the true threshold, and the central 90 % contain that."""
        return abs(self.found / self.planted - 1) <= 0.1 and self.low <= self.planted <= self.high

    @property
    def most(self) -> float:
        return 10.0 * (1 + int(1.5 * max(self.planted, self.high)) // 10)

    @property
    def sentence(self) -> str:
        return (
            f"Simulated: {self.planted:g} {self.unit} at 75 % correct (based on {self.source}). Estimated: "
            f"{self.found:.3g} {self.unit}; in 9 of 10 simulated studies with {self.people} participants the "
            f"estimate was between {self.low:.3g} and {self.high:.3g} {self.unit}. These numbers come from a model, "
            "not from measurements."
        )


@cache
def known_answers() -> dict[str, KnownAnswer]:
    """Return the known answers by template, as computed when the templates were made."""
    answers: dict[str, Any] = json.loads(KNOWN_ANSWERS_FILE.read_text(encoding="utf-8"))
    return {name: KnownAnswer(**values) for name, values in answers.items()}


_COPY: Final = "copy"
TEMPLATES: Final[Mapping[str, tuple[str, str]]] = {
    "compare-liquids": (
        "Compare liquids",
        "Can participants tell liquids apart and identify them? They rate statements after each liquid.",
    ),
    "two-liquids-abx": (
        "Two liquids, ABX",
        "Can participants tell two liquids apart? They feel A, B and X, which is either A or B, and rate statements "
        "after the block.",
    ),
    "viscosity-jnd": (
        "Viscosity JND",
        "How much thicker must a liquid be to feel thicker? Two-interval trials with adaptive levels.",
    ),
    "delay-detection": (
        "Delay detection",
        "What is the shortest visual delay that participants notice? Two-interval trials with adaptive levels.",
    ),
    "rate-realism": (
        "Rate realism",
        "How real does a liquid feel? Participants set a slider after each of four liquids, three times per liquid.",
    ),
    "questionnaire-only": ("Questionnaire only", "Questions of every type, before, during and after a single trial."),
    "empty": ("Empty study", "One liquid, one block, a welcome page and a thank-you page; ready to run."),
}
"""Title and question of each template, in the order of the page."""


_SHIPPED_NOTE: Final = "shipped study"
_PLANNED_SUFFIX: Final = " planned"
"""Suffix of the number of participants; in the card, an icon of people replaces it."""
_STEPS: Final = ("pages", "blocks", "questionnaires")
"""Sections whose tables are steps of a session."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TemplateQuestion:
    """A question of a template: path of the value, text, unit, permitted values, and the template's value."""

    path: Place
    text: str
    unit: str
    bounds: str
    value: str
    several: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class TemplateChoice:
    """A possible starting point for a new study."""

    source: str  # the name or path by which it is opened
    title: str
    description: str
    copy: bool = False  # whether it is a study to copy
    note: str = ""  # the origin of a study to copy
    figures: tuple[tuple[str, str], ...] = ()  # icon and text of duration, participants and trials
    tags: tuple[tuple[str, str], ...] = ()  # icon and text of force and blinding
    session: tuple[tuple[str, str, str], ...] = ()  # icon, title and duration of each step
    recovery: KnownAnswer | None = None
    name: str = ""  # default short name of a copy
    study_title: str = ""  # default title
    languages: tuple[str, ...] = ()
    questions: tuple[TemplateQuestion, ...] = ()  # beyond title, name and languages


def _available_languages() -> tuple[tuple[str, str], ...]:
    """Return code and name of each language that the participant's pages support."""
    return tuple((code, language.english_name) for code, language in LANGUAGES.items())


def template_choice(name: str, study: Study) -> TemplateChoice:
    """Return the description of a template for the page of new studies."""
    title, description = _title_and_description(study.document)
    shown, question = TEMPLATES.get(name, (name, description))
    protocol = study.protocol
    choice = TemplateChoice(
        source=f"template:{name}", title=shown, description=question, recovery=known_answers().get(name),
        study_title=title, languages=languages_of(study.document), questions=tuple(_template_questions(name, study)),
    )  # fmt: skip
    if protocol is None:
        return choice
    document = study.document
    session = (
        (
            icon_of((section, step), document),
            title_of(document, (section, step)),
            duration(expected_duration_s(protocol, step)),
        )
        for step in protocol.steps
        for section in _STEPS
        if step in names(document, section)
    )
    blind = "Double-blind" if protocol.study.blinding == "double" else "Single-blind"
    tags = (("device", f"Up to {protocol.device.force_limit_n:g} N"), ("lock", blind))
    return replace(choice, figures=tuple(_figure_texts(protocol)), tags=tags, session=tuple(session))


def _copy_choice(source: str, document: Mapping[str, Any], note: str, name: str) -> TemplateChoice:
    """Return the description of a study that can be copied."""
    title, description = _title_and_description(document)
    return TemplateChoice(
        source=source, title=title or source, description=description, copy=True, note=note, name=name,
        study_title=title, languages=languages_of(document),
    )  # fmt: skip


def _title_and_description(document: Mapping[str, Any]) -> tuple[str, str]:
    head = document.get("study", {})
    description = head.get("description", "") if isinstance(head, Mapping) else ""
    return study_title(document), " ".join(str(description).split())


def _figure_texts(protocol: Protocol) -> Iterator[tuple[str, str]]:
    trials = sum(block.trials for block in orders_of(protocol).blocks)
    yield "clock", duration(expected_duration_s(protocol))
    people = None if protocol.analysis is None else protocol.analysis.participants
    if people is not None:
        yield "people", f"{people}{_PLANNED_SUFFIX}"
    yield "layers", counted(trials, "trial")


def _template_questions(name: str, study: Study) -> Iterator[TemplateQuestion]:
    for question, path in QUESTIONS.get(name, ()):
        row = row_at(study.document, path)
        if row is not None:
            current = row.default if row.value is None else row.value
            several = isinstance(current, tuple)
            parts = current if isinstance(current, tuple) else (current,)
            value = ", ".join(f"{part:g}" for part in parts if isinstance(part, int | float))
            unit = row.unit or _unit_of(study, path)
            yield TemplateQuestion(
                path=path, text=question, unit=unit, bounds=", ".join(row.bounds), value=value, several=several
            )


def _unit_of(study: Study, path: Place) -> str:
    """Return the unit of a stimulus' numbers, which is that of the varied quantity; "" for other numbers."""
    varied = study.document.get(path[0], {}).get(path[1], {}).get("vary") if path[0] == "stimuli" else None
    return unit_of(varied) if isinstance(varied, str) else ""


def study_choices(opened: Document | None) -> tuple[StudyChoice, ...]:
    """Return the studies that can be opened: the open one, unsaved drafts, recent files, known names.

    They are sorted by title; shipped studies come last.
    """
    sources = dict.fromkeys([*map(str, unsaved_files(workspace().protocols)), *known_sources()])
    own_source = "" if opened is None else source_of(opened.file)
    if opened is not None:
        sources[own_source] = None
    drafted = {file.resolve() for file in drafted_files()}
    choices = []
    for source in sources:
        file = _resolved_file(source)
        if Path(source).suffix == ".toml" and Path(source).exists() and holds_liquids_alone(source):
            continue
        title = (
            _current_title(file, drafted=file in drafted) if opened is None or source != own_source else opened.title
        )
        stem = Path(source).stem
        is_shipped_study, original = is_shipped(source), "" if file is None else kept_original(file)
        choices.append(
            StudyChoice(
                title=title or stem, file=f"{stem}.toml", source=source, shipped=is_shipped_study, original=original
            )
        )
    return tuple(sorted(choices, key=lambda choice: (choice.shipped, choice.title.casefold(), choice.source)))


def _current_title(file: Path | None, *, drafted: bool) -> str:
    """Return the title of a study, or of its draft if there is one; "" without a title, or if it cannot be read."""
    if file is not None and drafted and (draft := draft_of(file)) is not None:
        return study_title(read_study(draft.text.encode(), file.parent).document)
    try:
        state = None if file is None else file.stat()
    except OSError:
        return ""
    return "" if file is None or state is None else _title_of_file(file, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=256)
def _title_of_file(file: Path, _changed_ns: int, _size: int) -> str:
    try:
        document, _places = read_document(file.read_bytes(), file.name)
    except (StudyError, OSError):
        return ""
    return study_title(document)


def header_state(
    opened: Document | None, choices: tuple[StudyChoice, ...], warnings: int, version: VersionChip
) -> HeaderState:
    """Return the state of the header for the open study, if any; ``warnings`` is their number."""
    if opened is None:
        return HeaderState(studies=choices)
    draft = "Saved" if not opened.edited and opened.base else "Not saved yet"
    if opened.kept is not None and (opened.edited or not opened.base):
        draft = f"Draft kept {opened.kept:%H:%M}"
    return HeaderState(
        studies=choices,
        chosen=source_of(opened.file),
        problems=problems_chip(len(problem_rows(opened.study)), warnings),
        draft="" if opened.read_only else draft,
        undo=opened.done[-1].title if opened.done else "",
        redo=opened.undone[-1].title if opened.undone else "",
        can_save=not opened.read_only and (opened.edited or not opened.base),
        read_only=bool(opened.read_only),
        version=version,
    )


def source_of(file: Path) -> str:
    """Return the name by which a study's file can be opened, or its path if it has none."""
    named_file = _protocol_file(file.stem)
    return file.stem if named_file is not None and named_file.resolve() == file.resolve() else str(file)


def new_choices(source: str = "") -> tuple[TemplateChoice, ...]:
    """Return the choices for a new study: templates, the empty one last, followed by studies to copy.

    Raises StudyError if the study ``source`` cannot be read.
    """
    listed = [name for name in TEMPLATES if name in templates()]
    choices = [_template_choice(name) for name in dict.fromkeys((*listed, *templates()))]
    used_names = taken_names()
    copied = dict.fromkeys([source, *shipped()] if source and not source.startswith("template:") else shipped())
    for name in copied:
        file = shipped().get(name) or protocol_file(name)
        note = _SHIPPED_NOTE if name in shipped() else str(file.name)
        document, _places = read_document(file.read_bytes(), name)
        stem = re.sub(f"{_COPY}[0-9]*$", "", short_name_of(file.stem)) or "study"
        free = free_short_name(used_names, f"{stem[: MAX_SHORT_NAME - len(_COPY)]}{_COPY}")
        choices.append(_copy_choice(name, document, note, free))
    return tuple(choices)


@cache
def _template_choice(name: str) -> TemplateChoice:
    return template_choice(name, template(name))


def _resolved_file(source: str) -> Path | None:
    file = Path(source) if Path(source).suffix == ".toml" else _protocol_file(source)
    return None if file is None else file.resolve()


def _protocol_file(source: str) -> Path | None:
    try:
        return protocol_file(source)
    except StudyError:
        return None


_DEEP_WATER: Final = "#142E40"


def _paint_picture(painter: QPainter, name: str, body: QRectF) -> None:
    """Paint the picture of a template, which shows the participant's task, into the upper part of its card."""
    ground = QPainterPath()
    ground.addRoundedRect(body.adjusted(0, 0, 0, RADIUS_CARD), RADIUS_CARD, RADIUS_CARD)
    painter.save()
    painter.setClipRect(body)
    if name == "questionnaire-only":
        painter.fillPath(ground, QColor(PARTICIPANT.window))
    else:
        water = QLinearGradient(body.topLeft(), body.bottomLeft())
        water.setColorAt(0, QColor(TANK.water_light))
        water.setColorAt(1, QColor(_DEEP_WATER))
        painter.fillPath(ground, water)
        glass = QColor(TANK.glass)
        glass.setAlpha(70)
        painter.setPen(QPen(glass, 1))
        for high, depth in ((0.12, 2.2), (0.17, 1.6)):
            top, across = body.top() + high * body.height(), [step / 60 for step in range(61)]
            points = (QPointF(body.left() + x * body.width(), top + depth * math.sin(6 * math.pi * x)) for x in across)
            painter.drawPolyline(list(points))
    scale = min(body.width() / 340, body.height() / 180)
    size = QSizeF(340 * scale, 190 * scale)
    picture = QRectF(body.center() - QPointF(size.width() / 2, size.height() / 2), size)
    QSvgRenderer(str(FOLDER / f"{name}.svg")).render(painter, picture)
    painter.restore()


PICTURE_PX, CARD_WORDS_PX, COPY_PX = 150, 132, 76
_RING_PX = 4
"""Margin of a card, for the focus ring [px]."""


class Picture(QWidget):
    """The picture of a template, above its text."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self.name = name
        self.setFixedHeight(PICTURE_PX)

    def paintEvent(self, _event: QPaintEvent) -> None:
        _paint_picture(smooth_painter(self), self.name, QRectF(self.rect()))


class _TemplateButton(Themed, QAbstractButton):
    """A starting point for a study: its picture or icon, title, description and figures.

    ``focused`` is emitted when it gets the focus, and carries whether a click caused that.
    """

    focused = Signal(bool)

    def __init__(self, choice: TemplateChoice) -> None:
        super().__init__()
        self.choice = choice
        self.setText(choice.title)
        self.setCheckable(True)
        self.setAccessibleName(f"{'Copy of' if choice.copy else 'Template'} {choice.title}")
        figures = ", ".join(counts for _, counts in choice.figures)
        self.setAccessibleDescription(". ".join(filter(None, (choice.description.rstrip("."), choice.note, figures))))
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFixedHeight(2 * _RING_PX + (COPY_PX if choice.copy else PICTURE_PX + CARD_WORDS_PX))
        picture = choice.source.removeprefix("template:")
        self._empty = not choice.copy and not FOLDER.joinpath(f"{picture}.svg").exists()
        if choice.copy:
            self._lay_out_copy()
        else:
            above = Picture(picture) if not self._empty else Icon("plus", "text", 24)
            description_label = label(choice.description, "label", "text2", wraps=True)
            title, aligned = cut_text(choice.title, "strong", "text"), Qt.AlignmentFlag.AlignHCenter
            if self._empty:
                description_label.setAlignment(aligned)
                title.setAlignment(aligned)
            counts = hbox(
                *(part for figure in choice.figures for part in self._figure_parts(*figure)), STRETCH, spacing=6
            )
            below = vbox(title, description_label, STRETCH, counts, spacing=4, margins=(16, 10, 16, 10))
            picture_row = (hbox(STRETCH, above, STRETCH, margins=(0, 70, 0, 8)),) if self._empty else (above,)
            vbox(*picture_row, (below, 1), spacing=0, margins=_RING_PX + 1, parent=self)
        for part in self.findChildren(QWidget):
            part.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    @staticmethod
    def _figure_parts(icon: str, text: str) -> tuple[QWidget | int, ...]:
        return Icon(icon, "text2", 16), label(text.removesuffix(_PLANNED_SUFFIX), "small", "text2", weight=500), 8

    def _lay_out_copy(self) -> None:
        note_icon = Icon("lock" if self.choice.note == _SHIPPED_NOTE else "layers", "text2", 18)
        title = Clamped(self.choice.title, 2, "label", steady=False)
        texts = vbox(STRETCH, title, cut_text(self.choice.note), STRETCH, spacing=0)
        hbox(note_icon, (texts, 1), spacing=14, margins=(_RING_PX + 22, _RING_PX, _RING_PX + 12, _RING_PX), parent=self)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.focused.emit(event.reason() == Qt.FocusReason.MouseFocusReason)

    def paintEvent(self, _event: QPaintEvent) -> None:
        theme, painter = self.theme, smooth_painter(self)
        if self.hasFocus():
            painter.setPen(QPen(QColor(theme.accent), 2))
            painter.drawRoundedRect(
                QRectF(self.rect()).adjusted(1, 1, -1, -1), RADIUS_CARD + _RING_PX, RADIUS_CARD + _RING_PX
            )
        body = QRectF(self.rect()).adjusted(_RING_PX + 1, _RING_PX + 1, -_RING_PX - 1, -_RING_PX - 1)
        is_chosen, empty = self.isChecked(), self._empty
        fill_rounded(
            painter, body, RADIUS_CARD, theme.hover if self.underMouse() or (empty and not is_chosen) else theme.surface
        )
        style = Qt.PenStyle.DashLine if empty and not is_chosen else Qt.PenStyle.SolidLine
        edge_colour = theme.accent if is_chosen else theme.ctl if empty else theme.border
        painter.setPen(QPen(QColor(edge_colour), 2 if is_chosen else 1, style))
        painter.drawRoundedRect(body, RADIUS_CARD, RADIUS_CARD)


_TICK_COUNT = 4


class _RecoveryBar(Themed, QWidget):
    """An axis from 0 with a bar for the central 90 % of the estimates, and a line at the true value."""

    def __init__(self, shown: KnownAnswer) -> None:
        super().__init__()
        self.shown = shown
        self.setFixedHeight(46)
        self.setAccessibleName("Known answer")
        self.setAccessibleDescription(shown.sentence)

    def paintEvent(self, _event: QPaintEvent) -> None:
        theme, painter, answer = self.theme, smooth_painter(self), self.shown
        left, width_px = 12.0, self.width() - 44.0

        def x_of(value: float) -> float:
            return left + width_px * value / answer.most

        painter.setPen(QPen(QColor(theme.border), 1))
        painter.drawLine(QPointF(left, 28), QPointF(left + width_px, 28))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.accent))
        painter.setOpacity(0.45)
        painter.drawRoundedRect(QRectF(x_of(answer.low), 9, max(4.0, x_of(answer.high) - x_of(answer.low)), 12), 6, 6)
        painter.setOpacity(1)
        painter.setPen(QPen(QColor(theme.text), 2, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(x_of(answer.planted), 3), QPointF(x_of(answer.planted), 28))
        painter.setFont(font("small", tabular=True))
        painter.setPen(QColor(theme.text2))
        for tick in range(_TICK_COUNT + 1):
            value = answer.most * tick / _TICK_COUNT
            label = f"{value:g} {answer.unit}" if tick == _TICK_COUNT else f"{value:g}"
            painter.drawText(QRectF(x_of(value) - 30, 30, 60, 16), Qt.AlignmentFlag.AlignCenter, label)


FIELD_PX, WORDS_PX = 36, 112
_NAME_HINT: Final = "lowercase letters and digits"


class Questions(Themed, QWidget):
    """Fields for the settings of a new study; ``entered`` is emitted at Enter."""

    entered = Signal()

    def __init__(self) -> None:
        super().__init__()
        self._choice: TemplateChoice | None = None
        self.title, self.name = self._make_field("Title"), self._make_field("Short name of the new study")
        self._show_proposed_name()
        self.title.textChanged.connect(self._show_proposed_name)
        self.languages: dict[str, Check] = {}
        self.template_fields: dict[TemplateQuestion, QLineEdit] = {}
        self._grid = grid_of(8, 8, margins=0, parent=self)
        self._grid.setColumnStretch(1, 1)
        self._grid.addWidget(label("Title", "label"), 0, 0, 1, 2)
        self._grid.addWidget(self.title, 1, 0, 1, 2)  # the whole width, since titles are long
        self._add_field(2, "Short name", self.name)
        languages_box = QWidget()
        checks = grid_of(2, 2, margins=0, parent=languages_box)
        for index, (code, name) in enumerate(_available_languages()):
            check = Check(name)
            check.setFont(font("label", weight=400))
            check.setAccessibleName(f"Language {name}")
            check.toggled.connect(self._show_first_texts)
            self.languages[code] = check
            checks.addWidget(check, index // 2, index % 2)
        self.first_texts = label("", "label", "text2", wraps=True)
        checks.addWidget(self.first_texts, checks.rowCount(), 0, 1, 2)
        self._show_first_texts()
        self._grid.addWidget(label("Languages", "label"), 3, 0, 1, 2)
        self._grid.addWidget(languages_box, 4, 0, 1, 2)
        self._question_widgets: list[QWidget] = []

    def _make_field(self, name: str) -> QLineEdit:
        field = make_dense(QLineEdit(), name, FIELD_PX)
        field.returnPressed.connect(self.entered)
        return field

    def _add_field(self, row: int, title: str, field: QWidget) -> QWidget:
        title_label = label(title, "label", wraps=True)
        title_label.setFixedWidth(WORDS_PX)
        self._grid.addWidget(title_label, row, 0)
        self._grid.addWidget(field, row, 1)
        return title_label

    def clear(self) -> None:
        self._choice = None
        self.title.clear()
        self.name.clear()

    def show_choice(self, choice: TemplateChoice) -> None:
        """Show the questions of a template or of a study to copy; a typed title and name are kept."""
        before, self._choice = self._choice, choice
        if before is not None and before.source == choice.source:
            return
        self.title.setPlaceholderText(choice.study_title)
        self._show_proposed_name()
        for code, check in self.languages.items():
            check.setChecked(code in choice.languages)
        for part in self._question_widgets:
            remove_widget(part)
        self._question_widgets, self.template_fields = [], {}
        for row, question in enumerate(choice.questions, start=5):
            field = self._make_field(question.text)
            field.setText(question.value)
            field.setToolTip(question.bounds)
            field.setAccessibleDescription(question.bounds)
            field_box = QWidget()
            across = hbox((field, 1), spacing=8, margins=0, parent=field_box)
            if question.unit:
                across.addWidget(label(question.unit, "label", "text2"))
            self._question_widgets += [self._add_field(row, question.text, field_box), field_box]
            self.template_fields[question] = field
            name_scroll_bars(field_box)

    def _show_proposed_name(self) -> None:
        self.name.setPlaceholderText(self._proposed or _NAME_HINT)

    def _show_first_texts(self) -> None:
        """Show in which language the texts still are if none of the template's languages is chosen."""
        languages = () if self._choice is None else self._choice.languages
        chosen = [code for code, check in self.languages.items() if check.isChecked()]
        untranslated = bool(languages and chosen) and set(languages).isdisjoint(chosen)
        if untranslated:
            self.first_texts.setText(
                f"The texts are still in {dict(_available_languages())[languages[0]]}: please translate them."
            )
        self.first_texts.setVisible(untranslated)

    @property
    def _proposed(self) -> str:
        return short_name_of(self.title.text()) or ("" if self._choice is None else self._choice.name)

    def short_name(self) -> str:
        """Return the typed short name, or one made from the title, or the default one."""
        return self.name.text().strip() or self._proposed

    def answers(self) -> Answers | str:
        """Return the answers, or a sentence on an invalid one."""
        chosen = tuple(code for code, check in self.languages.items() if check.isChecked())
        if not chosen:
            return "choose at least one language"
        values: list[tuple[Any, Any]] = []
        for question, field in self.template_fields.items():
            text = field.text().strip()
            if not text or text == question.value:
                continue
            if not question.several:
                number = number_of(text)
                if number is None:
                    return f"{question.text}: {unclear_number(text)}"
                values.append((question.path, number))
                continue
            try:
                values.append((question.path, [number for _, number in typed_numbers(text)]))
            except ValueError as unclear:
                return f"{question.text}: {unclear}"
        return Answers(self.title.text().strip(), chosen, tuple(values))


CARD_PX, NARROW_CARD_PX, NARROW_BELOW = 400, 330, 1200
_LOW_CARD_PX = 880
TEMPLATE_COLUMNS, COPY_COLUMNS = 3, 4


class NoStudyCard(Card):
    """The card shown while no study is open, with the button ``new``."""

    def __init__(self) -> None:
        super().__init__(padding=28, gap=12)
        self.new = ActionButton("plus", "New study…", cap=key_cap("new"), role="primary")
        self.new.setAccessibleName(command_tip("new"))
        self.new.setToolTip(command_tip("new"))
        parts = (
            Icon("designer", "accent", 44),
            label("No study is open", "card"),
            label("Choose a study above or create a new one.", "body", "text2"),
            self.new,
        )
        centred = ((part, 0, Qt.AlignmentFlag.AlignHCenter) for part in parts)
        add_parts(self.column, (STRETCH, 2), *centred, (STRETCH, 3))


class _ChosenCard(Card):
    """The card of the chosen template: description, session, known answer and questions."""

    def __init__(self) -> None:
        super().__init__(padding=20, gap=10)
        self.questions = Questions()
        self.title = label("", "card")
        self.refusal = label("", "label", "bad", wraps=True)
        self.refusal.hide()
        self.make = ActionButton("plus", "Make study", cap="Enter", role="primary", height=44)
        inside = QWidget()
        self.about, self.details, self.begin = QWidget(), QWidget(), QWidget()
        _column(self.begin, label("Begin with", "strong"), self.questions)
        parts = (self.about, self.details, self.begin, STRETCH)
        self.inside = vbox(*parts, spacing=10, margins=(0, 0, 8, 0), parent=inside)
        self.area = scrolled(inside)
        foot = label("Nothing is saved until you choose to save it.", "small", "text2")
        foot.setAlignment(Qt.AlignmentFlag.AlignCenter)
        add_parts(self.column, self.title, (self.area, 1), self.refusal, self.make, foot)

    def show_choice(self, choice: TemplateChoice) -> None:
        self.title.setText(choice.title)
        before = (self.about, self.details)
        self.about, self.details = QWidget(), QWidget()
        tags = (Chip("neutral", icon, text, small=True) for icon, text in choice.tags)
        description_label = label(choice.description, "label", "text2", wraps=True)
        _column(self.about, description_label, hbox(*tags, STRETCH, spacing=8), Rule())
        column = _column(self.details)
        if choice.session:
            column.addWidget(label("The session", "strong"))
        for icon, title, time in choice.session:
            add_layout(column, _step_line(icon, title, time))
        if choice.session:
            column.addWidget(Rule())
        if choice.recovery is not None:
            is_recovered = choice.recovery.recovered
            recovered = Chip("ok", "check", "recovered", small=True)
            chip = recovered if is_recovered else Chip("warn", "warning", "not recovered", small=True)
            head = hbox(label("Known answer", "strong"), STRETCH, chip)
            add_parts(
                column,
                head,
                _RecoveryBar(choice.recovery),
                label(choice.recovery.sentence, "small", "text2", wraps=True),
                Rule(),
            )
        for old, new in zip(before, (self.about, self.details), strict=True):
            name_scroll_bars(new)
            self.inside.insertWidget(self.inside.indexOf(old), new)
            remove_widget(old)
        self.questions.show_choice(choice)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.inside.removeWidget(self.begin)
        self.inside.insertWidget(1 if self.height() < _LOW_CARD_PX else 2, self.begin)


def _column(parent: QWidget, *parts: QWidget | QLayout) -> QVBoxLayout:
    return vbox(*parts, spacing=8, margins=0, parent=parent)


def _step_line(icon: str, title: str, time: str) -> QHBoxLayout:
    title_line = cut_text(title, "label")
    return hbox(Icon(icon, "text2", 16), (title_line, 1), figures(time, "label", "text2"), spacing=10)


class NewStudyPage(Themed, QWidget):
    """The page of new studies.

    Signals: ``begin_asked`` (source, name, answers), ``copy_asked`` (a file to copy), ``given_up``.
    """

    begin_asked = Signal(str, str, object)
    copy_asked = Signal(str)
    given_up = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.buttons: list[_TemplateButton] = []
        self._choices: tuple[TemplateChoice, ...] = ()
        self._group = QButtonGroup(self)
        self.back = IconButton("chevron_left", "Back", role="plain")
        self.back.clicked.connect(self.given_up)
        aside = cut_text("Choose what you want to find out. You can change everything later.", "label", "text2")
        self.file = ActionButton("file", "From a file…")
        self.file.clicked.connect(self._open_file)
        parts = (self.back, label("New study", "title"), (aside, 1), self.file)
        head = hbox(*parts, spacing=12, margins=(SHADOW, 0, SHADOW, 0))
        self.area = scrolled(QWidget())
        self.card = _ChosenCard()
        self.name, self.make, self.refusal = self.card.questions.name, self.card.make, self.card.refusal
        vbox(head, (hbox((self.area, 1), self.card, spacing=12), 1), spacing=12, margins=0, parent=self)
        self.card.make.clicked.connect(self._ask_to_begin)
        self.card.questions.entered.connect(self._ask_to_begin)
        self._group.buttonToggled.connect(lambda _button, on: self._show_choice() if on else None)

    def show_choices(self, choices: tuple[TemplateChoice, ...], chosen: str) -> None:
        self._choices = choices
        inside = QWidget()
        column = vbox(spacing=12, margins=(0, 0, 12 - _RING_PX, 0), parent=inside)
        self.buttons = []
        for heading, aside, copies, across in (
            ("Templates", "", False, TEMPLATE_COLUMNS),
            (
                "Or copy an existing study",
                "The copy includes the comments; the original is not changed.",
                True,
                COPY_COLUMNS,
            ),
        ):
            labels = label(heading, "card"), label(aside, "small", "text2")
            add_layout(column, hbox(*labels, STRETCH, spacing=10, margins=(_RING_PX, 0, 0, 0)))
            grid = grid_of(14 - 2 * _RING_PX, 14 - 2 * _RING_PX)
            columns = across if self.width() >= NARROW_BELOW else 2
            for index, choice in enumerate(choice for choice in choices if choice.copy == copies):
                card = _TemplateButton(choice)
                card.focused.connect(partial(self._show_focused_card, card))
                self._group.addButton(card)
                grid.addWidget(card, index // columns, index % columns)
                self.buttons.append(card)
            for number in range(columns):
                grid.setColumnStretch(number, 1)
            add_layout(column, grid)
        column.addStretch()
        name_scroll_bars(inside)
        replace_inside(self.area, inside)
        self.refuse("")
        first = next((button for button in self.buttons if button.choice.source == chosen), self.buttons[0])
        for button in self.buttons:  # Tab focuses the chosen one, arrow keys the others
            button.setFocusPolicy(Qt.FocusPolicy.StrongFocus if button is first else Qt.FocusPolicy.ClickFocus)
        first.setChecked(True)
        QTimer.singleShot(0, first, lambda: self.area.ensureWidgetVisible(first))  # after it was laid out

    def _show_focused_card(self, button: _TemplateButton, by_mouse: bool) -> None:
        """Show the card that has keyboard focus. A mouse click leaves the focus in the form."""
        if by_mouse:
            (last_focused(self.card) or self.card.questions.title).setFocus()
        else:
            self.area.ensureWidgetVisible(button)

    def refuse(self, sentence: str) -> None:
        self.refusal.setText(capitalised(sentence))
        self.refusal.setVisible(bool(sentence))

    def _open_file(self) -> None:
        if chosen := choose_protocol(self, "Copy a study"):
            self.copy_asked.emit(chosen)

    def _show_choice(self) -> None:
        chosen = self._chosen_template()
        if chosen is not None:
            self.refuse("")
            self.card.show_choice(chosen)

    def _chosen_template(self) -> TemplateChoice | None:
        return next((button.choice for button in self.buttons if button.isChecked()), None)

    def _ask_to_begin(self) -> None:
        chosen, answers = self._chosen_template(), self.card.questions.answers()
        if isinstance(answers, str):
            self.refuse(f"{answers}.")
        elif chosen is not None:
            self.begin_asked.emit(chosen.source, self.card.questions.short_name(), answers)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        can_begin = isinstance(self.focusWidget(), Check | _TemplateButton)
        if event.key() in {Qt.Key.Key_Return, Qt.Key.Key_Enter} and can_begin:
            self._ask_to_begin()
        elif event.key() == Qt.Key.Key_Escape:
            self.given_up.emit()
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        narrow = self.width() < NARROW_BELOW
        self.card.setFixedWidth(NARROW_CARD_PX if narrow else CARD_PX)
        if self._choices and (event.oldSize().width() < NARROW_BELOW) != narrow:
            chosen = self._chosen_template()
            self.show_choices(self._choices, "" if chosen is None else chosen.source)
