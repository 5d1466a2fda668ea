"""Home when studies, drafts and files come, change and go."""

import threading

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QApplication, QPushButton, QWidget

from study_app.gui.home import view
from study_app.gui.home.cards import StudyCard
from study_app.protocol.source.files import source_bytes
from study_app.store.drafts import Draft, discard, keep
from study_app.store.study_settings import begin_settings
from tests.gui.home.home_window import open_home, study_cards

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def workspace(monkeypatch, tmp_path):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))


def own_study(folder, title="Own"):
    """Write a study into a workspace, and return its file."""
    file = folder / "protocols" / "own.toml"
    file.parent.mkdir(exist_ok=True)
    text = source_bytes("demo").decode().replace('name = "demo"', 'name = "own"')
    file.write_text(text.replace('"A first look"', f'"{title}"'), encoding="utf-8")
    return file


def titles(home):
    return [card.facts.title if isinstance(card, StudyCard) else "broken" for card in home.grid.cards]


@pytest.mark.parametrize("way", ["enter", "activation"])
def test_a_study_that_is_added_edited_or_damaged_changes_its_card(qtbot, tmp_path, way):
    home = open_home(qtbot, tmp_path / "results")
    before = titles(home)

    elsewhere = QWidget()
    qtbot.addWidget(elsewhere)
    elsewhere.show()

    def come_back():
        if way == "enter":
            home.enter()
            return
        elsewhere.activateWindow()
        qtbot.waitUntil(lambda: not home.isActiveWindow())
        home.main.activateWindow()

    file = own_study(tmp_path)
    come_back()
    qtbot.waitUntil(lambda: sorted(titles(home)) == sorted([*before, "Own"]))
    own_study(tmp_path, "Own, edited")
    come_back()
    qtbot.waitUntil(lambda: "Own, edited" in titles(home))
    cards = home.grid.cards
    home.enter()
    qtbot.waitUntil(lambda: not home.reading)
    assert home.grid.cards is cards, "no file has changed"
    own_study(tmp_path, "A first look")
    come_back()
    qtbot.waitUntil(lambda: titles(home).count("A first look") == 2)
    cards = [card for card in study_cards(home) if card.facts.title == "A first look"]
    assert [card.origin.whole for card in cards] == ["Shipped study  ·  demo.toml", "Own study  ·  own.toml"]
    assert len({card.new.accessibleName() for card in cards}) == 2
    file.write_text("format = 1\n")
    come_back()
    qtbot.waitUntil(lambda: "broken" in titles(home))
    file.unlink()
    come_back()
    qtbot.waitUntil(lambda: titles(home) == before)


def test_cards_of_drafts_come_first_say_what_was_not_saved_and_continue_it(qtbot, tmp_path):
    file, fresh = own_study(tmp_path), tmp_path / "protocols" / "fresh.toml"
    home = open_home(qtbot, tmp_path / "results")

    def card_of(title):
        return next(card for card in home.grid.cards if getattr(card.facts, "title", "") == title)

    def hidden():
        return not card_of("Own").draft.isVisible()

    assert hidden()
    text = file.read_text(encoding="utf-8")
    keep(file, Draft(text.replace('title = "Own"', 'title = "Else"', 1), ""))  # as after a kill
    keep(fresh, Draft('format = 2\n[study]\nname = "fresh"\ntitle = "Fresh"\n', ""))
    begin_settings(fresh, "demo")
    home.enter()
    qtbot.waitUntil(lambda: any(getattr(card.facts, "title", "") == "Fresh" for card in home.grid.cards))
    qtbot.waitUntil(lambda: all(card.isVisible() for card in home.grid.cards))
    assert {card.facts.title for card in home.grid.cards[:2]} == {"Own", "Fresh"}
    for title, end in (("Own", ", not saved: Title. Sessions use the saved file."), ("Fresh", ", never saved.")):
        words = card_of(title).draft.text()
        assert words.startswith("Draft of today ")
        assert words.endswith(end)
    assert card_of("Fresh").origin.whole == "Copy of demo  ·  fresh.toml"
    asked = []
    home.edit_asked.connect(asked.append)
    for title in ("Fresh", "Own"):
        pen = card_of(title).pen
        assert (pen.text(), pen.accessibleName()) == ("Continue", f"Continue {title}, {title.lower()}")
        qtbot.mouseClick(pen, Qt.MouseButton.LeftButton)
    assert asked == [str(fresh), "own"]
    filled = [one for one in home.findChildren(QPushButton) if one.property("role") == "primary" and one.isVisible()]
    assert filled == [home.grid.cards[0].pen]
    keep(file, Draft(text, ""))
    home.enter()
    qtbot.waitUntil(hidden)


def test_studies_that_cannot_be_read_are_named_and_the_sessions_stay(qtbot, results, monkeypatch):
    monkeypatch.setattr(view, "read_studies", lambda _opened: 1 // 0)
    monkeypatch.setattr(threading, "excepthook", lambda _what: None)
    home = open_home(qtbot, results)
    assert home.main.notice.windowTitle() == "The studies could not be read"
    assert home.below.isVisible()
    assert len(home.sessions.shown) == 1
    home.main.notice.accept()
    monkeypatch.undo()
    QApplication.sendEvent(home, QEvent(QEvent.Type.WindowActivate))
    assert not home.reading, "each activation would say it again"
    home.enter()
    qtbot.waitUntil(lambda: len(home.grid.cards) > 1)


@pytest.mark.parametrize("after", ["saved", "never saved"])
def test_the_card_that_one_went_on_from_keeps_the_keyboard_and_is_in_sight(qtbot, tmp_path, after):
    text = own_study(tmp_path, "Zest").read_text(encoding="utf-8")
    for name in "abcdefgh":
        made = text.replace('name = "own"', f'name = "{name}"').replace("Zest", f"Study {name}")
        (tmp_path / "protocols" / f"{name}.toml").write_text(made, encoding="utf-8")
    file = tmp_path / "protocols" / ("own.toml" if after == "saved" else "fresh.toml")
    keep(file, Draft(text.replace("Zest", "Else"), ""))
    home = open_home(qtbot, tmp_path / "results")
    home.main.resize(1366, 768)
    home.main.activateWindow()
    qtbot.waitUntil(home.main.isActiveWindow)
    count, bar = len(home.grid.cards), home.cards_area.verticalScrollBar()
    pen = home.grid.cards[0].pen
    assert pen.text() == "Continue"
    qtbot.mouseClick(pen, Qt.MouseButton.LeftButton)
    discard(file)
    home.enter()
    qtbot.waitUntil(lambda: not any(card.facts.draft for card in home.grid.cards))
    QApplication.processEvents()
    now = home.main.focusWidget()
    (held,) = (card for card in home.grid.cards if card.isAncestorOf(now))
    assert now is held.pen
    assert home.cards_area.viewport().rect().contains(held.mapTo(home.cards_area.viewport(), held.rect().center()))
    if after == "saved":
        assert (held.facts.title, bar.value() > 0) == ("Zest", True)
    else:
        assert (len(home.grid.cards), held, bar.value()) == (count - 1, home.grid.cards[0], 0)
