"""Parts of windows by themselves, in states that only a test of the part shows quickly."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget

from study_app.designer.outline import OutlineCard, OutlineRow
from study_app.gui.help.view import PageReader
from study_app.gui.kit.dialogs import Question
from study_app.gui.lab.cards import EstimateCard
from study_app.gui.settings.view import ScreenNumber
from study_app.gui.theme.theme import DARK, LIGHT
from study_app.gui.theme.themed import apply_theme
from study_app.gui.widgets.boxes import hbox, vbox
from study_app.gui.widgets.cards import Bar, Chip, Icon, Logo, Rule
from study_app.gui.widgets.controls import Cap
from study_app.gui.widgets.labels import Clamped, Elided, set_ink
from study_app.gui.widgets.live_plots import LatenessPlot, TracePlot
from tests.gui.lab.sample import blind, still_view, workbench
from tests.gui.lab.states import FOUND_VALUES
from tests.gui.transcript import Actions

PAGE_TEXT: Final = """# Title

A sentence with a [link](other.md#part) and `code`.

## Part

| Key | Meaning |
| --- | --- |
| `a` | one |

```
typed
```
""" + "\n".join(f"\n### Step {number}\n\n{'Words of a step. ' * 12}" for number in range(12))
TONES: Final = ("ok", "warn", "bad", "accent", "neutral")
TIMES_S: Final = np.linspace(-10.0, 0.0, 200)


def of_estimates(**fields: Any) -> Callable[[Any], None]:
    return lambda card: card.show_view(still_view(**fields))


def closed_by(act: Callable[[Any], object]) -> Callable[[Any], None]:
    def do(window: Any) -> None:
        window.show()
        act(window)

    return do


def press(window: QWidget) -> None:
    QTest.mouseClick(window, Qt.MouseButton.LeftButton)


def enter(window: QWidget) -> None:
    QTest.keyClick(window, Qt.Key.Key_Return)


class Indicators(QWidget):
    """What shows a state: rules, icons, chips, bars, labels."""

    def __init__(self) -> None:
        super().__init__()
        self.chips = [Chip(tone, "check", tone.capitalize(), small=small) for tone in TONES for small in (False, True)]
        self.bars = [Bar(), Bar(4), Bar(12)]
        self.icons = [Icon("warning", "bad"), Icon("check", "ok", 32), Logo(), Cap("Esc"), Cap("Ctrl")]
        self.elided, self.clamped = Elided("label", "text2"), Clamped("", 2, "small", "text2")
        chips, icons = hbox(*self.chips[:5]), hbox(*self.icons)
        vbox(chips, hbox(*self.chips[5:]), icons, Rule(), *self.bars, self.elided, self.clamped, parent=self)

    def show_all(self, share: float, tick: float | None, words: str) -> None:
        for bar in self.bars:
            bar.show_share(share, tick)
        self.chips[0].show_state("warn", "warning", words[:9])
        self.icons[0].show_icon("check", "ok")
        self.elided.show_text(words)
        self.clamped.show_text(words)
        set_ink(self.elided, "bad")


def outline() -> OutlineCard:
    card = OutlineCard()
    rows = [OutlineRow((), "Session, in order", note="12 min")]
    for number, name in enumerate(("consent", "feel", "break")):
        rows.append(OutlineRow(("blocks", name), name.title(), "file", "5 min", 1, number, name, ("sequence", number)))
        rows += [OutlineRow(("tasks", f"{name}{at}"), f"Task {at}", "route", depth=2) for at in range(number + 1)]
    rows += [OutlineRow((), "Settings"), OutlineRow(("limits",), "Limits", "check", depth=1)]
    card.show_outline(tuple(rows), ("blocks", "feel"))
    card.tree.expandAll()
    return card


def dragged(row: int, to: int, *, below: int = 0) -> Callable[[Any], None]:
    """Return an action that drags a row of the outline to the top of another, or px below it, and holds it there."""

    def act(card: Any) -> None:
        tree, (start, end) = card.tree, (card.tree.visualRect(card.indexes()[at]) for at in (row, to))
        at = QPoint(tree.viewport().width() // 2, end.top() + below)
        QTest.mousePress(tree.viewport(), Qt.MouseButton.LeftButton, pos=QPoint(at.x(), start.center().y()))
        for place in (start.center(), at, at):
            QTest.mouseMove(tree.viewport(), QPoint(at.x(), place.y()))

    return act


def dropped(card: Any) -> None:
    QTest.mouseRelease(card.tree.viewport(), Qt.MouseButton.LeftButton)


def shown_page() -> PageReader:
    reader = PageReader(Path())
    reader.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)  # its length comes with time
    reader.show_page("page")
    return reader


class Plots(QWidget):
    """Plots of both kinds."""

    def __init__(self) -> None:
        super().__init__()
        self.traces, self.lateness = TracePlot(10.0, 1.0), LatenessPlot(400.0)
        hbox(self.traces, self.lateness, parent=self)


def notice() -> Question:
    parent: Any = None
    return Question(parent, LIGHT, "Not saved", "The disk is full.")


def traces(reach: float) -> Callable[[Any], None]:
    waves = reach * np.column_stack([np.sin(TIMES_S), np.cos(TIMES_S), TIMES_S / 10])
    return lambda part: (
        part.traces.show_reach(reach), part.traces.show_traces(TIMES_S, waves), part.traces.paint_now()
    )  # fmt: skip


def histogram(part: Any) -> None:
    edges = np.geomspace(1.0, 1e4, 33)
    part.lateness.show_histogram(edges, np.arange(32)[::-1] ** 2, 250.0)
    part.lateness.paint_now()


def dark(part: QWidget) -> None:
    apply_theme(part, DARK)


PARTS: Final[dict[str, tuple[Callable[[], QWidget], tuple[int, int], Actions]]] = {
    "estimates": (EstimateCard, (360, 330), {
        "found": of_estimates(estimate=FOUND_VALUES), "none": of_estimates(),
        "blind": of_estimates(workbench=blind(workbench())),
    }),
    "screen number": (lambda: ScreenNumber(2, QApplication.primaryScreen()), (640, 400), {
        "clicked": closed_by(press), "key": closed_by(enter),
    }),
    "notice": (notice, (500, 220), {
        "Enter": enter, "closed": closed_by(lambda window: press(window.go_on)),
    }),
    "indicators": (Indicators, (700, 360), {
        "little": lambda part: part.show_all(0.004, 0.25, "A few words"),
        "most": lambda part: part.show_all(1.4, None, "Many words that do not fit into one line of this part. " * 4),
        "half": lambda part: part.show_all(0.5, 1.0, ""), "dark": dark,
    }),
    "outline": (outline, (320, 480), {
        "to the end": dragged(1, 9, below=31), "dropped at the end": dropped,
        "to the beginning": dragged(6, 1), "dropped at the beginning": dropped,
        "below another's task": dragged(1, 5, below=4),
        "let go of": lambda card: QTest.keyClick(card.tree, Qt.Key.Key_Escape),
    }),
    "page of help": (shown_page, (600, 400), {
        "half": lambda reader: reader.verticalScrollBar().setValue(reader.verticalScrollBar().maximum() // 2),
        "narrow": lambda reader: reader.resize(420, 400), "heading": lambda reader: reader.show_page("page", "step-4"),
        "lower": lambda reader: reader.resize(420, 300), "dark": dark,
    }),
    "plots": (Plots, (960, 220), {
        "waves": traces(1.0), "higher": traces(3.0), "late": histogram, "dark": dark,
    }),
}  # fmt: skip
