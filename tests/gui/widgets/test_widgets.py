"""Names in plots, chips in tables, jobs beside the window, and roles for screen readers."""

import threading
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QObject, QRect, QRectF, Qt
from PySide6.QtGui import QAccessible, QImage, QPainter, QStandardItem, QStandardItemModel
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QStyleOptionViewItem, QWidget

from study_app.gui.theme.theme import LIGHT
from study_app.gui.widgets.background import Background, wait_for_jobs
from study_app.gui.widgets.controls import Choice
from study_app.gui.widgets.labels import Clamped, Elided, figures, label
from study_app.gui.widgets.live_plots import LatenessPlot, TracePlot
from study_app.gui.widgets.row_table import BELOW_ROLE, CHIP_ROLE, ROW_HEIGHT, Table

OUTLINE = 3  # px from the row's edge to within the outline of a chosen row


def place(name: Any) -> QRectF:
    return name.textItem.mapRectToScene(name.textItem.boundingRect())


@pytest.mark.slow
def test_the_names_of_limit_and_p99_do_not_touch(qtbot: Any) -> None:
    plot = LatenessPlot(2000.0)
    qtbot.addWidget(plot)
    plot.show()
    qtbot.waitExposed(plot)
    for decades, p99_us in ((4, 3.0), (5, 66.0), (5, 700.0), (4, 2000.0), (6, 9000.0)):
        for size in ((320, 150), (900, 420)):
            edges = np.logspace(0, decades, 10 * decades + 1)
            plot.show_histogram(edges, np.full(10 * decades, 10_000), p99_us)
            plot.resize(*size)
            QApplication.processEvents()
            limit, p99 = place(plot.limit_name), place(plot.p99_name)
            assert plot.limit_name.isVisible()
            assert plot.p99_name.isVisible()
            inside = plot.box.mapRectToScene(plot.box.boundingRect()).adjusted(0, -1, 0, 1)
            assert inside.top() <= limit.top() < limit.bottom() <= p99.top() + 1
            assert p99.bottom() <= inside.bottom()


def test_what_was_changed_is_painted_at_once_and_not_again_later(qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    plot = TracePlot(10.0, 50.0)
    qtbot.addWidget(plot)
    plot.resize(420, 200)
    plot.show()
    qtbot.waitExposed(plot)
    QApplication.processEvents()
    painted: list[int] = []
    paint = TracePlot.paintEvent
    monkeypatch.setattr(TracePlot, "paintEvent", lambda self, event: (painted.append(1), paint(self, event))[1])
    times_s = np.linspace(-10, 0, 100)
    for turn in range(5):
        plot.show_traces(times_s, np.column_stack([np.sin(times_s + turn)] * 3))
        assert len(painted) == turn
        plot.paint_now()
        assert len(painted) == turn + 1
        QApplication.processEvents()
    assert len(painted) == 5


def test_a_chip_with_words_below_keeps_off_the_outline_of_its_row(qtbot: Any) -> None:
    model, cell = QStandardItemModel(), QStandardItem()
    cell.setData(("ok", "check", "Complete"), CHIP_ROLE)
    cell.setData("device reconnected, recording lost", BELOW_ROLE)
    model.appendRow([cell])
    table = Table(model, ((1, 200),), "Sessions")
    qtbot.addWidget(table)
    table.apply_theme(LIGHT)
    drawn = QImage(300, ROW_HEIGHT, QImage.Format.Format_ARGB32)
    drawn.fill(Qt.GlobalColor.transparent)
    option = QStyleOptionViewItem()
    option.rect = QRect(0, 0, 300, ROW_HEIGHT)  # type: ignore[attr-defined]  # missing in the stubs
    painter = QPainter(drawn)
    table.itemDelegate().paint(painter, option, model.index(0, 0))
    painter.end()
    inked = [y for y in range(ROW_HEIGHT) if any(drawn.pixelColor(x, y).alpha() for x in range(drawn.width()))]
    assert OUTLINE <= inked[0] < inked[-1] < ROW_HEIGHT - OUTLINE


def test_only_the_newest_of_what_was_asked_for_comes(qtbot: Any) -> None:
    parent = QObject()
    background, came, go_on = Background(parent), [], threading.Event()
    background.done.connect(came.append)
    background.run(lambda: go_on.wait(10) and "first")
    background.run(lambda: "second")
    background.run(lambda: "third")
    assert background.busy
    assert came == []
    go_on.set()
    qtbot.waitUntil(lambda: not background.busy)
    assert came == ["third"]


def test_the_end_of_the_program_waits_for_jobs_but_not_for_ever() -> None:
    parent = QObject()
    background, go_on, ended = Background(parent), threading.Event(), []
    background.run(lambda: ended.append(go_on.wait(10)))
    wait_for_jobs(0.01)
    assert ended == []
    go_on.set()
    wait_for_jobs(10)
    assert ended == [True]


def test_titles_are_headings_to_a_screen_reader_and_other_labels_are_not(qtbot: Any) -> None:
    elided = Elided("card")
    elided.show_text("Second")
    headings: list[QLabel] = [label("First", role) for role in ("display", "title", "title_dense", "card")]
    for heading in headings:
        heading.setText("Second")
    for made, role in (
        *((heading, QAccessible.Role.Heading) for heading in (*headings, elided)),
        (label("Second", "body"), QAccessible.Role.StaticText),
        (figures("Second", "card"), QAccessible.Role.StaticText),
    ):
        qtbot.addWidget(made)
        told = QAccessible.queryAccessibleInterface(made)
        assert (told.role(), told.text(QAccessible.Text.Name)) == (role, "Second")


def test_a_long_title_is_cut_after_two_lines_and_whole_in_tip_and_name(qtbot: Any) -> None:
    long = "How people tell liquids apart " * 20
    title = Clamped(long, 2, "card", steady=False)
    qtbot.addWidget(title)
    title.resize(300, 80)
    title.show()
    assert (title.text().count("\n"), title.text()[-1]) == (1, "…")
    assert (title.toolTip(), title.accessibleName()) == (long, long)


def test_a_choice_is_labelled_by_what_it_is_of(qtbot: Any) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    choice = Choice()
    choice.setAccessibleName("Sessions shown")
    choice.addItem("Participants (0)")
    choice.setParent(window)
    window.show()
    labels = [one for one in window.findChildren(QLabel) if one.buddy() is choice]
    assert [(one.text(), one.isVisible()) for one in labels] == [("Sessions shown", False)]


@pytest.mark.slow
def test_a_role_goes_with_its_widget(qtbot: Any) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    for number in range(600):
        made = label(f"Heading {number}", "card")
        made.setParent(window)
        child = QAccessible.queryAccessibleInterface(window).child(0)
        assert child.role() == QAccessible.Role.Heading
        made.setParent(None)
        made.deleteLater()
        QTest.qWait(0)
