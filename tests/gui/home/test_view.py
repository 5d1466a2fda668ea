"""Home: cards, sessions, and the ways into a session."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAccessible, QFontMetrics
from PySide6.QtWidgets import QFileDialog

from study_app.devices.descriptor import NONE, Backend
from study_app.gui.home.main_window import LEAST
from study_app.gui.home.study_cards import BrokenCard, StudyCard
from study_app.gui.theme.theme import font
from study_app.gui.widgets.row_table import GAP
from study_app.protocol.load import source_bytes
from study_app.protocol.source.files import shipped_file
from study_app.store.workstation import MachineSettings
from study_app.viewmodels.devices.list_view import devices_shown
from tests.gui.home.home_window import cell, hold, open_home, study_cards

pytestmark = pytest.mark.slow


def test_every_protocol_has_a_card_one_is_the_next_step_and_sessions_have_status_and_answers(home):
    cards = {card.facts.protocol.study.name: card for card in study_cards(home)}
    assert set(cards) >= {"rek2024", "demo"}
    assert [card.new.property("role") for card in cards.values()].count("primary") == 1
    assert (cell(home, 0, "Status"), cell(home, 0, "Answers")) == ("Complete", "0 of 8")
    assert cards["demo"].held.text() == "1 session, 1 complete"


def test_participants_pilots_simulated_and_sample_sessions_are_shown_apart(qtbot, tmp_path):
    hold(tmp_path / "demo", "P001")
    hold(tmp_path / "demo-rehearsal-1", "P002", simulated=True)
    hold(tmp_path / "sample-demo", "P003", simulated=True)
    home = open_home(qtbot, tmp_path)
    kinds = home.sessions.kind
    said = [kinds.itemText(at) for at in range(kinds.count())]
    assert said == ["Participants (1)", "Pilot (0)", "Simulated (1)", "Sample (1)", "All (3)"]
    shown = {}
    for at, words in enumerate(said):
        kinds.setCurrentIndex(at)
        shown[words.split()[0]] = sorted(one.participant for one in home.sessions.shown)
    ids = {"Participants": ["P001"], "Pilot": [], "Simulated": ["P002"], "Sample": ["P003"]}
    assert shown == ids | {"All": ["P001", "P002", "P003"]}


def test_a_fresh_clone_greets_with_no_session_and_says_what_is_not_shown(qtbot, tmp_path):
    hold(tmp_path / "sample-demo", "P001", simulated=True)
    home = open_home(qtbot, tmp_path)
    assert not (tmp_path / "demo").exists()
    assert home.sessions.shown == ()
    assert home.sessions.none.isVisible()
    assert home.sessions.none.text().endswith("Not shown: 1 sample session.")


def test_the_sessions_are_a_table_to_a_screen_reader(home):
    table = QAccessible.queryAccessibleInterface(home.sessions.rows.table)
    assert table.role() == QAccessible.Role.Table
    assert table.text(QAccessible.Text.Name) == "Sessions"
    inside = [table.child(at) for at in range(table.childCount())]
    roles = {QAccessible.Role.ColumnHeader: [], QAccessible.Role.Cell: []}
    for part in inside:
        if part.role() in roles:
            roles[part.role()].append(part.text(QAccessible.Text.Name))
    heads, cells = roles.values()
    assert heads == ["Participant", "Study", "Started", "Status", "Validity", "Answers"]
    assert (cells[0], *cells[3:]) == ("P001", "Complete", "Open", "0 of 8")


def test_a_session_is_opened_by_the_keyboard_a_double_click_and_a_button(home, qtbot):
    table, asked = home.sessions.rows.table, []
    home.sessions.open_asked.connect(lambda facts: asked.append(facts.participant))
    assert not home.sessions.details.isEnabled()
    table.setFocus()
    qtbot.keyClick(table, Qt.Key.Key_Down)
    qtbot.keyClick(table, Qt.Key.Key_Return)
    middle = table.visualRect(table.model().index(0, 1)).center()
    qtbot.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=middle)
    qtbot.mouseDClick(table.viewport(), Qt.MouseButton.LeftButton, pos=middle)
    qtbot.mouseClick(home.sessions.details, Qt.MouseButton.LeftButton)
    assert asked == ["P001"] * 3


def test_a_simulated_session_says_so_in_full_in_the_smallest_window(qtbot, tmp_path):
    hold(tmp_path / "demo", "P001", simulated=True)
    home = open_home(qtbot, tmp_path, LEAST)
    home.sessions.show_kind("simulated")
    assert cell(home, 0, "Study") == "demo, simulated"
    table = home.sessions.rows.table

    def whole():
        room = table.columnWidth(1) - 2 * GAP
        for words, face in (("demo", font("label", weight=400)), ("simulated", font("small"))):
            assert QFontMetrics(face).horizontalAdvance(words) <= room
        assert sum(table.columnWidth(at) for at in range(6)) <= table.viewport().width()

    qtbot.waitUntil(whole)


def test_new_session_opens_the_questions_and_passes_the_answers_on(home, qtbot):
    card = study_cards(home)[0]
    qtbot.mouseClick(card.new, Qt.MouseButton.LeftButton)
    with qtbot.waitSignal(home.session_asked) as asked:
        qtbot.mouseClick(home.dialog.begin, Qt.MouseButton.LeftButton)
    assert asked.args[0].source == card.facts.source
    assert asked.args[0].participant == "P001"


def test_the_pen_edits_a_study_or_copies_one_that_ships(home, qtbot, tmp_path, monkeypatch):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    (tmp_path / "protocols").mkdir()
    text = shipped_file("demo").read_text(encoding="utf-8").replace('name = "demo"', 'name = "mine"')
    (tmp_path / "protocols" / "mine.toml").write_text(text, encoding="utf-8")
    (tmp_path / "protocols" / "broken.toml").write_text("format = 1\n", encoding="utf-8")
    home.show_studies()
    qtbot.waitUntil(lambda: not home.reading)
    asked = []
    home.edit_asked.connect(lambda source: asked.append(("edit", source)))
    home.new_asked.connect(lambda source: asked.append(("new", source)))
    pens = {card.facts.source: card.pen for card in home.grid.cards if isinstance(card, StudyCard)}
    assert pens["demo"].accessibleName().startswith("Make a copy of")
    for pen in (pens["mine"], pens["demo"], next(card.pen for card in home.grid.cards if isinstance(card, BrokenCard))):
        qtbot.mouseClick(pen, Qt.MouseButton.LeftButton)
    qtbot.mouseClick(home.new_study, Qt.MouseButton.LeftButton)
    assert asked == [("edit", "mine"), ("new", "demo"), ("edit", "broken"), ("new", "")]


def test_a_protocol_opened_from_elsewhere_gets_a_card(home, qtbot, tmp_path, monkeypatch):
    own = tmp_path / "own.toml"
    own.write_bytes(source_bytes("demo").replace(b'name = "demo"', b'name = "own"'))
    chosen = [(str(own), ""), (str(tmp_path / "broken.toml"), "")]
    (tmp_path / "broken.toml").write_text("format = 1\n")
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_arguments: chosen.pop(0))
    home.open_protocol.click()
    qtbot.waitUntil(lambda: study_cards(home)[0].facts.protocol.study.name == "own")
    home.open_protocol.click()
    qtbot.waitUntil(lambda: isinstance(home.grid.cards[0], BrokenCard))


def test_keys_begin_a_study_and_open_a_protocol(home, qtbot, monkeypatch):
    asked = []
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: asked.append("open") or ("", ""))
    home.new_asked.connect(lambda source: asked.append(("new", source)))
    home.main.activateWindow()
    qtbot.waitUntil(home.main.isActiveWindow)
    qtbot.keyClick(home.main, Qt.Key.Key_N, Qt.KeyboardModifier.ControlModifier)
    qtbot.keyClick(home.main, Qt.Key.Key_O, Qt.KeyboardModifier.ControlModifier)
    assert asked == [("new", ""), "open"]
    assert [button.toolTip() for button in (home.open_protocol, home.new_study)] == [
        "Open protocol … (Ctrl+O)",
        "New study … (Ctrl+N)",
    ]


def test_the_preferred_device_is_shown_as_it_was_found_and_sessions_begin_with_it(home, qtbot):
    (falcon,) = devices_shown([Backend("falcon", "libusb 1.0", NONE, "felt, up to 8 N", "plug its cable in")])
    home.show_machine(MachineSettings(device="falcon"), falcon)
    card = home.device
    assert (card.name.text(), card.icon.name, card.state.word) == ("Novint Falcon", "device", "Not connected")
    assert (card.about.text(), card.why.text()) == ("Felt, up to 8 N.", "Plug its cable in.")
    qtbot.mouseClick(study_cards(home)[0].new, Qt.MouseButton.LeftButton)
    assert home.dialog.chosen().device == "falcon"
    home.dialog.reject()


def test_tab_goes_through_home_as_it_is_read(home, qtbot):
    home.window().activateWindow()
    qtbot.waitUntil(lambda: all(card.isVisible() for card in home.grid.cards))
    home.open_protocol.setFocus()
    names = []
    while home.focusWidget() is not home.lab.open:
        assert len(names) < 40
        names.append(home.focusWidget().accessibleName())
        home.focusNextChild()
    begun = [name for name in names if name.startswith("New session")]
    assert len(begun) == len(home.grid.cards)
    assert max(map(names.index, begun)) < names.index("Sessions shown") < names.index("Sessions")
