"""Home: cards, sessions, and the ways into a session."""

import pytest
from PySide6.QtCore import QSize, Qt
from PySide6.QtWidgets import QFileDialog

from study_app.gui.home.cards import BrokenCard, StudyCard
from study_app.protocol.source.files import shipped_file, source_bytes
from tests.gui.home.home_window import hold, open_home, study_cards

pytestmark = pytest.mark.slow


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


def first_study(home):
    """Return the study of the first card, whose way into a session is the only primary button of the page."""
    first, *others = study_cards(home)
    assert [card.new.property("role") for card in (first, *others)] == ["primary", *[""] * len(others)]
    return first.facts.source


def test_the_demo_is_first_until_a_session_exists_then_what_was_run_last(qtbot, tmp_path):
    home = open_home(qtbot, tmp_path)
    assert first_study(home) == "demo"
    assert home.sessions.height() < 60, "an empty card is one line"
    assert home.sessions.nothing.isVisible()
    for study, simulated, kind in (("rek2024", False, ""), ("slime", True, "simulated"), ("slime", False, "")):
        hold(tmp_path / f"{study}{simulated}", "P001", study=study, simulated=simulated)
        home.enter()
        qtbot.waitUntil(lambda kind=kind: home.sessions.shown != () and home.sessions.kind.currentData() == kind)
        qtbot.waitUntil(lambda study=study: not home.reading and first_study(home) == study)
        assert study in {one.study for one in home.sessions.shown}
    home.main.close()
    assert first_study(open_home(qtbot, tmp_path)) == "slime", "another day, too"


def test_where_only_samples_exist_sessions_are_one_line_until_they_are_asked_for(qtbot, tmp_path):
    hold(tmp_path / "sample-demo", "P001", simulated=True)
    home = open_home(qtbot, tmp_path)
    card = home.sessions
    qtbot.waitUntil(card.kind.isVisible)
    assert card.height() < 80, "one line, for no row is shown"
    qtbot.waitUntil(lambda: home.device.y() == home.lab.y() > 0)  # below it, side by side
    assert "1 sample session" in card.nothing.text()
    card.show_kind("sample")
    qtbot.waitUntil(lambda: card.height() >= 200)
    assert card.rows.table.isVisible()
    qtbot.waitUntil(lambda: home.device.y() < home.lab.y())


@pytest.mark.parametrize("size", [(1024, 640), (1366, 768), (1600, 1000)])
@pytest.mark.parametrize("held", [True, False])
def test_no_scroll_bar_stands_in_a_scroll_area(qtbot, tmp_path, size, held):
    if held:
        hold(tmp_path / "demo", "P001")
    home = open_home(qtbot, tmp_path, QSize(*size))
    bars = [area.verticalScrollBar() for area in (home.area, home.cards_area)]
    qtbot.waitUntil(lambda: sum(bar.maximum() > 0 for bar in bars) == 1)


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
