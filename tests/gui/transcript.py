"""A window as text for golden files: its screen-reader texts in each state, and the effect of each control.

``python -m pytest tests/gui/test_transcripts.py --regenerate`` writes the files anew: read the difference.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import (
    QAbstractAnimation,
    QAbstractItemModel,
    QAbstractListModel,
    QEvent,
    QMetaMethod,
    QPoint,
    QPointF,
    Qt,
    QTimer,
    qVersion,
)
from PySide6.QtGui import QAccessible, QAction, QEnterEvent, QShortcut, QWheelEvent
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

Actions = Mapping[str, Callable[[Any], object]]
"""What brings a window into each of its states, by the state's name."""
GOLDEN = Path(__file__).parent / "golden"
QT_VERSION = GOLDEN / "qt_version"
CONTROLS = (QAbstractButton, QAbstractItemView, QAbstractSlider, QAbstractSpinBox, QComboBox, QLineEdit, QPlainTextEdit)
STATES = ("disabled", "checked", "readOnly", "expanded", "selected", "focused", "invisible", "offscreen")
TEXT, DISABLED_TEXT = "StaticText readOnly ", "StaticText disabled readOnly "
LONGEST = 400
"""Most characters of a line: no one reads a whole study in it."""
ALIKE = 4
"""Most controls of one kind in parts of one kind, such as cards of studies, that are used."""


def widget_lines(window: QWidget) -> list[str]:
    """Return a line for each widget that has a name, a tip or a value: role, name, description, value and states."""
    lines = []
    for part in [window, *window.findChildren(QWidget)]:
        if not part.isVisible() or isinstance(part, QScrollBar):
            continue
        if (interface := QAccessible.queryAccessibleInterface(part)) is None:
            continue
        kinds = (QAccessible.Text.Name, QAccessible.Text.Description, QAccessible.Text.Value)
        words = [*(interface.text(kind) for kind in kinds), part.toolTip()]
        if isinstance(part, QComboBox):  # Windows tells its label
            words[0] = words[2] or words[0]
        state = interface.state()
        on = [name for name in STATES if getattr(state, name)]
        if any(words):
            lines.append(" ".join([interface.role().name, *on, _joined_once(words)]))
        if isinstance(part, QAbstractItemView) and part.model() is not None:
            lines += _cells(part.model())
    return lines


def _joined_once(words: list[str]) -> str:
    """Join texts in one line, with "=" in place of a repeated one."""
    texts = ["=" if word and word in words[:at] else word for at, word in enumerate(words)]
    return " | ".join(texts).replace("\n", " / ").rstrip(" |")


def _cells(model: QAbstractItemModel) -> Iterator[str]:
    """Yield a line for each row of a table or list: shown text, spoken text and tip of its cells."""
    roles = (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.AccessibleTextRole, Qt.ItemDataRole.ToolTipRole)
    across = range(1 if isinstance(model, QAbstractListModel) else model.columnCount())
    yield "columns " + " | ".join(str(model.headerData(at, Qt.Orientation.Horizontal)) for at in across)
    for row in range(model.rowCount()):
        cells = (dict.fromkeys(str(model.index(row, at).data(role) or "") for role in roles) for at in across)
        yield "row " + " | ".join(" / ".join(cell).replace("\n", " / ") for cell in cells)


def spoken(window: QWidget) -> list[str]:
    """Return the spoken lines of a window after its animations, without texts that other lines repeat."""
    for animation in window.findChildren(QAbstractAnimation):
        animation.setCurrentTime(animation.totalDuration())
    lines = [golden.masked(line.replace(DISABLED_TEXT, TEXT))[:LONGEST] for line in widget_lines(window)]
    others = "\n".join(line for line in lines if not line.startswith(TEXT))
    return [line for line in lines if not (line.startswith(TEXT) and line.removeprefix(TEXT) in others)]


def comes_and_goes(before: list[str], after: list[str]) -> Iterator[str]:
    """Yield new lines, and of removed lines without a replacement the first and the number of others."""
    for how, start, end, first, last in SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        if how == "delete":
            yield f"- {before[start][:60]}" + (f" … {end - start - 1} more" if end - start > 1 else "")
        elif how != "equal":
            yield from after[first:last]


def listen(window: QWidget) -> list[str]:
    """Return a list that records each signal, with its arguments, of a window's own classes and of its pages."""
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


def _close_dialogs(dialog_lines: list[str], known_windows: set[QWidget]) -> None:
    for other in QApplication.topLevelWidgets():
        if other.isVisible() and other not in known_windows:
            dialog_lines.append(f"opened {type(other).__name__} {other.windowTitle()!r}")
            if not isinstance(other, QFileDialog):
                other.activateWindow()
                for _ in range(300):
                    if QApplication.focusWindow() is other.windowHandle():
                        break
                    QTest.qWait(1)
                dialog_lines += spoken(other)
            other.close()


class Recorder:
    """A recorder of the changes that each action makes in a window."""

    def __init__(self, window: QWidget, settled: Callable[[], None]) -> None:
        self.window, self.base, self._settled = window, window.window(), settled
        self._kept = {widget for widget in QApplication.topLevelWidgets() if widget.isVisible()}
        self.heard = listen(window)
        self.lines = spoken(window)

    def _rest(self) -> None:
        """Wait until the window has settled, and paint it for the comparison."""
        self.base.setUpdatesEnabled(False)
        self._settled()
        self.base.setUpdatesEnabled(True)

    def record(self, name: str, act: Callable[[], object]) -> Iterator[str]:
        """Yield the signals, the dialogs and the lines that change while and after ``act`` runs."""
        self.heard.clear()
        dialog_lines: list[str] = []
        blocked = QTimer(interval=200)
        blocked.timeout.connect(lambda: _close_dialogs(dialog_lines, self._kept))
        blocked.start()
        act()
        blocked.stop()
        self._rest()
        dialogs = len(dialog_lines)
        _close_dialogs(dialog_lines, self._kept)
        if len(dialog_lines) > dialogs:
            self._rest()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        if not self.base.isVisible():
            dialog_lines.append("closed")
        before, self.lines = self.lines, spoken(self.window)
        yield f"== {name}"
        yield from self.heard
        yield from dialog_lines
        yield from comes_and_goes(before, self.lines)


def steps(window: QWidget, settled: Callable[[], None]) -> Iterator[str]:
    """Yield the effect of each control, in the order of the Tab key, and then of each shortcut."""
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
    for widget in window.findChildren(QWidget):
        if isinstance(widget, CONTROLS) and is_usable(widget) and widget not in used:
            key = f"{type(widget).__name__} {_name(widget)!r}"
            if key not in used:
                yield key, widget


def states(window: Any, actions: Actions, settled: Callable[[], None]) -> Iterator[str]:
    """Yield the spoken lines of a window, then the lines that change with each action in turn."""
    recorder = Recorder(window, settled)
    yield from recorder.lines
    for name, bring in actions.items():
        yield from recorder.record(name, lambda bring=bring: bring(window))


def story(
    window: QWidget, acts: Iterable[tuple[str, Callable[[], object]]], settled: Callable[[], None]
) -> Iterator[str]:
    """Yield the spoken lines of a window, then the signals and changed lines after each act in turn."""
    heard = listen(window)
    settled()
    before = spoken(window)
    yield from before
    for name, act in acts:
        heard.clear()
        act()
        settled()
        after = spoken(window)
        yield from [f"== {name}", *heard, *comes_and_goes(before, after)]
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
    """Return one action that performs several; the last one shows the compared state."""

    def act(window: Any) -> None:
        for action in acts:
            action(window)

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
    """Compare lines, each once, with the golden file of a window, unless another version of Qt recorded it."""
    version = qVersion().rpartition(".")[0]
    if config.getoption("regenerate"):
        QT_VERSION.write_text(f"{version}\n", encoding="utf-8", newline="\n")
    if (recorded := QT_VERSION.read_text("utf-8").strip()) != version:
        pytest.skip(f"recorded with Qt {recorded}, here is Qt {version}: screen readers are told otherwise")
    golden.compare((GOLDEN / re.sub(r"\W+", "_", name)).with_suffix(".txt"), golden.each_once(lines), config)
