"""A window as text, for golden files: what it paints, what it tells a screen reader, what each control does.

``python -m pytest tests/gui/test_transcripts.py --regenerate`` writes the files anew: read the difference.
"""

import difflib
import re
from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from PySide6.QtCore import QBuffer, QByteArray, QEvent, QMetaMethod, QPointF, Qt, QTimer, qVersion
from PySide6.QtGui import QAccessible, QEnterEvent
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

GOLDEN = Path(__file__).parent / "golden"
QT_VERSION = GOLDEN / "qt_version"
CONTROLS = (QAbstractButton, QAbstractItemView, QAbstractSlider, QAbstractSpinBox, QComboBox, QLineEdit, QPlainTextEdit)
STATES = ("disabled", "checked", "readOnly", "expanded", "selected", "focused", "invisible", "offscreen")
NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
SVG = "{http://www.w3.org/2000/svg}"
PLACES = ("d", "points", "x", "y", "width", "height", "x1", "x2", "y1", "y2", "cx", "cy", "r", "rx", "ry")
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
    window.render(generator)
    return list(_shapes(ElementTree.fromstring(bytes(content.data()))))  # noqa: S314


def _shapes(root: ElementTree.Element) -> Iterator[str]:
    """Yield the texts, and between them the shapes of one place together: a frame is a dozen lines and curves."""
    drawn = (
        (shape.tag.removeprefix(SVG), group, shape)
        for group in root.iter(f"{SVG}g")
        for shape in group
        if shape.tag != f"{SVG}g"
    )
    for (at, is_text), shapes in groupby(drawn, lambda one: (one[1].get("transform", ""), one[0] == "text")):
        looks: list[str] = []
        places = ""
        for kind, group, shape in shapes:
            colours = [
                f"{name}={value}"
                for name in ("fill", "stroke")
                if (value := group.get(name, "none")) != "none" and group.get(f"{name}-opacity") != "0"
            ]
            if not colours and kind != "image":
                continue
            looks.append(" ".join([kind, *colours]))
            place = " ".join(value for name, value in shape.items() if name in PLACES)
            if is_text:
                size = f"{group.get('font-size')} {group.get('font-weight')}"
                yield f"{looks[-1]} {size} @{_rounded(at)} {_rounded(place)} {(shape.text or '').strip()}"
            places += f" {place}"
        if looks and not is_text:
            yield f"{', '.join(dict.fromkeys(looks))} @{_rounded(at)} {_rounded(places)}"


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
        interface = QAccessible.queryAccessibleInterface(part)
        if not part.isVisible() or interface is None:
            continue
        kinds = (QAccessible.Text.Name, QAccessible.Text.Description, QAccessible.Text.Value)
        words = [interface.text(kind).replace("\n", " / ") for kind in kinds]
        words.append(part.toolTip().replace("\n", " / "))
        state = interface.state()
        on = [name for name in STATES if getattr(state, name)]
        if any(words):
            shown = " | ".join(words).rstrip(" |")
            lines.append(" ".join([interface.role().name, *on, shown]))
    return lines


def lines_of(window: QWidget) -> list[str]:
    """Return what a window tells and paints."""
    return [*told(window), *painted(window)]


def listen(window: QWidget) -> list[str]:
    """Return a list that gets each signal that the window's own classes declare, with its arguments."""
    heard: list[str] = []
    meta = window.metaObject()
    for number in range(meta.methodCount()):
        method = meta.method(number)
        name = bytes(method.name().data()).decode()
        declared = any(name in vars(kind) for kind in type(window).__mro__ if kind.__module__.startswith("study_app"))
        if method.methodType() == QMetaMethod.MethodType.Signal and declared:

            def hear(*values: Any, name: str = name) -> None:
                heard.append(f"{name}({', '.join(repr(value)[:200] for value in values)})")

            getattr(window, name).connect(hear)
    return heard


def _name(control: QWidget) -> str:
    interface = QAccessible.queryAccessibleInterface(control)
    return interface.text(QAccessible.Text.Name) if interface else ""


def _act(control: QWidget) -> None:
    """Use a control as a person would: click, choose the next entry, step, type."""
    control.setFocus()
    match control:
        case QAbstractButton():
            QApplication.sendEvent(control, QEnterEvent(QPointF(1, 1), QPointF(1, 1), QPointF(1, 1)))
            QTest.mouseClick(control, Qt.MouseButton.LeftButton)
        case QComboBox() | QAbstractItemView():
            QTest.keyClick(control, Qt.Key.Key_Down)
        case QAbstractSlider():
            QTest.keyClick(control, Qt.Key.Key_Right)
        case QAbstractSpinBox():
            QTest.keyClick(control, Qt.Key.Key_Up)
        case QLineEdit() | QPlainTextEdit():
            QTest.keyClicks(control, "7")
            QTest.keyClick(control, Qt.Key.Key_Return)


def _close_dialogs(seen: list[str], base: QWidget) -> None:
    for other in QApplication.topLevelWidgets():
        if other.isVisible() and other is not base:
            seen.append(f"opened {type(other).__name__} {other.windowTitle()!r}")
            if not isinstance(other, QFileDialog):
                seen += told(other)
            other.close()


def steps(window: QWidget, settled: Callable[[], None]) -> Iterator[str]:
    """Yield what each control does: the signals, the dialogs and the lines that change."""
    heard = listen(window)
    base = window.window()
    used: set[str | QWidget] = set()
    before = lines_of(window)
    while True:
        free = (one for one in window.findChildren(QWidget) if isinstance(one, CONTROLS) and _usable(one))
        named = ((f"{type(one).__name__} {_name(one)!r}", one) for one in free)
        chosen = next(((key, one) for key, one in named if key not in used and one not in used), None)
        if chosen is None:
            return
        key, control = chosen
        used |= {key, control}
        heard.clear()
        seen: list[str] = []
        blocked = QTimer(interval=200)
        blocked.timeout.connect(lambda seen=seen: _close_dialogs(seen, base))
        blocked.start()
        _act(control)
        settled()
        blocked.stop()
        _close_dialogs(seen, base)
        settled()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        after = lines_of(window)
        changed = [line for line in difflib.unified_diff(before, after, n=0, lineterm="") if line[0] in "+-"][2:]
        before = after
        yield f"== {key}"
        yield from heard
        yield from seen
        yield from changed


def _usable(control: QWidget) -> bool:
    return (
        control.isVisible()
        and control.isEnabled()
        and not isinstance(control, QScrollBar)
        and not isinstance(control.parent(), QAbstractSpinBox | QComboBox)
    )


def compare(name: str, lines: list[str], config: pytest.Config) -> None:
    """Compare lines with the golden file, or write it."""
    kept = (GOLDEN / re.sub(r"\W+", "_", name)).with_suffix(".txt")
    version = qVersion().rpartition(".")[0]
    if config.getoption("regenerate"):
        kept.parent.mkdir(exist_ok=True)
        QT_VERSION.write_text(f"{version}\n")
        kept.write_text("\n".join(lines) + "\n", encoding="utf-8")
    if (recorded := QT_VERSION.read_text().strip()) != version:
        pytest.skip(f"recorded with Qt {recorded}, here is Qt {version}: styles paint otherwise")
    expected = kept.read_text(encoding="utf-8").splitlines()
    different = list(difflib.unified_diff(expected, lines, n=0, lineterm=""))[2:]
    assert not different, "\n".join([f"{kept}: review, then --regenerate", *different[:40]])
