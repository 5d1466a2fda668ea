"""A window as text, for golden files: what it paints, what it tells a screen reader, what each control does.

``python -m pytest tests/gui/test_transcripts.py --regenerate`` writes the files anew: read the difference.
"""

import re
from base64 import b64decode
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from PySide6.QtCore import (
    QAbstractAnimation,
    QAbstractItemModel,
    QAbstractListModel,
    QBuffer,
    QByteArray,
    QEvent,
    QMetaMethod,
    QPoint,
    QPointF,
    QRectF,
    QSizeF,
    Qt,
    QTimer,
    qVersion,
)
from PySide6.QtGui import QAccessible, QAction, QEnterEvent, QImage, QPainter, QShortcut, QWheelEvent
from PySide6.QtSvg import QSvgGenerator
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractItemView,
    QAbstractSlider,
    QAbstractSpinBox,
    QApplication,
    QComboBox,
    QFileDialog,
    QLineEdit,
    QPlainTextEdit,
    QScrollBar,
    QWidget,
)

from study_app.gui.widgets.main_view import Place
from tests import golden
from tests.golden_values import changed

Actions = Mapping[str, Callable[[Any], object]]
"""What brings a window into each of its states, by the state's name."""
GOLDEN = Path(__file__).parent / "golden"
QT_VERSION = GOLDEN / "qt_version"
CONTROLS = (QAbstractButton, QAbstractItemView, QAbstractSlider, QAbstractSpinBox, QComboBox, QLineEdit, QPlainTextEdit)
STATES = ("disabled", "checked", "readOnly", "expanded", "selected", "focused", "invisible", "offscreen")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
STILL = "matrix(1,0,0,1,"
"""How a transform begins that only moves."""
SVG = "{http://www.w3.org/2000/svg}"
PLACES = ("d", "points", "x", "y", "width", "height", "x1", "x2", "y1", "y2", "cx", "cy", "r", "rx", "ry")
HREF = "{http://www.w3.org/1999/xlink}href"
SMALL_PX = 4096
ALIKE = 4
"""Most controls of one kind in parts of one kind, such as cards of studies, that are used."""
LONGEST = 12
"""Most numbers of a shape that are listed; of a longer one the count, the bounds and the sum are."""


def painted(window: QWidget) -> list[str]:
    """Return a line for each text and shape that the window paints, with colours and whole pixels."""
    content = QByteArray()
    buffer = QBuffer(content)
    buffer.open(QBuffer.OpenModeFlag.WriteOnly)
    generator = QSvgGenerator()
    generator.setOutputDevice(buffer)
    generator.setSize(window.size())
    generator.setViewBox(window.rect())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(QPainter, "drawImage", _draw_small)
        window.render(generator)
    return list(_shapes(ElementTree.fromstring(bytes(content.data()))))  # noqa: S314


def _draw_small(painter: QPainter, *arguments: Any, draw: Any = QPainter.drawImage) -> None:
    """Draw a large image with few pixels: the generator encodes each image, of which only colours are compared."""
    *at, image = arguments
    if image.width() * image.height() <= SMALL_PX:
        draw(painter, *arguments)
        return
    corner = at[0] if len(at) == 1 else QPointF(*at)
    target = corner if isinstance(corner, QRectF) else QRectF(corner, QSizeF(image.deviceIndependentSize()))
    small = image.scaled(8, 8, Qt.AspectRatioMode.IgnoreAspectRatio, Qt.TransformationMode.SmoothTransformation)
    small.setDevicePixelRatio(1.0)
    draw(painter, target, small)


@cache
def _colours_of(image: str) -> str:
    """Return red, green, blue and opacity (0 to 7) of the four quarters of an encoded image."""
    decoded = QImage.fromData(b64decode(image.partition(",")[2]))
    few = decoded.scaled(2, 2, Qt.AspectRatioMode.IgnoreAspectRatio, Qt.TransformationMode.SmoothTransformation)
    pixels = [few.pixelColor(x, y).getRgb() for y in range(2) for x in range(2)]
    return " ".join("".join(str(part // 32) for part in pixel) for pixel in pixels)  # type: ignore[attr-defined]


@cache
def _ink(name: str, value: str, opacity: str, width: str, dashes: str) -> str:
    """Return a colour with its opacity and, of a stroke, its width and dashes, or "" where nothing is painted."""
    if value == "none" or float(opacity) == 0:
        return ""
    said = f"{name}={value}" + (f"/{float(opacity):.2g}" if float(opacity) < 1 else "")
    if name == "stroke":
        said += (f" {float(width):.2g} px" if width != "1" else "") + (f" dashes {dashes}" if dashes != "none" else "")
    return said


def _inks(group: ElementTree.Element, gradients: Mapping[str, str]) -> list[str]:
    """Return what a group fills and strokes its shapes with."""
    line = group.get("stroke-width", "1"), group.get("stroke-dasharray", "none")
    values = ((name, group.get(name, "none"), group.get(f"{name}-opacity", "1")) for name in ("fill", "stroke"))
    return [ink for name, value, opacity in values if (ink := _ink(name, gradients.get(value, value), opacity, *line))]


def _shapes(root: ElementTree.Element) -> Iterator[str]:
    """Yield the texts, and between them the shapes of one place together: a frame is a dozen lines and curves."""
    gradients = {
        f"url(#{one.get('id')})": "-".join(stop.get("stop-color", "") for stop in one)
        for kind in ("linearGradient", "radialGradient")
        for one in root.iter(f"{SVG}{kind}")
    }
    drawn = (
        (shape.tag.removeprefix(SVG), group, shape)
        for group in root.iter(f"{SVG}g")
        for shape in group
        if shape.tag != f"{SVG}g"
    )
    for (at, is_text), shapes in groupby(drawn, lambda one: (one[1].get("transform", ""), one[0] == "text")):
        looks: list[str] = []
        corner = _rounded(at.removeprefix(STILL))
        places = ""
        for kind, group, shape in shapes:
            colours = _inks(group, gradients)
            if kind == "image":
                colours = [_colours_of(shape.get(HREF, ""))]
            elif not colours:
                continue
            looks.append(" ".join([kind, *colours]))
            place = " ".join(value for name, value in shape.items() if name in PLACES)
            if is_text:
                size = f"{group.get('font-size')} {group.get('font-weight')}"
                yield f"{looks[-1]} {size} @{corner} {_rounded(place)} {(shape.text or '').strip()}"
            places += f" {place}"
        if looks and not is_text:
            yield f"{', '.join(dict.fromkeys(looks))} @{corner} {_rounded(places)}"


@cache
def _rounded(text: str) -> str:
    numbers = [round(float(each)) for each in NUMBER.findall(text)]
    if len(numbers) <= LONGEST:
        return " ".join(map(str, numbers))
    across, down = numbers[::2], numbers[1::2]
    return f"{len(numbers)}: {min(across)} {min(down)} {max(across)} {max(down)} {sum(numbers)}"


def told(window: QWidget) -> list[str]:
    """Return a line for each widget that has a name, a tip or a value: role, name, description, value and states."""
    lines = []
    for part in [window, *window.findChildren(QWidget)]:
        if not part.isVisible() or isinstance(part, QScrollBar):
            continue
        if (interface := QAccessible.queryAccessibleInterface(part)) is None:
            continue
        kinds = (QAccessible.Text.Name, QAccessible.Text.Description, QAccessible.Text.Value)
        words = [*(interface.text(kind) for kind in kinds), part.toolTip()]
        state = interface.state()
        on = [name for name in STATES if getattr(state, name)]
        if any(words):
            lines.append(" ".join([interface.role().name, *on, _told_once(words)]))
        if isinstance(part, QAbstractItemView) and part.model() is not None:
            lines += _cells(part.model())
    return lines


def _told_once(words: list[str]) -> str:
    """Return texts beside each other, "=" in place of one that stands before."""
    shown = ["=" if word and word in words[:at] else word for at, word in enumerate(words)]
    return " | ".join(shown).replace("\n", " / ").rstrip(" |")


def _cells(model: QAbstractItemModel) -> Iterator[str]:
    """Yield a line for each row of a table or list: of its cells what is shown, told and in the tip."""
    roles = (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.AccessibleTextRole, Qt.ItemDataRole.ToolTipRole)
    across = range(1 if isinstance(model, QAbstractListModel) else model.columnCount())
    yield "columns " + " | ".join(str(model.headerData(at, Qt.Orientation.Horizontal)) for at in across)
    for row in range(model.rowCount()):
        cells = (dict.fromkeys(str(model.index(row, at).data(role) or "") for role in roles) for at in across)
        yield "row " + " | ".join(" / ".join(cell).replace("\n", " / ") for cell in cells)


def lines_of(window: QWidget) -> list[str]:
    """Return what a window tells and paints once its animations have ended."""
    for animation in window.findChildren(QAbstractAnimation):
        animation.setCurrentTime(animation.totalDuration())
    return [*told(window), *painted(window)]


def listen(window: QWidget) -> list[str]:
    """Return a list that gets each signal that a window's, or its places', own classes declare, with its arguments."""
    heard: list[str] = []
    for part in [window, *window.findChildren(Place)]:
        meta = part.metaObject()
        for number in range(meta.methodCount()):
            method = meta.method(number)
            name = bytes(method.name().data()).decode()
            declared = any(name in vars(kind) for kind in type(part).__mro__ if kind.__module__.startswith("study_app"))
            if method.methodType() == QMetaMethod.MethodType.Signal and declared:

                def hear(*values: Any, name: str = name) -> None:
                    said = ", ".join(repr(value)[:200] for value in values)
                    heard.append(f"{name}({re.sub(r'[( ](?:at )?0x[0-9a-f]+[)]?', '', said)})")

                getattr(part, name).connect(hear)
    return heard


def _name(control: QWidget) -> str:
    interface = QAccessible.queryAccessibleInterface(control)
    return interface.text(QAccessible.Text.Name) if interface else ""


def use(control: QWidget) -> None:
    """Use a control as a person would: turn the wheel over it, click, choose the next entry, step, drag, type."""
    middle = QPointF(control.rect().center())
    control.clearFocus()
    if isinstance(control, QAbstractSlider | QAbstractSpinBox | QComboBox):
        no = Qt.MouseButton.NoButton, Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False
        turned = QWheelEvent(middle, control.mapToGlobal(middle), QPoint(), QPoint(0, 120), *no)
        QApplication.sendEvent(control, turned)
    control.setFocus()
    match control:
        case QAbstractButton():
            QApplication.sendEvent(control, QEnterEvent(QPointF(1, 1), QPointF(1, 1), QPointF(1, 1)))
            QTest.mouseClick(control, Qt.MouseButton.LeftButton)
        case QComboBox() | QAbstractItemView():
            QTest.keyClick(control, Qt.Key.Key_Down)
        case QAbstractSlider():
            for key in (Qt.Key.Key_Right, Qt.Key.Key_PageUp, Qt.Key.Key_Left):
                QTest.keyClick(control, key)
            start = QPoint(control.width() // 4, control.height() // 2)
            QTest.mousePress(control, Qt.MouseButton.LeftButton, pos=start)
            QTest.mouseMove(control, start + QPoint(control.width() // 3, 0))
            QTest.mouseRelease(control, Qt.MouseButton.LeftButton, pos=start + QPoint(control.width() // 3, 0))
        case QAbstractSpinBox():
            QTest.keyClick(control, Qt.Key.Key_Up)
        case QLineEdit() | QPlainTextEdit():
            QTest.keyClick(control, Qt.Key.Key_Up)
            QTest.keyClicks(control, "7")
            QTest.keyClick(control, Qt.Key.Key_Return)


def _close_dialogs(seen: list[str], kept: set[QWidget]) -> None:
    for other in QApplication.topLevelWidgets():
        if other.isVisible() and other not in kept:
            seen.append(f"opened {type(other).__name__} {other.windowTitle()!r}")
            if not isinstance(other, QFileDialog):
                other.activateWindow()
                for _ in range(300):
                    if QApplication.focusWindow() is other.windowHandle():
                        break
                    QTest.qWait(1)
                seen += lines_of(other)
            other.close()


class Recorder:
    """What actions on a window do, each compared with what was there before it."""

    def __init__(self, window: QWidget, settled: Callable[[], None]) -> None:
        self.window, self.base, self._settled = window, window.window(), settled
        self._kept = {one for one in QApplication.topLevelWidgets() if one.isVisible()}
        self.heard = listen(window)
        self.lines = lines_of(window)

    def _rest(self) -> None:
        """Let the window come to rest; it is painted for the comparison alone."""
        self.base.setUpdatesEnabled(False)
        self._settled()
        self.base.setUpdatesEnabled(True)

    def record(self, name: str, act: Callable[[], object]) -> Iterator[str]:
        """Yield the signals, the dialogs and the lines that change while and after ``act`` runs."""
        self.heard.clear()
        seen: list[str] = []
        blocked = QTimer(interval=200)
        blocked.timeout.connect(lambda: _close_dialogs(seen, self._kept))
        blocked.start()
        act()
        blocked.stop()
        self._rest()
        dialogs = len(seen)
        _close_dialogs(seen, self._kept)
        if len(seen) > dialogs:
            self._rest()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        if not self.base.isVisible():
            seen.append("closed")
        before, self.lines = self.lines, lines_of(self.window)
        yield f"== {name}"
        yield from self.heard
        yield from seen
        yield from changed(before, self.lines)


def steps(window: QWidget, settled: Callable[[], None]) -> Iterator[str]:
    """Yield what each control and then each shortcut does, after the order in which the Tab key reaches controls."""
    recorder = Recorder(window, settled)
    used: set[str | QWidget] = set()
    yield "== Tab"
    yield from _tab_order(window)
    alike: Counter[tuple[type, type]] = Counter()
    while (chosen := next(_unused(window, used), None)) is not None:
        used |= set(chosen)
        kinds = type(chosen[1]), type(chosen[1].parent())
        alike[kinds] += 1
        if alike[kinds] <= ALIKE:
            yield from recorder.record(chosen[0], lambda control=chosen[1]: use(control))
    for shortcut in window.findChildren(QShortcut):
        yield from recorder.record(shortcut.key().toString(), shortcut.activated.emit)
    for action in window.findChildren(QAction):
        for keys in action.shortcuts():
            yield from recorder.record(keys.toString(), action.trigger)
    yield from recorder.record("Esc", lambda: QTest.keyClick(recorder.base, Qt.Key.Key_Escape))


def _unused(window: QWidget, used: set[str | QWidget]) -> Iterator[tuple[str, QWidget]]:
    for one in window.findChildren(QWidget):
        if isinstance(one, CONTROLS) and is_usable(one) and one not in used:
            key = f"{type(one).__name__} {_name(one)!r}"
            if key not in used:
                yield key, one


def states(window: Any, shown: Actions, settled: Callable[[], None]) -> Iterator[str]:
    """Yield what a window tells and paints, then what changes with each of the states it is brought into in turn."""
    recorder = Recorder(window, settled)
    yield from recorder.lines
    for name, bring in shown.items():
        yield from recorder.record(name, lambda bring=bring: bring(window))


def story(
    window: QWidget, acts: Iterable[tuple[str, Callable[[], object]]], settled: Callable[[], None]
) -> Iterator[str]:
    """Yield what a window shows, then its signals and what it shows otherwise after each act in turn."""
    heard = listen(window)
    settled()
    before = told(window)
    yield from before
    for name, act in acts:
        heard.clear()
        act()
        settled()
        after = told(window)
        yield from [f"== {name}", *heard, *changed(before, after)]
        before = after


def part_of(window: Any, path: str) -> Any:
    """Return a part of a window by its attributes: "stop.fade_in"; also an element by its number or key."""
    for name in path.split("."):
        held = window[int(name)] if name.isdigit() else getattr(window, name, None)
        window = window[name] if held is None else held
    return window


def clicked(*paths: str) -> Callable[[Any], None]:
    """Return an action that clicks buttons."""

    def act(window: Any) -> None:
        for path in paths:
            QTest.mouseClick(part_of(window, path), Qt.MouseButton.LeftButton)

    return act


def typed(path: str, text: str) -> Callable[[Any], None]:
    """Return an action that types into a field and presses Enter."""

    def act(window: Any) -> None:
        field = part_of(window, path)
        field.setFocus()
        field.selectAll()
        QTest.keyClicks(field, text)
        QTest.keyClick(field, Qt.Key.Key_Return)

    return act


def in_turn(*acts: Callable[[Any], object]) -> Callable[[Any], None]:
    """Return an action of several, of which the last shows what is compared."""

    def act(window: Any) -> None:
        for one in acts:
            one(window)

    return act


def _tab_order(window: QWidget) -> Iterator[str]:
    part = window.nextInFocusChain()
    while part is not window and part is not None:
        inside = window.isAncestorOf(part) and part.isVisible() and part.isEnabled()
        if inside and part.focusPolicy() & Qt.FocusPolicy.TabFocus and part.focusProxy() is None:
            yield f"{type(part).__name__} {_name(part)!r}"
        part = part.nextInFocusChain()


def is_usable(control: QWidget) -> bool:
    return (
        control.isVisible()
        and control.isEnabled()
        and not isinstance(control, QScrollBar)
        and not isinstance(control.parent(), QAbstractSpinBox | QComboBox)
    )


def compare(name: str, lines: Iterable[str], config: pytest.Config) -> None:
    """Compare lines with the golden file of a window, unless that was recorded with another version of Qt."""
    version = qVersion().rpartition(".")[0]
    if config.getoption("regenerate"):
        QT_VERSION.write_text(f"{version}\n")
    if (recorded := QT_VERSION.read_text().strip()) != version:
        pytest.skip(f"recorded with Qt {recorded}, here is Qt {version}: styles paint otherwise")
    golden.compare((GOLDEN / re.sub(r"\W+", "_", name)).with_suffix(".txt"), lines, config)
