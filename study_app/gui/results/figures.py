"""The content of the results page as one immutable value, and its figures."""

import html
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Literal, NamedTuple, TypeAlias

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QMarginsF, QPointF, QRectF, QSize, QSizeF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QGuiApplication,
    QImage,
    QImageWriter,
    QMouseEvent,
    QPageSize,
    QPainter,
    QPaintEvent,
    QPdfWriter,
    QResizeEvent,
)
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QScrollArea, QSizePolicy, QWidget

from study_app.analysis.worker_messages import FigureDrawn, Progress, StudyAt
from study_app.errors import StoreError
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.gui.theme.theme import FAMILIES, SHADOW, Theme, font
from study_app.gui.theme.themed import Coloured, remove_widget
from study_app.gui.widgets.accessible import plain_tip
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.boxes import STRETCH, add_layout, add_parts, hbox, vbox
from study_app.gui.widgets.cards import Bar, Card, Chip
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Elided, label
from study_app.number_text import counted
from study_app.protocol.participants import EACH_GROUP
from study_app.store.exclusions import Exclusion
from study_app.store.files import write_file

_NAMED: int = 5
"""The maximum number of sessions outside the figures that are all named."""

_Remedy: TypeAlias = Literal["again", "home", "read", "stop"]
"""The action of a button: refresh, go to the home page, continue reading, or stop."""

_NOTHING: Mapping[tuple[str, int], tuple[tuple[int, str], ...]] = MappingProxyType({})


Kind: TypeAlias = Literal["", "simulated", "pilot"]


def kind_of(study: StudyAt) -> Kind:
    """Return "pilot" or "simulated" for a study without participants' data, or ""."""
    return "pilot" if study.pilot else "simulated" if study.simulated else ""


def unblinding_text(reveal: Mapping[str, str]) -> str:
    """Return who opened the key, when and why: "Unblinded 19 Nov by AK: collection closed"."""
    at = time_of(reveal.get("at"))
    day = "" if at is None else f" {at.day} {at:%b}"
    return f"Unblinded{day} by {reveal.get('by', 'unknown')}: {reveal.get('reason', 'no reason given')}"


def exclusion_text(exclusion: Exclusion) -> str:
    """Return the subject of an exclusion: "P003, session 2, trial 4"."""
    name = exclusion.participant if exclusion.session == 1 else f"{exclusion.participant}, session {exclusion.session}"
    return name if exclusion.trial is None else f"{name}, trial {exclusion.trial}"


def time_of(text: object) -> datetime | None:
    """Return a time that was read from a file, or None if it is invalid, since the file may have been edited."""
    try:
        return datetime.fromisoformat(str(text))
    except ValueError:
        return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """The reason why there are no figures, with the text and action of a button."""

    title: str
    sentence: str
    button: str
    remedy: _Remedy


@dataclass(frozen=True, slots=True, kw_only=True)
class ResultsView:
    """The content of the window.

    ``trials`` maps sessions (participant, number) to their main trials with labels. ``colours`` maps roles of the theme
    to the print colours that they replace. ``sealed`` is None while unknown, and ``opened`` describes how the key was
    opened. ``rules`` are sentences about the planned exclusion rules. ``listed`` tells whether the study's sessions
    have been read. ``drawing`` is the activity before all figures are drawn, ``testing`` the one after; ``untested``
    means that the latter was stopped. ``groups`` are the groups by which figures can be split; ``split`` is the
    displayed group, `EACH_GROUP` if all are compared, or "".
    """

    studies: tuple[StudyAt, ...] = ()
    chosen: Path | None = None
    sessions: tuple[SessionFacts, ...] = ()
    listed: bool = False
    sealed: bool | None = None
    opened: str = ""
    left_out: tuple[Exclusion, ...] = ()
    proposed: tuple[Exclusion, ...] = ()
    rules: tuple[str, ...] = ()
    exclusions_file: Path | None = None
    trials: Mapping[tuple[str, int], tuple[tuple[int, str], ...]] = field(default_factory=lambda: _NOTHING)
    doubts: tuple[str, ...] = ()
    figures: tuple[FigureDrawn, ...] = ()
    colours: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))
    drawing: Progress | None = None
    testing: Progress | None = None
    untested: bool = False
    trouble: Trouble | None = None
    groups: tuple[str, ...] = ()
    split: str = ""

    @property
    def shown(self) -> list[FigureDrawn]:
        """The figures of the split in their order; a figure that cannot compare groups is shown for each group."""
        figures = [figure for figure in self.figures if figure.split == self.split]
        if self.split == EACH_GROUP:
            compared = {figure.name for figure in figures}
            figures += [figure for figure in self.figures if figure.split and figure.name not in compared]
        places = {figure.name: place for place, figure in enumerate(self.figures) if not figure.split}
        return sorted(figures, key=lambda figure: places.get(figure.name, len(places)))

    @property
    def kind(self) -> Kind:
        return next((kind_of(study) for study in self.studies if study.folder == self.chosen), "")

    @property
    def without_sessions(self) -> str:
        if self.listed:
            return "No sessions."
        return "" if self.trouble is not None else "Reading the sessions…"

    @property
    def can_be_written(self) -> bool:
        return self.chosen is not None and bool(self.sessions)


def figure_counts(sessions: Sequence[SessionFacts]) -> tuple[str, str]:
    """Return sentences about the number of sessions in the figures, and why others are not; "" without sessions."""
    counted_sessions = [session for session in sessions if session.is_counted]
    head = f"{len(counted_sessions)} of {counted(len(sessions), 'session')} in the figures"
    if not sessions:
        return "", ""
    excluded = [session.name for session in sessions if session.excluded is not None]
    incomplete = [session.name for session in sessions if session.excluded is None and not session.is_counted]
    parts = [_names_with_verb(incomplete, "not complete"), _names_with_verb(excluded, "excluded")]
    line = "; ".join(filter(None, parts))
    return head, f"{line}." if line else ""


def _names_with_verb(names: Sequence[str], what: str) -> str:
    """Return "P007 is excluded" or "P007, P009 and 12 others are excluded"; "" without names."""
    if not names:
        return ""
    if len(names) > _NAMED:
        return f"{', '.join(names[: _NAMED - 1])} and {len(names) - _NAMED + 1} others are {what}"
    return f"{', '.join(names)} {'is' if len(names) == 1 else 'are'} {what}"


_LETTERS = re.compile(rb"(<text.*?</text>)", re.DOTALL)
_FAMILY = re.compile(rb"font-family: [^;\"]*")
_SIZE = re.compile(rb'viewBox="0 0 ([0-9.]+) ([0-9.]+)"')
_WHITE = b"#ffffff"
BAND_LIGHT, BAND_DARK = 0.22, 0.34
SECOND_LIGHT, SECOND_DARK = "#b35600", "#f0955a"


def themed_svg(svg: bytes, colours: Mapping[str, str], theme: Theme) -> bytes:
    """Return a figure with its print colours (role → ``#rrggbb``) replaced by those of ``theme``.

    White is the paper, except in letters, which are on coloured bars. The levels of agreement keep their colours, but
    get an edge in a dark theme.
    """
    letters = {colour.lower().encode(): _role_colour(theme, role).encode() for role, colour in colours.items()}
    edge = theme.ctl if theme.dark else theme.surface
    paper = {**letters, b"stroke: " + _WHITE: f"stroke: {edge}".encode(), _WHITE: theme.surface.encode()}
    parts = _LETTERS.split(svg)  # every second part is a text
    accent = colours.get("accent", "#").lower().encode()
    parts[::2] = [_replace_colours(part, paper, accent) for part in parts[::2]]
    parts[1::2] = [_replace_colours(part, letters, accent) for part in parts[1::2]]
    return b"".join(parts)


def _role_colour(theme: Theme, role: str) -> str:
    """Return the colour of a role in figures; "band" is a pale accent on which lines are visible."""
    if role == "second":
        return SECOND_DARK if theme.dark else SECOND_LIGHT
    if role != "band":
        return str(getattr(theme, role))
    paper, accent = QColor(theme.surface), QColor(theme.accent)
    share = BAND_DARK if theme.dark else BAND_LIGHT
    mixed = [
        round(share * channel(accent) + (1 - share) * channel(paper))
        for channel in (QColor.red, QColor.green, QColor.blue)
    ]
    return QColor(*mixed).name()


def _replace_colours(part: bytes, by: Mapping[bytes, bytes], accent: bytes) -> bytes:
    """Replace colours, except a translucent accent, which is the background of letters."""
    shade = b"fill: " + re.escape(accent) + rb"; (?:fill-)?opacity"
    pattern = re.compile(b"|".join([shade, *map(re.escape, sorted(by, key=len, reverse=True))]))
    return pattern.sub(lambda match: by.get(match[0], match[0]), part)


def _renderer(svg: bytes) -> QSvgRenderer:
    """Return a renderer of an SVG with the first font family only, since Qt does not support lists of families."""
    return QSvgRenderer(_FAMILY.sub(b"font-family: " + FAMILIES[0].encode(), svg))


def drawn_svg(svg: bytes, size: QSize, ratio: float) -> QImage:
    """Return an SVG as an image of ``size`` logical px for a screen with device pixel ratio ``ratio``."""
    renderer = _renderer(svg)
    image = QImage(round(size.width() * ratio), round(size.height() * ratio), QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    renderer.render(painter, QRectF(image.rect()))
    painter.end()
    image.setDevicePixelRatio(ratio)
    return image


_PERSON = re.compile(rb'<g id="person-([^"]+)">(.*?)</g>', re.DOTALL)
_MARK = re.compile(rb'<use [^>]*?x="([0-9.]+)" y="([0-9.]+)"')
_REACH_PX = 8


class _Mark(NamedTuple):
    """A participant's point in a figure, at a position in the units of the SVG."""

    participant: str
    at: QPointF


def _find_marks(svg: bytes) -> list[_Mark]:
    """Return the points of all participants in a figure of `analysis.figures`."""
    return [
        _Mark(html.unescape(person.decode()), QPointF(float(x), float(y)))
        for person, inside in _PERSON.findall(svg)
        for x, y in _MARK.findall(inside)
    ]


class _FigureView(Coloured, QWidget):
    """A widget that shows a figure with its aspect ratio.

    ``person_asked`` carries the participant whose point was clicked.
    """

    person_asked = Signal(str)

    def __init__(self, figure: FigureDrawn, colours: Mapping[str, str]) -> None:
        super().__init__()
        self._figure, self._colours = figure, colours
        self._image = QImage()
        self._requested: tuple[object, ...] = ()
        self._drawing = Background(self)
        self._drawing.done.connect(self._show_image)
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        policy.setHeightForWidth(True)
        self.setSizePolicy(policy)
        self.show_figure(figure, colours)

    @property
    def is_settled(self) -> bool:
        return not self._drawing.busy and not self._image.isNull()

    def show_figure(self, figure: FigureDrawn, colours: Mapping[str, str]) -> None:
        """Draw another figure; the previous one stays visible until then."""
        self._figure, self._colours = figure, colours
        size = _SIZE.search(figure.svg)
        self.width_pt = float(size[1]) if size else 516.0
        self._proportion = float(size[2]) / float(size[1]) if size else 0.5
        self._marks = _find_marks(figure.svg)
        self.setMouseTracking(bool(self._marks))
        self.setAccessibleName(figure.title)
        self.setAccessibleDescription(figure.caption)
        self.updateGeometry()
        self._request_image()

    def apply_theme(self, theme: Theme) -> None:
        self._request_image()

    def heightForWidth(self, width: int) -> int:
        return round(width * self._proportion)

    def sizeHint(self) -> QSize:
        return QSize(900, self.heightForWidth(900))

    def minimumSizeHint(self) -> QSize:
        return QSize(320, self.heightForWidth(320))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._request_image()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        person = self._person_at(event.position())
        self.setCursor(Qt.CursorShape.PointingHandCursor if person else Qt.CursorShape.ArrowCursor)
        self.setToolTip(plain_tip(f"{person}: click to open the session" if person else ""))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        person = self._person_at(event.position())
        if person and event.button() == Qt.MouseButton.LeftButton:
            self.person_asked.emit(person)

    def _person_at(self, position: QPointF) -> str:
        """Return the participant whose point is nearest to a position in the widget, or "" if none is near."""
        scale = self.width() / self.width_pt
        near = [((mark.at * scale - position).manhattanLength(), mark.participant) for mark in self._marks]
        return min((pair for pair in near if pair[0] <= _REACH_PX), default=(0.0, ""))[1]

    def _request_image(self) -> None:
        """Request an image for the current size and theme, unless it was requested before."""
        if self.width() < 2 or self.height() < 2 or not self.testAttribute(Qt.WidgetAttribute.WA_Resized):
            return
        size, ratio = self.size(), self.devicePixelRatioF()
        requested = (self._figure, self.theme.name, size, ratio)
        if requested == self._requested:
            return
        self._requested = requested
        figure, colours, theme = self._figure, self._colours, self.theme
        self._drawing.run(lambda: drawn_svg(themed_svg(figure.svg, colours, theme), size, ratio))

    def _show_image(self, image: QImage) -> None:
        self._image = image
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self._image.isNull():
            self._request_image()
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        if self.devicePixelRatioF() != self._image.devicePixelRatioF():
            self._request_image()
        painter.drawImage(QRectF(self.rect()), self._image)


_GAP = 12
_PADDING = 14
_FRAME_PX = 2 * (_PADDING + SHADOW)
_AT_ONCE = 2
"""The number of figures that should be visible without scrolling, as long as they are legible."""
LEAST_WIDTH, MOST_WIDTH = 830, 1240


_VERDICTS: Mapping[str, str] = {"significant": "ok", "equivalent": "ok", "significant, exploratory": "warn"}
_FORMS = "PDF (*.pdf);;SVG (*.svg);;PNG (*.png)"
_MOST_SCALE = 2.5
"""The maximum scale of a figure in the window [px per pt]."""
_PNG_SCALE = 300 / 72
"""The scale of a figure in a PNG [px per pt]."""


def _save_figure(figure: FigureDrawn, path: Path) -> None:
    """Write a figure as PDF, SVG or PNG, depending on the suffix of ``path``; raise StoreError if that fails."""
    renderer = _renderer(figure.svg)
    size = renderer.defaultSize()
    if (suffix := path.suffix.lower()) == ".svg":
        content = figure.svg
    else:
        buffer = QBuffer()
        buffer.open(QIODevice.OpenModeFlag.WriteOnly)
        if suffix == ".pdf":
            writer = QPdfWriter(buffer)
            writer.setTitle(figure.title)
            writer.setPageSize(QPageSize(QSizeF(size), QPageSize.Unit.Point))
            writer.setPageMargins(QMarginsF())
            painter = QPainter(writer)
            renderer.render(painter)
            painter.end()
        else:
            QImageWriter(buffer, QByteArray(b"png")).write(drawn_svg(figure.svg, size, _PNG_SCALE))
        content = bytes(buffer.data().data())
    write_file(path, content)


class FigureCard(Card):
    """A card with a question, its answer and figure, or the reason why the figure is missing.

    The caption is shown on request. Figure and numbers can be copied, and the figure can be saved. ``failed`` carries
    the reason if saving failed, ``person_asked`` the participant whose point was clicked.
    """

    failed = Signal(str)
    person_asked = Signal(str)

    def __init__(self, figure: FigureDrawn, colours: Mapping[str, str]) -> None:
        super().__init__(padding=_PADDING, gap=8)
        self.figure = figure
        self.drawing: _FigureView | None = None
        self.question = label("", "card", wraps=True)
        self.answer = label("", "body", wraps=True)
        self.answer.setTextFormat(Qt.TextFormat.RichText)
        self.answer.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        self._verdict = hbox(spacing=0, margins=0)
        self._chip: Chip | None = None
        self.dialog: QFileDialog | None = None
        self.caption = label("", "label", "text2", wraps=True)
        self.caption.setContentsMargins(0, 0, 120, 4)
        self.caption.setTextInteractionFlags(
            Qt.TextInteractionFlag.TextSelectableByMouse | Qt.TextInteractionFlag.TextSelectableByKeyboard
        )
        self.caption.hide()
        self.more = ActionButton("info", "Caption", role="plain", height=30)
        self.more.setCheckable(True)
        self.more.toggled.connect(self.caption.setVisible)
        self.copy_figure = ActionButton("", "Copy figure", role="plain", height=30)
        self.copy_figure.clicked.connect(self._copy_figure)
        self.copy_numbers = ActionButton("", "Copy numbers", role="plain", height=30)
        self.copy_numbers.clicked.connect(lambda: QGuiApplication.clipboard().setText(self.figure.numbers))
        self.save = ActionButton("download", "Save as…", role="plain", height=30)
        self.save.clicked.connect(self._ask_for_path)
        self.buttons = (self.more, self.copy_figure, self.copy_numbers, self.save)
        for button in self.buttons:
            button.setFont(font("label"))
        self._title = label("", "card")
        self._place = QHBoxLayout()
        foot = hbox(STRETCH, *self.buttons, spacing=4, margins=0)
        add_parts(self.column, hbox((self.question, 1), self._verdict), self.answer, self._title, self._place)
        add_parts(self.column, self.caption, foot)
        self.show_figure(figure, colours)

    def show_figure(self, figure: FigureDrawn, colours: Mapping[str, str]) -> None:
        self.figure = figure
        self.caption.setText(figure.caption)
        has_figure = bool(figure.svg)
        self._title.setText(figure.title)
        self._title.setVisible(not has_figure and not figure.question)  # figures contain their title
        self.question.setText(figure.question)
        self.question.setVisible(bool(figure.question))
        self.answer.setText(re.sub(r"\bd_z\b", "d<sub>z</sub>", html.escape(figure.answer, quote=False)))
        self.answer.setVisible(bool(figure.answer))
        self._show_verdict(figure.verdict)
        for button in self.buttons:
            button.setVisible(has_figure)
            button.setAccessibleName(f"{button.text().removesuffix('…')}: {figure.title}")
        self.copy_numbers.setVisible(bool(figure.numbers))
        self.caption.setVisible(not has_figure or self.more.isChecked())
        if self.drawing is not None and has_figure:
            self.drawing.show_figure(figure, colours)
        elif self.drawing is not None:
            remove_widget(self.drawing)
            self.drawing = None
        elif has_figure:
            self.drawing = _FigureView(figure, colours)
            self.drawing.person_asked.connect(self.person_asked)
            self._place.addWidget(self.drawing, 0, Qt.AlignmentFlag.AlignHCenter)
            self.more.raise_()

    def fit_width(self, width: int) -> None:
        """Set the figure's width, limited by its maximum scale."""
        if self.drawing is not None:
            width = min(width, round(_MOST_SCALE * self.drawing.width_pt))
        size = QSize(width, 0 if self.drawing is None else self.drawing.heightForWidth(width))
        if self.drawing is not None and self.drawing.maximumSize() != size:
            self.drawing.setFixedSize(size)

    def _show_verdict(self, verdict: str) -> None:
        if self._chip is not None:
            remove_widget(self._chip)
            self._chip = None
        if verdict:
            self._chip = Chip(_VERDICTS.get(verdict, "neutral"), "info", verdict)  # type: ignore[arg-type]
            self._verdict.addWidget(self._chip)

    def _copy_figure(self) -> None:
        """Copy the figure to the clipboard as an image."""
        size = _renderer(self.figure.svg).defaultSize()
        QGuiApplication.clipboard().setImage(drawn_svg(self.figure.svg, size, _PNG_SCALE))

    def _ask_for_path(self) -> None:
        self.dialog = dialog = QFileDialog(self, f"Save {self.figure.title}", self.figure.name, _FORMS)
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.selectFile(self.figure.name)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.fileSelected.connect(lambda path: self.save_to(Path(path), dialog.selectedNameFilter()))
        dialog.open()

    def save_to(self, path: Path, form: str = "PDF") -> None:
        """Save the figure; a path without a known suffix gets that of ``form``."""
        if path.suffix.lower() not in (".pdf", ".svg", ".png"):
            path = path.with_name(f"{path.name}.{form[:3].lower()}")
        try:
            _save_figure(self.figure, path)
        except StoreError as error:
            self.failed.emit(f"{error}.")


class _WorkLine(Card):
    """A line with the current activity, its progress, and a button to stop or continue it."""

    def __init__(self) -> None:
        super().__init__(padding=14, gap=0)
        self.words = Elided("label", "text2")
        self.bar = Bar()
        self.stop = ActionButton("", "Stop", height=36)
        self.again = ActionButton("", "Go on", height=36)
        row = hbox((self.words, 1), (self.bar, 1), self.stop, self.again, spacing=16)
        add_layout(self.column, row)

    def show_progress(self, progress: Progress | None, *, untested: bool) -> None:
        """Show the progress, or if ``untested``, that the computation was stopped and what is missing."""
        self.setVisible(progress is not None or untested)
        self.bar.setVisible(progress is not None)
        self.stop.setVisible(progress is not None and progress.stops)
        self.again.setVisible(progress is None)
        if progress is not None:
            self.words.show_text(f"{progress.what[:1].upper()}{progress.what[1:]}…")
            self.bar.show_share(progress.share)
        elif untested:
            self.words.show_text("The computation was stopped, so test results and some figures are missing.")


class _TroubleCard(Card):
    """A card with the reason why there are no figures, and a button; ``asked`` carries its action."""

    asked = Signal(str)

    def __init__(self) -> None:
        super().__init__(padding=28, gap=12)
        self._remedy: _Remedy = "again"
        self.title = label("", "card")
        self.sentence = label("", "body", "text2", wraps=True)
        self.sentence.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.bar = Bar()
        self.bar.setMaximumWidth(420)
        self.button = ActionButton("", "", height=40)
        self.button.clicked.connect(lambda: self.asked.emit(self._remedy))
        row = hbox(self.button, STRETCH)
        add_parts(self.column, self.title, self.sentence, self.bar, row)
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum)

    def show_trouble(self, trouble: Trouble) -> None:
        self.title.setText(trouble.title)
        self.sentence.setText(trouble.sentence)
        self.sentence.setVisible(bool(trouble.sentence))
        self.button.show_action("", trouble.button)
        self.button.show()
        self.bar.hide()
        self._remedy = trouble.remedy

    def show_progress(self, progress: Progress) -> None:
        self.show_trouble(
            Trouble(title=f"{progress.what[:1].upper()}{progress.what[1:]}…", sentence="", button="Stop", remedy="stop")
        )
        self.button.setVisible(progress.stops)
        self.bar.setVisible(True)
        self.bar.show_share(progress.share)


class FiguresPanel(QScrollArea):
    """The scroll area with the cards of the figures or, if there are none, the activity or the reason.

    ``asked`` carries a button's action, ``failed`` the reason why a figure was not saved, ``person_asked`` the
    participant whose point was clicked.
    """

    asked = Signal(str)
    failed = Signal(str)
    person_asked = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.cards: list[FigureCard] = []
        self.trouble = _TroubleCard()
        self.work = _WorkLine()
        self.trouble.asked.connect(self.asked)
        self.work.stop.clicked.connect(lambda: self.asked.emit("stop"))
        self.work.again.clicked.connect(lambda: self.asked.emit("read"))
        self._inside = QWidget()
        parts = (self.work, self.trouble, STRETCH)  # the activity is above the figures, where it is visible
        self._column = vbox(*parts, spacing=_GAP - 2 * SHADOW, margins=0, parent=self._inside)
        self.trouble.hide()
        self.work.hide()
        self.setWidgetResizable(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setWidget(self._inside)
        self._whole = False

    def show_view(self, view: ResultsView) -> None:
        """Show the figures; a card is kept when its figure is drawn again."""
        shown = view.shown
        if [card.figure.key for card in self.cards] != [figure.key for figure in shown]:
            self._order_cards(shown, view.colours)
        for card, figure in zip(self.cards, shown, strict=True):
            if card.figure is not figure:
                card.show_figure(figure, view.colours)
        if view.trouble is not None:
            self.trouble.show_trouble(view.trouble)
        elif view.drawing is not None and not shown:
            self.trouble.show_progress(view.drawing)
        self.trouble.setVisible(view.trouble is not None or (view.drawing is not None and not shown))
        self.work.show_progress(view.testing or (view.drawing if shown else None), untested=view.untested)
        self.fit_width()

    def _order_cards(self, shown: Sequence[FigureDrawn], colours: Mapping[str, str]) -> None:
        """Create the cards in the order of the figures; cards of figures that exist are kept."""
        kept = {card.figure.key: card for card in self.cards}
        self.cards = []
        for index, figure in enumerate(shown):
            card = kept.pop(figure.key, None)
            if card is None:
                card = FigureCard(figure, colours)
                card.failed.connect(self.failed)
                card.person_asked.connect(self.person_asked)
            self._column.insertWidget(1 + index, card)
            self.cards.append(card)
        for card in kept.values():
            remove_widget(card)
        for before, after in pairwise(button for card in self.cards for button in card.buttons):
            QWidget.setTabOrder(before, after)

    def set_whole(self, whole: bool) -> None:
        """Make the panel as high as all figures if ``whole``, for a page that scrolls as a whole."""
        self._whole = whole
        off = Qt.ScrollBarPolicy.ScrollBarAlwaysOff
        self.setVerticalScrollBarPolicy(off if whole else Qt.ScrollBarPolicy.ScrollBarAsNeeded)
        self.fit_width()

    def fit_width(self) -> None:
        """Set the width of the figures, reduced if the first `_AT_ONCE` are then visible without scrolling."""
        bar = (
            0 if self._whole else self.verticalScrollBar().sizeHint().width()
        )  # reserved, so that figures do not flicker
        width = min(self.width() - bar - _FRAME_PX, MOST_WIDTH)
        first = [card.drawing for card in self.cards if card.drawing is not None][:_AT_ONCE]
        if first and not self._whole:
            heights = sum(drawing.heightForWidth(1000) for drawing in first) / 1000
            frames = len(first) * (_FRAME_PX - 4) + (len(first) - 1) * self._column.spacing()
            width = min(width, max(int((self.height() - frames) / heights), LEAST_WIDTH))
        for card in self.cards:
            card.fit_width(max(width, 320))
        self.setMinimumHeight(self._inside.sizeHint().height() if self._whole else 0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.fit_width()
