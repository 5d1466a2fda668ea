"""Plots that are painted once, jobs beside the window, and roles for screen readers."""

import threading
from typing import Any

import numpy as np
import pytest
import shiboken6
from PySide6.QtCore import QModelIndex, QObject, QPoint, Qt
from PySide6.QtGui import QAccessible
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QBoxLayout, QLabel, QWidget

from study_app.errors import StudyError
from study_app.gui.theme.theme import LIGHT, font
from study_app.gui.widgets.accessible import button_text, describe_plot, plain_tip
from study_app.gui.widgets.background import Background, delayed_call, wait_for_jobs
from study_app.gui.widgets.boxes import STRETCH, grid, hbox, insert_layout, vbox
from study_app.gui.widgets.cards import Bar, Card, Chip, Icon, MaskedPanel, scrolled
from study_app.gui.widgets.controls import ActionButton, Check, Choice, CompactStop, IconButton, Radio, Toggle
from study_app.gui.widgets.labels import Clamped, Elided, figures, label, set_ink
from study_app.gui.widgets.live_plots import TracePlot, lateness_histogram, tick_text
from study_app.gui.widgets.main_view import last_focused
from study_app.gui.widgets.row_table import Rows, Table


def test_changes_are_painted_at_once_and_only_once(qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    painted: list[int] = []
    paint = TracePlot.paintEvent
    monkeypatch.setattr(TracePlot, "paintEvent", lambda self, event: (painted.append(1), paint(self, event))[1])
    plot = TracePlot(10.0, 50.0)
    qtbot.addWidget(plot)
    plot.resize(420, 200)
    plot.show()
    qtbot.waitExposed(plot)
    QApplication.processEvents()
    painted.clear()
    times_s = np.linspace(-10, 0, 100)
    for turn in range(5):
        plot.show_traces(times_s, np.column_stack([np.sin(times_s + turn)] * 3))
        assert len(painted) == turn
        plot.paint_now()
        assert len(painted) == turn + 1
        QApplication.processEvents()
    assert len(painted) == 5


def test_only_the_newest_job_delivers_its_result(qtbot: Any) -> None:
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


@pytest.mark.parametrize("listened", [False, True])
def test_a_refusal_that_nothing_listens_to_is_logged(
    qtbot: Any, caplog: pytest.LogCaptureFixture, *, listened: bool
) -> None:
    def refuse() -> None:
        raise StudyError("no such folder")

    parent, came = QObject(), []
    background = Background(parent)
    if listened:
        background.failed.connect(came.append)
    background.run(refuse)
    qtbot.waitUntil(lambda: not background.busy)
    assert ("no such folder" in caplog.messages) is not listened
    assert len(came) == listened
    caplog.clear()


def test_the_end_of_the_program_waits_for_jobs_but_not_for_ever() -> None:
    parent = QObject()
    background, go_on, ended = Background(parent), threading.Event(), []
    assert background.wait(0), "nothing runs"
    background.run(lambda: ended.append(go_on.wait(10)))
    assert not background.wait(0)
    assert "background" in {thread.name for thread in threading.enumerate()}
    wait_for_jobs(0.01)
    assert ended == []
    go_on.set()
    wait_for_jobs(10)
    assert ended == [True]


def test_a_job_that_outlives_qt_ends_without_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    exceptions: list[Any] = []
    monkeypatch.setattr(threading, "excepthook", exceptions.append)
    parent, go_on = QObject(), threading.Event()
    background = Background(parent)
    monkeypatch.setattr(background, "_outcomes", type(background._outcomes)())
    background.run(lambda: go_on.wait(10))
    shiboken6.delete(background._outcomes)
    ended = threading.Event()
    ended.set()
    monkeypatch.setattr("study_app.gui.widgets.background._program_ends", ended)
    go_on.set()
    assert background.wait(10)
    assert exceptions == []


@pytest.mark.slow
def test_a_role_goes_with_its_widget(qtbot: Any) -> None:
    window = QWidget()
    qtbot.addWidget(window)
    for number in range(600):
        heading = label(f"Heading {number}", "card")
        heading.setParent(window)
        child = QAccessible.queryAccessibleInterface(window).child(0)
        assert child.role() == QAccessible.Role.Heading
        heading.setParent(None)
        heading.deleteLater()
        QTest.qWait(0)


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (-20.0, "−20"), (10_000.0, "10\u2009000"), (-1234.5, "−1\u2009234.5")]
)
def test_a_tick_has_a_minus_sign_and_thin_spaces(value: float, text: str) -> None:
    assert tick_text(value) == text


def test_a_clamped_text_is_replaced_and_its_tip_has_the_full_text(qtbot: Any) -> None:
    clamped = Clamped("Honey", 2)
    qtbot.addWidget(clamped)
    clamped.show()
    clamped.resize(90, 60)
    assert (clamped.text(), clamped.toolTip()) == ("Honey", "")
    long = "Glycerin with a little more water than in the block before, at a delay of 35 ms"
    clamped.show_text(long)
    lines = clamped.text().splitlines()
    assert len(lines) == 2
    assert lines[0].startswith("Glycerin")
    assert lines[1].endswith("…")
    assert long.startswith(" ".join(lines).removesuffix("…"))
    assert clamped.accessibleName() == long
    assert "35 ms" in clamped.toolTip()


def role_of(widget: QWidget) -> QAccessible.Role:
    return QAccessible.queryAccessibleInterface(widget).role()


def test_titles_are_headings_and_each_label_has_its_role_font_and_literal_text(qtbot: Any) -> None:
    labels = title, plain, _, number = (
        label("<b>A & B</b>", "title"),
        label("plain", "title", "warn", wraps=True, heading=False, weight=700),
        label("forced", "body", "text3", heading=True),
        figures("12.5", "body", "bad", weight=600),
    )
    for widget in labels:
        qtbot.addWidget(widget)
    heading, text = QAccessible.Role.Heading, QAccessible.Role.StaticText
    assert [role_of(widget) for widget in labels] == [heading, text, heading, text]
    assert [widget.property("role") for widget in labels] == ["text", "warn", "text3", "bad"]
    assert [widget.wordWrap() for widget in labels] == [False, True, False, False]
    assert (title.textFormat(), title.accessibleName()) == (Qt.TextFormat.PlainText, "<b>A & B</b>")
    assert plain.font() == font("title", weight=700)
    assert number.font() == font("body", weight=600, tabular=True)
    assert [widget.sizePolicy().hasHeightForWidth() for widget in labels] == [False, True, False, False]
    set_ink(number, "ok")
    assert number.property("role") == "ok"
    title.setText("new")
    assert title.accessibleName() == "new"


def test_text_of_a_study_is_never_markup_in_tips_and_buttons() -> None:
    assert plain_tip("a > b") == "a > b"
    assert plain_tip("a < b\n& c") == "<qt>a &lt; b<br>&amp; c</qt>"
    assert button_text("A & B") == "A && B"


def test_an_elided_text_is_complete_in_its_tip(qtbot: Any) -> None:
    elided = Elided("card", "text2")
    qtbot.addWidget(elided)
    elided.show()
    for text, width, is_whole in (("Honey", 400, True), ("Honey " * 40, 200, False), ("Honey", 400, True)):
        elided.resize(width, 30)
        elided.show_text(text)
        assert (elided.whole, elided.accessibleName()) == (text, text)
        assert (elided.text() == text, elided.toolTip() == "") == (is_whole, is_whole)
        assert elided.sizeHint().width() == round(elided.fontMetrics().horizontalAdvance(text)) + 2
    elided.resize(30, 30)
    assert (elided.text().endswith("…"), elided.toolTip()) == (True, "Honey")
    assert (role_of(elided), elided.property("role")) == (QAccessible.Role.Heading, "text2")


def test_boxes_place_parts_gaps_and_stretches_in_order(qtbot: Any) -> None:
    first, second, inner = QLabel("1"), QLabel("2"), hbox(QLabel("3"))
    parent = QWidget()
    qtbot.addWidget(parent)
    box = vbox(first, 7, (second, 3), STRETCH, (inner, 2), (STRETCH, 5), spacing=4, margins=(1, 2, 3, 4), parent=parent)
    assert (parent.layout(), box.direction(), box.spacing()) == (box, QBoxLayout.Direction.TopToBottom, 4)
    assert box.getContentsMargins() == (1, 2, 3, 4)
    assert [box.indexOf(part) for part in (first, second)] == [0, 2]
    assert [box.stretch(place) for place in range(box.count())] == [0, 0, 3, 0, 2, 5]
    assert box.itemAt(1).spacerItem().sizeHint().height() == 7
    assert hbox(margins=6).getContentsMargins() == (6, 6, 6, 6)
    insert_layout(box, 1, hbox(QLabel("4")))
    assert [box.indexOf(part) for part in (first, second)] == [0, 3]
    cells = grid(8, 9, margins=5)
    assert (cells.horizontalSpacing(), cells.verticalSpacing(), cells.contentsMargins().left()) == (8, 9, 5)


def test_a_card_has_its_title_a_chip_its_word_and_a_bar_its_share(qtbot: Any) -> None:
    aside, card = label("aside"), Card("Title", padding=10, gap=3)
    titled, chip, small = Card("Title", aside), Chip("ok", "check", "Ready"), Chip("bad", "cross", "Ready", small=True)
    panel, bar, area = MaskedPanel("Hidden", "The study is blind."), Bar(height=6), scrolled(vbox(label("x")))
    for widget in (card, titled, chip, small, panel, bar, area):
        qtbot.addWidget(widget)
    assert (card.heading.text(), role_of(card.heading), card.column.spacing()) == (
        "Title", QAccessible.Role.Heading, 3
    )  # fmt: skip
    assert titled.isAncestorOf(aside)
    assert (chip.accessibleName(), chip.sizeHint().height(), small.sizeHint().height()) == ("Ready", 28, 24)
    width = chip.sizeHint().width()
    chip.show_state("warn", "warning", "Not ready at all")
    assert (chip.tone, chip.icon, chip.word, chip.accessibleName()) == ("warn", "warning", *["Not ready at all"] * 2)
    assert chip.sizeHint().width() > width
    assert panel.accessibleName() == "Hidden. The study is blind."
    for share, expected in ((0.4, 0.4), (1.2, 1.0), (-0.1, 0.0)):
        bar.show_share(share, 0.7)
        assert (bar.share, bar.tick) == (expected, 0.7)
    assert (area.widget().findChild(QLabel).text(), area.widgetResizable()) == ("x", True)
    icon = Icon("check", "ok", 24)
    qtbot.addWidget(icon)
    icon.show_icon("cross", "bad")
    assert (icon.name, icon.ink, icon.width()) == ("cross", "bad", 24)
    describe_plot(panel, "Force", "Force over time.")
    assert (panel.accessibleName(), panel.accessibleDescription(), role_of(panel)) == (
        "Force", "Force over time.", QAccessible.Role.Chart
    )  # fmt: skip


@pytest.mark.slow
def test_buttons_are_pressed_by_enter_and_their_key_and_keep_it_with_another_text(qtbot: Any) -> None:
    window, pressed = QWidget(), list[str]()
    qtbot.addWidget(window)
    button, other = ActionButton("repeat", "Refresh", key="F5"), IconButton("trash", "Discard it", size=36)
    stop = CompactStop("Stop force and play", "Esc")
    vbox(button, other, stop, parent=window)
    for name, widget in (("refresh", button), ("discard", other)):
        widget.clicked.connect(lambda _checked, name=name: pressed.append(name))
    window.show()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    for count, text in enumerate(("Refresh", "Looking…"), 1):
        button.show_action("repeat", text)
        qtbot.keyClick(window, Qt.Key.Key_F5)
        qtbot.waitUntil(lambda count=count: len(pressed) == count and not button.isDown())
    for widget in (button, other):
        for key in (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space):
            qtbot.keyClick(widget, key)
    assert pressed == ["refresh"] * 5 + ["discard"] * 3
    wide = button.sizeHint().width()
    button.show_action("", "Looking…")
    assert (button.text(), wide - button.sizeHint().width()) == ("Looking…", 28)
    button.set_role("primary")
    assert (button.role, button.property("role")) == ("primary", "primary")
    assert (other.accessibleName(), other.toolTip(), other.width()) == ("Discard it", "Discard it", 36)
    assert IconButton("trash", "Discard it", "Discard…").toolTip() == "Discard…"
    assert (stop.property("role"), other.property("dense")) == ("stop", "true")
    assert (stop.accessibleName(), stop.toolTip()) == (
        "Stop force and play. Holding Esc does the same.", "Stop force and play (or hold Esc)"
    )  # fmt: skip


def test_the_colour_of_a_button_tells_its_role_and_whether_it_can_be_pressed() -> None:
    enabled = {"primary": LIGHT.on_accent, "danger": LIGHT.bad, "plain": LIGHT.text2, "": LIGHT.text}
    disabled = dict.fromkeys(enabled, LIGHT.text3) | {"primary": LIGHT.text2}
    for is_enabled, inks in ((True, enabled), (False, disabled)):
        for role, ink in inks.items():
            button = ActionButton("", "Go", role=role)
            button.setEnabled(is_enabled)
            assert (button.theme, button._ink()) == (LIGHT, ink)


@pytest.mark.parametrize("kind", [Check, Toggle, Radio])
def test_a_box_is_checked_by_a_click_beside_its_text(qtbot: Any, kind: Any) -> None:
    box = kind("On")
    qtbot.addWidget(box)
    box.resize(400, 32)
    box.show()
    qtbot.mouseClick(box, Qt.MouseButton.LeftButton, pos=QPoint(390, 5))
    assert box.isChecked()
    assert box.sizeHint().width() > box.fontMetrics().horizontalAdvance("On") + 30


def test_the_wheel_over_a_choice_changes_nothing_and_a_label_has_its_name(qtbot: Any) -> None:
    window, choice = QWidget(), Choice()
    qtbot.addWidget(window)
    choice.addItems(["One", "Two", "Three"])
    choice.setAccessibleName("Number")
    vbox(choice, parent=window)
    window.show()
    choice.setCurrentIndex(1)
    QTest.wheelEvent(window.windowHandle(), choice.geometry().center(), QPoint(0, 120))
    assert (choice.currentIndex(), choice.accessibleName()) == (1, "Number")
    assert choice.focusPolicy() == Qt.FocusPolicy.StrongFocus
    named = [part for part in window.findChildren(QLabel) if part.buddy() is choice]
    assert [(part.text(), part.isHidden()) for part in named] == [("Number", True)]
    assert choice.fitted("Three", 1000) == "Three"


def test_a_table_shows_cells_shares_its_width_and_opens_a_row_by_enter(qtbot: Any) -> None:
    cells: list[Any] = []

    def cell(row: Any, name: str) -> dict[int, Any]:
        cells.append((row, name))
        return {Qt.ItemDataRole.DisplayRole: f"{name} of {row}"}

    model = Rows({"a": "First", "b": "Second"}, cell)
    table, rows_opened = Table(model, ((1, 100), (3, 60)), "Sessions"), list[int]()
    qtbot.addWidget(table)
    table.opened.connect(lambda index: rows_opened.append(index.row()))
    table.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
    table.resize(360, 300)
    table.show()
    qtbot.keyClick(table, Qt.Key.Key_Return)
    model.show("xyz")
    assert (model.rowCount(), model.columnCount()) == (3, 2)
    assert (model.rowCount(model.index(0, 0)), model.columnCount(model.index(0, 0))) == (0, 0)
    across, down = Qt.Orientation.Horizontal, Qt.Orientation.Vertical
    assert [model.headerData(at, across) for at in (0, 1)] == ["First", "Second"]
    assert (model.headerData(0, down), model.headerData(0, across, Qt.ItemDataRole.ToolTipRole)) == (None, None)
    assert [model.index(2, at).data() for at in (0, 1)] == ["a of z", "b of z"]
    assert model.index(2, 1).data(Qt.ItemDataRole.ToolTipRole) is None
    assert len(cells) == len(set(cells)), "each cell is made once"
    spare = table.viewport().width() - 160
    assert [table.columnWidth(at) for at in (0, 1)] == [100 + spare // 4, 60 + spare * 3 // 4]
    assert (table.minimumSizeHint().width(), table.accessibleName(), table.chosen_row) == (160, "Sessions", None)
    table.selectRow(1)
    qtbot.keyClick(table, Qt.Key.Key_Enter)
    qtbot.keyClick(table, Qt.Key.Key_Down)
    qtbot.keyClick(table, Qt.Key.Key_Return)
    assert (rows_opened, table.chosen_row, table.selectionModel().selectedRows()[0].row()) == ([1, 2], 2, 2)
    model.show("uv")
    assert (table.chosen_row, model.index(0, 0).data(), table.currentIndex()) == (None, "a of u", QModelIndex())


def test_lateness_is_counted_in_steps_of_its_logarithm_from_one_microsecond() -> None:
    edges_us, counts = lateness_histogram(np.array([0.0, 0.5, 15.0, 150.0, 150.0]))
    assert (edges_us[0], edges_us[-1], len(edges_us)) == (1.0, 1000.0, len(counts) + 1)
    assert np.allclose(np.diff(np.log10(edges_us)), np.log10(edges_us[1]))
    filled = {
        value_us: counts[np.searchsorted(edges_us, value_us, side="right") - 1] for value_us in (1.0, 15.0, 150.0)
    }
    assert (filled, counts.sum()) == ({1.0: 2, 15.0: 1, 150.0: 2}, 5)
    assert lateness_histogram(np.array([20_000.0]))[0][-1] == 100_000.0


def test_a_delayed_call_runs_once_after_its_last_start(qtbot: Any) -> None:
    owner, runs = QObject(), list[int]()
    timer = delayed_call(owner, 40, lambda: runs.append(1))
    assert (timer.interval(), timer.isActive()) == (40, False)
    for _ in range(3):
        timer.start()
        qtbot.wait(5)
    qtbot.waitUntil(lambda: runs == [1])
    qtbot.wait(60)
    assert runs == [1]


def test_a_place_remembers_its_last_focus_while_it_can_have_it(qtbot: Any) -> None:
    part, button = QWidget(), ActionButton("", "Go")
    qtbot.addWidget(part)
    vbox(button, parent=part)
    part.show()
    assert last_focused(part) is None
    button.setFocus()
    assert last_focused(part) is button
    button.setEnabled(False)
    assert last_focused(part) is None
