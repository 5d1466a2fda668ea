"""Home: cards, sessions and the ways into a session, while studies, drafts and files change."""

import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from PySide6.QtCore import QEvent, QPoint, QSize, Qt
from PySide6.QtWidgets import QApplication, QDialog, QFileDialog, QLabel

from study_app.gui.home import view
from study_app.gui.home.cards import BrokenCard, CardGrid, DeviceCard, ResumeBanner, SessionsCard, StudyCard
from study_app.gui.home.dialogs import NewSessionDialog, RehearsalDialog
from study_app.gui.home.study_facts import BrokenFacts, DraftFacts, DraftNote, Interrupted, StudyFacts
from study_app.gui.kit.devices import DeviceShown
from study_app.gui.sessions.session_facts import SessionFacts
from study_app.gui.widgets.background import wait_for_jobs
from study_app.gui.widgets.cards import Icon
from study_app.gui.widgets.controls import ActionButton
from study_app.gui.widgets.labels import Clamped, label
from study_app.protocol.load import load
from study_app.protocol.source.files import source_bytes
from study_app.store.versions.drafts import Draft, delete_draft, write_draft
from study_app.store.versions.study_settings import keep_original
from study_app.store.workstation import MachineSettings
from tests.golden import masked
from tests.gui.home.home_window import hold, open_home
from tests.gui.transcript import compare, story
from tests.gui.windows import SCREENS
from tests.studies import begun

pytestmark = pytest.mark.slow


@pytest.fixture(autouse=True)
def workspace(monkeypatch, tmp_path):
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))


def own_study(folder, title="Own"):
    """Write a study into a workspace, and return its file."""
    file = folder / "protocols" / "own.toml"
    file.parent.mkdir(exist_ok=True)
    text = source_bytes("demo").decode().replace('name = "demo"', 'name = "own"')
    file.write_text(text.replace('"A first look"', f'"{title}"'), encoding="utf-8", newline="\n")
    return file


def changes_of_studies(home, folder, chooses):
    """Yield changes of studies and drafts, and the clicks that follow."""
    file, fresh = folder / "protocols" / "own.toml", folder / "protocols" / "fresh.toml"

    def come_back(act):
        def comes_back():
            act()
            home.enter()

        return comes_back

    def pen(name):
        pens = {Path(card.facts.source).stem: card.pen for card in home.grid.cards}
        return f"press {pens[name].text()} of {name}", pens[name].click

    yield "a study is added", come_back(lambda: own_study(folder))
    yield "it is edited", come_back(lambda: own_study(folder, "Own, edited"))
    cards = home.grid.cards
    yield "nothing has changed", home.enter
    assert home.grid.cards is cards
    yield "it has the title of another one", come_back(lambda: own_study(folder, "A first look"))
    yield "it is damaged", come_back(lambda: file.write_text("format = 2\n", encoding="utf-8", newline="\n"))
    yield pen("own")
    yield "it is deleted", come_back(file.unlink)
    text = own_study(folder).read_text(encoding="utf-8")
    fresh_text = 'format = 2\n[study]\nname = "fresh"\ntitle = "Fresh"\n'
    yield (
        "the program was killed",
        come_back(lambda: write_draft(file, Draft(text=text.replace('"Own"', '"Else"', 1), base=""))),
    )
    keep_original(fresh, "demo")
    yield "a study was never saved", come_back(lambda: write_draft(fresh, Draft(text=fresh_text, base="")))
    for name in ("fresh", "own", "demo"):
        yield pen(name)
    yield "press New study", home.new_study.click
    yield "the draft is that of the file", come_back(lambda: write_draft(file, Draft(text=text, base="")))
    elsewhere = folder / "elsewhere.toml"
    elsewhere.write_text(text.replace('name = "own"', 'name = "elsewhere"'), encoding="utf-8", newline="\n")
    for chosen in (elsewhere, folder / "broken.toml"):
        chosen.write_text(
            chosen.read_text(encoding="utf-8") if chosen.exists() else "format = 2\n", encoding="utf-8", newline="\n"
        )
        chooses.setattr(QFileDialog, "getOpenFileName", lambda *_, chosen=chosen: (str(chosen), ""))
        yield f"open {chosen.name}", home.open_protocol.click


def sessions_come(home, folder, _chooses):
    """Yield sessions that are held, and which kind is shown."""
    for name, participant, study, simulated in (
        ("sample-demo", "P003", "demo", True),
        ("demo-rehearsal-1", "P002", "demo", True),
        ("slime", "P001", "slime", False),
        ("rek2024", "P004", "rek2024", False),
    ):
        hold(folder / "results" / name, participant, study=study, simulated=simulated)
        yield f"{participant} of {study} in {name}", home.enter
    for at in range(home.sessions.kind.count()):
        yield f"show kind {at}", lambda at=at: home.sessions.kind.setCurrentIndex(at)


@pytest.mark.parametrize("acts", [changes_of_studies, sessions_come], ids=lambda acts: acts.__name__)
def test_home_follows_changes_of_files_and_sessions(qtbot, tmp_path, monkeypatch, pytestconfig, acts):
    home = open_home(qtbot, tmp_path / "results")

    def settled():
        for _ in range(2):  # a folder that was looked at may be read
            wait_for_jobs(60)
            QApplication.processEvents()
        qtbot.waitUntil(lambda: not home.is_reading)

    lines = (
        line.replace(masked(str(tmp_path)), "FOLDER").replace(str(tmp_path), "FOLDER")
        for line in story(home.main, acts(home, tmp_path, monkeypatch), settled)
    )
    compare(f"home, {acts.__name__}", lines, pytestconfig)


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
    assert not home.is_reading, "each activation would say it again"
    home.enter()
    qtbot.waitUntil(lambda: len(home.grid.cards) > 1)


@pytest.mark.parametrize("after", ["saved", "never saved"])
def test_the_card_that_one_went_on_from_keeps_the_keyboard_and_is_in_sight(qtbot, tmp_path, after):
    text = own_study(tmp_path, "Zest").read_text(encoding="utf-8")
    for name in "abcdefgh":
        content = text.replace('name = "own"', f'name = "{name}"').replace("Zest", f"Study {name}")
        (tmp_path / "protocols" / f"{name}.toml").write_text(content, encoding="utf-8", newline="\n")
    file = tmp_path / "protocols" / ("own.toml" if after == "saved" else "fresh.toml")
    write_draft(file, Draft(text=text.replace("Zest", "Else"), base=""))
    home = open_home(qtbot, tmp_path / "results")
    home.main.resize(1366, 768)
    home.main.activateWindow()
    qtbot.waitUntil(home.main.isActiveWindow)
    count, bar = len(home.grid.cards), home.cards_area.verticalScrollBar()
    pen = home.grid.cards[0].pen
    assert pen.text() == "Continue"
    qtbot.mouseClick(pen, Qt.MouseButton.LeftButton)
    delete_draft(file)
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


def test_the_height_of_the_cards_fits_their_texts_at_the_present_width(qtbot, tmp_path):
    grid = type(open_home(qtbot, tmp_path).grid)()
    cards = [label("word " * count, "label", wraps=True) for count in (40, 90)]
    qtbot.addWidget(grid)
    grid.resize(240, 900)
    grid.show()
    grid.show_cards(cards)
    QApplication.processEvents()
    assert grid.whole_height == sum(card.heightForWidth(240) for card in cards) + grid.layout().verticalSpacing()
    (other,) = cards_shown = [label("other", "label")]
    grid.show_cards(cards_shown)
    assert [grid.layout().indexOf(card) for card in (other, *cards)] == [0, -1, -1]
    assert grid.cards is cards_shown


def test_as_many_cards_as_fit_stand_in_a_row(qtbot):
    grid = CardGrid()
    qtbot.addWidget(grid)
    grid.show()
    cards = [label("word " * count, "label", wraps=True) for count in (40, 90, 300)]
    least, gap = 330, 18
    for width, columns in ((2 * least + gap - 1, 1), (2 * least + gap, 2), (5 * least, 4)):
        grid.resize(width, 900)
        grid.show_cards(cards) if width < 2 * least + gap else grid.arrange(width)
        QApplication.processEvents()
        places = [grid.layout().getItemPosition(grid.layout().indexOf(card))[:2] for card in cards]
        assert places == [(at // columns, at % columns) for at in range(3)]
        stretched = [grid.layout().columnStretch(column) for column in range(grid.layout().columnCount())]
        assert stretched == [1] * min(columns, 3)
        card_width = (width + gap) // columns - gap
        assert grid.row_height == max(card.heightForWidth(card_width) for card in cards[:columns])
    with qtbot.waitSignal(grid.laid_out):
        cards[0].setText("word " * 99)


def test_each_button_of_a_study_opens_its_dialog(qtbot, tmp_path):
    home = open_home(qtbot, tmp_path)
    card = home.grid.cards[0]
    for button, title, kind in (
        (card.new, "New session", NewSessionDialog),
        (card.rehearse, "Rehearse", RehearsalDialog),
    ):
        assert button.text() == title
        qtbot.mouseClick(button, Qt.MouseButton.LeftButton)
        dialogs = [dialog for dialog in home.main.findChildren(QDialog) if dialog.isVisible()]
        assert [type(dialog) for dialog in dialogs] == [kind]
        dialogs[0].reject()


def test_a_draft_can_be_discarded_from_its_card(qtbot, tmp_path):
    text = own_study(tmp_path).read_text(encoding="utf-8")
    write_draft(tmp_path / "protocols" / "fresh.toml", Draft(text=text, base=""))
    home = open_home(qtbot, tmp_path / "results")
    drafts = [card for card in home.grid.cards if card.bin is not None]
    assert [card.facts.source for card in drafts] == [str(tmp_path / "protocols" / "fresh.toml")]
    with qtbot.waitSignal(home.discard_asked) as signal:
        qtbot.mouseClick(drafts[0].bin, Qt.MouseButton.LeftButton)
    assert signal.args == [drafts[0].facts.source]


def test_with_only_sample_sessions_the_list_is_one_line_until_requested(qtbot, tmp_path):
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


@pytest.mark.parametrize("size", [(1366, 746), (1280, 690), (1920, 1000)])
@pytest.mark.parametrize("interrupted", [True, False])
def test_studies_and_sessions_are_seen_at_once_and_one_button_is_filled(qtbot, tmp_path, size, interrupted):
    hold(tmp_path / "demo", "P001")
    if interrupted:
        begun(tmp_path / "demo", "P002", "demo", simulated=False).close()
    home = open_home(qtbot, tmp_path, QSize(*size))
    qtbot.waitUntil(lambda: home.banner.isVisible() == interrupted and home.below.isVisible())
    qtbot.wait(50)
    assert home.area.verticalScrollBar().maximum() == 0
    assert home.cards_area.geometry().bottom() < home.below.mapTo(home.area.widget(), QPoint(0, 0)).y()
    assert home.cards_area.height() >= home.grid.row_height
    table = home.sessions.rows.table
    assert table.viewport().height() >= table.rowHeight(0), "a session is seen"
    filled = [button for button in home.findChildren(ActionButton) if button.isVisible() and button.role == "primary"]
    assert len(filled) == 1


def test_no_word_on_sessions_while_they_are_read(qtbot, tmp_path, monkeypatch):
    hold(tmp_path / "demo", "P001")
    reading = threading.Event()
    read = view._read_sessions
    monkeypatch.setattr(view, "_read_sessions", lambda *arguments: reading.wait(10) and read(*arguments))
    home = view.HomePlace(tmp_path)
    qtbot.addWidget(home)
    home.show()
    home.show_studies()
    qtbot.waitUntil(lambda: len(home.grid.cards) > 0)
    qtbot.wait(50)
    assert not home.sessions.isVisible(), "“No sessions yet” would be wrong"
    reading.set()
    qtbot.waitUntil(home.sessions.isVisible)
    assert not home.sessions.is_empty


def test_a_session_is_opened_by_the_keyboard_a_double_click_and_a_button(home, qtbot):
    table, participants = home.sessions.rows.table, []
    home.sessions.open_asked.connect(lambda facts: participants.append(facts.participant))
    assert not home.sessions.details.isEnabled()
    table.setFocus()
    qtbot.keyClick(table, Qt.Key.Key_Down)
    qtbot.keyClick(table, Qt.Key.Key_Return)
    middle = table.visualRect(table.model().index(0, 1)).center()
    qtbot.mouseClick(table.viewport(), Qt.MouseButton.LeftButton, pos=middle)
    qtbot.mouseDClick(table.viewport(), Qt.MouseButton.LeftButton, pos=middle)
    qtbot.mouseClick(home.sessions.details, Qt.MouseButton.LeftButton)
    assert participants == ["P001"] * 3


def test_the_card_of_sessions_counts_each_kind_and_names_hidden_ones(qtbot):
    now = datetime(2026, 3, 9, 18, 30, tzinfo=UTC)
    facts = [
        SessionFacts(
            participant=f"P{number}", session=1, study="demo", started=now, status="completed", validity="valid",
            answers=8, answers_of=8, simulated=simulated, pilot=pilot, folder=Path(f"results/{name}/data/sub/ses"),
        )
        for number, (name, simulated, pilot) in enumerate(
            (("demo", False, True), ("demo", True, True), ("demo-rehearsal", True, False), ("sample-demo", True, False))
        )
    ]  # fmt: skip
    card = SessionsCard()
    qtbot.addWidget(card)
    assert card.nothing.text() == "No sessions yet. The first session will appear here when it starts."
    assert (card.kind.isHidden(), card.all.isHidden(), card.rows.isHidden()) == (True, True, True)
    assert not card.details.isEnabled()
    emptied = []
    card.emptied.connect(lambda: emptied.append(card.is_empty))
    card.show_sessions(facts[:3], "results", now)
    counts = [card.kind.itemText(at) for at in range(card.kind.count())]
    assert counts == ["Participants (0)", "Pilot (2)", "Simulated (1)", "Sample (0)", "All (3)"]
    others = "Not shown: 2 pilot sessions, 1 simulated session."
    none = {"": "No participant sessions yet. The first session will appear here when it starts.",
            "sample": "No sample sessions."}  # fmt: skip
    for kind, expected in (("", []), ("pilot", ["P0", "P1"]), ("simulated", ["P2"]), ("sample", [])):
        card.show_kind(kind)
        assert sorted(session.participant for session in card.shown) == expected
        assert card.rows.isHidden() == card.is_empty == (not expected)
        assert card.nothing.isHidden() == bool(expected)
        assert expected or card.nothing.text() == f"{none[kind]} {others}"
        assert not card.details.isEnabled()
    assert emptied == [False, True]
    card.show_sessions(facts[3:], "results", now)
    card.show_kind("sample")
    for days, started in enumerate(("Today 18:30", "Yesterday 18:30", "9 Mar 18:30")):
        card.show_sessions(facts[3:], "results", now + timedelta(days=days))
        assert [card.rows.model.index(0, column).data() for column in (0, 2)] == ["P3", started]
    for kind, words in (("pilot", "No pilot sessions."), ("simulated", "No simulated sessions.")):
        card.show_kind(kind)
        assert card.nothing.text() == f"{words} Not shown: 1 sample session."


@pytest.mark.parametrize(("tone", "ink"), [("warn", "warn"), ("bad", "bad"), ("neutral", "text2")])
def test_the_card_of_the_device_shows_why_it_cannot_be_used(qtbot, tone, ink):
    card = DeviceCard()
    qtbot.addWidget(card)
    card.show_device(
        DeviceShown(
            name="a", title="Falcon", icon="device", tone=tone, sign="clock", word="Word", can="Can.", why="Why."
        )
    )
    assert [part.text() for part in (card.name, card.about, card.why)] == ["Falcon", "Can.", "Why."]
    assert (card.state.tone, card.state.icon, card.state.word) == (tone, "clock", "Word")
    assert card.why.property("role") == ink
    assert (card.about.isHidden(), card.why.isHidden()) == (False, False)
    card.show_device(home_device())
    assert (card.name.text(), card.about.isHidden(), card.why.isHidden()) == ("Hammer", True, True)
    card.show_screens(("One", "Two"))
    assert card.screens.text() == "One\nTwo"


def texts_of(card):
    return [part.whole if isinstance(part, Clamped) else part.text() for part in card.findChildren(QLabel)]


NOTE = DraftNote("Draft from today 14:02, not saved: Water", "2026-11-20T14:02:00+01:00")


@pytest.mark.parametrize("first", [True, False])
@pytest.mark.parametrize(
    ("shipped", "draft", "pen"),
    [(True, None, "Make a copy of Ink"), (False, None, "Edit Ink"), (False, NOTE, "Continue Ink, mine")],
)
def test_the_card_of_a_study_describes_it_and_its_buttons_send_their_requests(qtbot, first, shipped, draft, pen):
    facts = StudyFacts(
        source="/there/mine.toml", protocol=load("demo"), title="Ink", description="Thick or thin.", languages="Dutch",
        extent="2 parts", duration="about 5 min", needs="Mouse; at most 6 N", origin="Copy of demo", draft=draft,
    )  # fmt: skip
    card, heard = StudyCard(facts, first=first, shipped=shipped), []
    qtbot.addWidget(card)
    for name in ("edit", "discard", "new_session", "rehearsal"):
        getattr(card, name).connect(lambda shown_facts, name=name: heard.append((name, shown_facts is facts)))
    assert card.origin.whole == "Copy of demo  ·  mine.toml"
    texts = [text for text in texts_of(card) if text not in ("", card.origin.text())]
    what = "Thick or thin." if draft is None else f"{NOTE.words}. Sessions use the saved file."
    assert sorted(texts) == sorted(["Ink", what, "2 parts", "about 5 min  ·  Dutch", "Mouse; at most 6 N"])
    assert [icon.name for icon in card.findChildren(Icon)] == ["layers", "clock", "device"]
    assert (card.draft.isHidden(), card.bin is None) == (draft is None, draft is None)
    assert card.pen.accessibleName() == pen
    assert (card.new.text(), card.new.accessibleName()) == ("New session", "New session of Ink, mine")
    assert (card.rehearse.text(), card.rehearse.accessibleName()) == ("Rehearse", "Rehearse Ink, mine")
    assert card.new.role == ("primary" if first and draft is None else "")
    if draft is None:
        assert card.pen.toolTip() == pen.removesuffix(" of Ink").removesuffix(" Ink")
    else:
        assert (card.pen.text(), card.pen.role) == ("Continue", "primary" if first else "")
        assert card.bin.accessibleName() == "Discard the draft of Ink, mine…"
        card.bin.click()
    for button in (card.pen, card.new, card.rehearse):
        button.click()
    assert heard == [*[("discard", True)] * bool(draft), ("edit", True), ("new_session", True), ("rehearsal", True)]


def test_the_card_of_a_broken_file_states_the_reason(qtbot):
    broken = BrokenFacts(source="/there/mine.toml", problem="No format.", origin="Own study", draft=None)
    fresh = DraftFacts(source="/there/mine.toml", title="Ink", origin="Own study", draft=NOTE)
    file, draft = cards = BrokenCard(broken), BrokenCard(fresh, first=True)
    for card in cards:
        qtbot.addWidget(card)
        assert card.origin.whole == "Own study  ·  mine.toml"
    assert {"mine", "This file cannot be used.", "No format."} <= {*texts_of(file)}
    assert [icon.name for icon in file.findChildren(Icon)] == ["warning"]
    assert {"Ink", "mine.toml will be created when the draft is saved.", f"{NOTE.words}."} <= {*texts_of(draft)}
    assert [icon.name for icon in draft.findChildren(Icon)] == []
    assert (file.pen.accessibleName(), draft.pen.role) == ("Edit mine", "primary")
    with qtbot.waitSignal(draft.discard) as heard:
        draft.bin.click()
    assert heard.args == [fresh]


def test_the_banner_resumes_the_session_that_it_names(qtbot):
    session = Interrupted(folder=Path("x"), source="demo", participant="P007", heading="P007 stopped", line="8 of 62.")
    banner = ResumeBanner()
    qtbot.addWidget(banner)
    assert banner.isHidden()
    banner.show()
    banner.show_interrupted(session)
    assert (banner.heading.text(), banner.line.text(), banner.isHidden()) == ("P007 stopped", "8 of 62.", False)
    assert (banner.resume.text(), banner.resume.accessibleName()) == ("Resume P007", "Resume P007")
    with qtbot.waitSignal(banner.resume_asked) as heard:
        banner.resume.click()
    assert heard.args == [session]
    banner.show_interrupted(None)
    assert banner.isHidden()


def test_home_names_the_screen_of_the_participant(home, monkeypatch):
    monkeypatch.setattr(view, "screens_shown", lambda: SCREENS)
    for name, numbers in (
        ("DP-1", ("Screen 1", "Participant's screen 2")),
        ("eDP-1", ("Participant's screen 1", "Screen 2")),
    ):
        home.show_machine(MachineSettings(screen=name), home_device())
        lines = [f"{number}: {screen.words}" for number, screen in zip(numbers, SCREENS, strict=True)]
        assert home.device.screens.text().splitlines() == lines
        assert home.device.name.text() == "Hammer"
    monkeypatch.setattr(view, "screens_shown", lambda: SCREENS[:1])
    home.enter()
    assert home.device.screens.text() == f"Screen 1: {SCREENS[0].words}"


def home_device():
    return DeviceShown(name="h", title="Hammer", icon="device", tone="ok", sign="check", word="Ready", can="", why="")


def test_an_interrupted_session_goes_on_with_the_settings_of_this_machine(qtbot, tmp_path, monkeypatch):
    begun(tmp_path / "demo", "P002", "demo", device={"name": "falcon"}, seed=7).close()
    firmware = tmp_path / "firmware.bin"
    firmware.touch()
    home = open_home(qtbot, tmp_path)
    settings = MachineSettings(screen="eDP-1", firmware=str(firmware))
    home.show_machine(settings, home_device())
    qtbot.waitUntil(home.banner.isVisible)
    for screens, windowed, screen in ((SCREENS, False, 1), (SCREENS[1:], True, 1)):
        monkeypatch.setattr(view, "screens_shown", lambda screens=screens: screens)
        with qtbot.waitSignal(home.session_asked) as heard:
            home.banner.resume.click()
        (chosen,) = heard.args
        assert (chosen.source, chosen.participant, chosen.seed, chosen.device) == ("demo", "P002", 7, "falcon")
        assert (chosen.windowed, chosen.screen, chosen.device_options) == (windowed, screen, {"firmware": firmware})
    (tmp_path / "demo" / "data" / "sub-P002" / "ses-01" / "journal.jsonl").unlink()
    with qtbot.waitSignal(home.message) as heard:
        home.banner.resume.click()
    assert heard.args[0] == "The session cannot be resumed"


def test_dialogs_and_buttons_of_home_send_their_requests(home, qtbot, tmp_path, monkeypatch):
    card = next(card for card in home.grid.cards if card.facts.source == "demo")
    assert card.held.text() == "1 session, 1 complete"
    card.rehearse.click()
    folder = home.dialog.folder
    with qtbot.waitSignal(home.results_asked) as heard:
        home.dialog.done(QDialog.DialogCode.Accepted)
    assert heard.args == [folder]
    card.new.click()
    home.dialog.editors["participant"].control.setText("P008")
    with qtbot.waitSignal(home.session_asked) as heard:
        home.dialog.begin.click()
    assert [(chosen.participant, chosen.source) for chosen in heard.args] == [("P008", "demo")]
    for button, name in (
        (home.sessions.all, "results"),
        (home.device.devices, "devices"),
        (home.device.display, "machine"),
        (home.lab.open, "lab"),
    ):
        with qtbot.waitSignal(home.go_asked) as heard:
            button.click()
        assert heard.args == [name]
    liquid = tmp_path / "liquid.toml"
    liquid.write_text("format = 2\n[liquids.water]\ndensity_kg_m3 = 1000\n", encoding="utf-8", newline="\n")
    elsewhere = own_study(tmp_path).rename(tmp_path / "elsewhere.toml")
    chosen = iter(["", str(liquid), str(elsewhere)])
    monkeypatch.setattr(view, "choose_protocol", lambda *_: next(chosen))
    with qtbot.assertNotEmitted(home.protocol_opened):
        home.open_protocol.click()
        with qtbot.waitSignal(home.message) as heard:
            home.open_protocol.click()
    assert heard.args == ["This is a liquid file", f"{liquid} is not a study: open it in the liquid lab."]
    with qtbot.waitSignal(home.protocol_opened) as heard:
        home.open_protocol.click()
    assert heard.args == [elsewhere]
    qtbot.waitUntil(lambda: home.grid.cards[0].facts.source == str(elsewhere))
    with qtbot.waitSignal(home.edit_asked) as heard:
        home.grid.cards[0].pen.click()
    assert heard.args == [str(elsewhere)]
    with qtbot.waitSignal(home.new_asked) as heard:
        next(card for card in home.grid.cards if card.facts.source == "demo").pen.click()
    assert heard.args == ["demo"]
    home.main.notice.accept()
