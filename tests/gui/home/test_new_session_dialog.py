"""The questions before a session: checked as they are answered, and nothing created before Begin."""

from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QScrollBar, QWidget

from study_app.gui.display.screens import ScreenShown
from study_app.gui.home import dialogs
from study_app.gui.home.dialogs import NewSessionDialog, RehearsalDialog, WorkspaceDialog
from study_app.gui.home.study_facts import study_facts
from study_app.gui.theme.theme import LIGHT
from study_app.gui.widgets.background import Background
from study_app.gui.widgets.controls import ActionButton
from study_app.protocol.load import load
from study_app.protocol.source.files import source_bytes
from study_app.session.start import MAX_SEED
from study_app.store.blinded.blinding import open_or_draw_key
from study_app.store.workstation import MachineSettings
from tests import studies
from tests.gui.windows import SCREENS
from tests.protocol.groups.grouped import GROUPS, STUDY

pytestmark = pytest.mark.slow

# The platform without a screen cannot limit or raise windows, and says so.


@pytest.fixture
def results(tmp_path: Path) -> Path:
    return tmp_path / "results"


@pytest.fixture
def opened(qtbot, results):
    """Return a function that opens the dialog of a study on a machine with these settings."""

    def open_(facts=None, **settings):
        made = NewSessionDialog(facts or study_facts("rek2024"), results, machine=MachineSettings(**settings))
        qtbot.addWidget(made)
        made.open()
        return made

    return open_


@pytest.fixture
def dialog(opened):
    return opened()


def use(results: Path, participant: str, session: int = 1) -> None:
    folder = results / "rek2024" / "data" / f"sub-{participant}" / f"ses-{session:02d}"
    folder.mkdir(parents=True)
    (folder / "checksums.sha256").touch()  # something that comes after a session's beginning


def test_what_another_program_began_meanwhile_is_refused(dialog, results, qtbot):
    settle(qtbot, dialog)
    use(results, "P001")
    dialog.editors["seed"].control.setText("7")
    qtbot.waitUntil(lambda: not dialog.begin.isEnabled())
    assert "already has session 1" in dialog.verdict.text()


def settle(qtbot, dialog):
    """Wait until the folder was read again."""
    qtbot.waitUntil(lambda: not dialog.findChild(Background).busy)


def parts_cut_off(dialog) -> list[QWidget]:
    """Return the parts that are wider than the room they have."""
    shown = [part for part in dialog.findChildren(QWidget) if part.isVisible()]
    return [part for part in shown if part.visibleRegion().boundingRect().width() < part.width()]


def files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*"))


def test_a_free_id_is_suggested(opened, results):
    use(results, "P001")
    use(results, "P004")
    made = opened()
    seed, rehearsed = made.editors["seed"], RehearsalDialog(made.facts, results, parent=made).editors["seed"]
    assert seed.value in range(1, MAX_SEED + 1)
    for number, permitted in ((0, True), (MAX_SEED, True), (MAX_SEED + 1, False)):
        seed.control.setText(str(number))
        assert made.begin.isEnabled() == permitted
    assert (rehearsed.control.minimum(), rehearsed.control.maximum()) == (0, MAX_SEED), "the same in both dialogs"
    seed.control.setText("7")
    assert not made.editors["row_of"].control.isVisible(), "no rows are assigned in this study"
    assert made.editors["windowed"].control.isChecked(), "there is one screen for both windows"
    assert made.editors["participant"].control.text() == "P005"
    assert made.begin.isEnabled()
    assert made.verdict.text() == "The ID P005 can be used for session 1"


@pytest.mark.parametrize("windowed", [False, True])
def test_a_pilot_is_shown_in_a_window_and_the_choice_before_comes_back(dialog, results, windowed):
    box, pilot = dialog.editors["windowed"], dialog.editors["pilot"].control
    box.control.setChecked(windowed)
    for chosen, state, folder in ((True, (True, False), "rek2024-pilot"), (False, (windowed, True), "rek2024")):
        pilot.setChecked(chosen)
        assert (box.value, box.isEnabled()) == state
        assert dialog.chosen().results == results / folder
        assert dialog.chosen().pilot is chosen


def test_a_used_id_offers_its_next_session_and_a_new_participant(opened, results):
    for session in (1, 3):
        use(results, "P001", session)
    made = opened()
    session, participant = made.editors["session"], made.editors["participant"]
    for way, expected in ((0, ("P001", 4)), (1, ("P002", 1))):
        participant.control.setText("P001")
        session.show_value(1)
        assert not made.begin.isEnabled()
        assert [button.text() for button in made.suggestions] == ["Session 4 of P001", "New participant P002"]
        made.suggestions[way].click()
        assert (participant.value, session.value) == expected
        assert made.begin.isEnabled()
        assert not made.suggestions[0].isVisible()


def test_a_results_folder_is_said_to_be_inside_or_outside_the_workspace(opened, tmp_path, monkeypatch):
    for workspace, words in (("", "in the workspace"), ("other", "outside the workspace: Home will not list its")):
        monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path / workspace))
        assert opened().editors["results"].aside.text().startswith(words)


def test_a_falcon_by_its_serial_number_can_be_preferred_and_an_unknown_device_is_the_mouse(opened):
    assert opened(device="falcon:FT123").chosen().device == "falcon:FT123"
    assert opened(device="hammer").chosen().device == "mouse"
    assert opened(device="scripted").chosen().results.name == "rek2024-scripted"


def test_a_study_whose_conditions_were_changed_since_is_refused_with_what_to_do(results, opened):
    facts = study_facts("demo")
    (results / "demo" / "data" / "sub-P001" / "ses-01").mkdir(parents=True)
    (results / "demo" / "data" / "sub-P001" / "ses-01" / "checksums.sha256").touch()
    open_or_draw_key(results / "demo", facts.protocol)
    liquids = facts.protocol.liquids
    unused = next(iter(liquids.values())).model_copy(update={"id": "unused"})
    changed = facts.protocol.model_copy(update={"liquids": {**liquids, "unused": unused}})
    made = opened(replace(facts, protocol=changed))
    assert not made.begin.isEnabled()
    assert "undo that change" in made.verdict.text()
    assert made.editors["participant"].control.text() == "P002"


def test_begin_creates_nothing_by_itself_and_gives_what_was_chosen(dialog, results, qtbot):
    dialog.editors["participant"].control.setText(" P009 ")
    dialog.editors["session"].control.setValue(3)
    dialog.editors["seed"].control.setText("4711")
    dialog.editors["operator"].control.setText("AK")
    dialog.editors["language"].control.setCurrentIndex(dialog.editors["language"].control.findData("nl"))
    dialog.editors["device"].control.setCurrentIndex(dialog.editors["device"].control.findData("scripted"))
    dialog.editors["windowed"].control.setChecked(True)
    with qtbot.waitSignal(dialog.accepted):
        qtbot.mouseClick(dialog.begin, Qt.MouseButton.LeftButton)
    chosen = dialog.chosen()
    assert (chosen.participant, chosen.session, chosen.seed, chosen.operator) == ("P009", 3, 4711, "AK")
    assert (chosen.language, chosen.device, chosen.windowed, chosen.screen) == ("nl", "scripted", True, 1)
    assert chosen.results == results / "rek2024-scripted"
    assert files(results.parent) == []


def test_a_session_begins_with_what_is_set_for_this_machine_unless_its_firmware_is_gone(tmp_path, monkeypatch, opened):
    screens = tuple(
        ScreenShown(
            number=n, name=name, width_px=1920, height_px=1080, refresh_hz=60.0, scaling=1.0, width_mm=0, height_mm=0
        )
        for n, name in ((1, "A"), (2, "B"), (3, "C"))
    )
    monkeypatch.setattr(dialogs, "screens_shown", lambda: screens)
    firmware = tmp_path / "firmware.bin"
    firmware.write_bytes(b"x")
    set_here = {"device": "falcon", "screen": "B", "screen_number": 2, "firmware": str(firmware), "operator": "AK"}
    made = opened(**set_here)
    assert made.chosen().operator == "AK"
    assert made.editors["firmware"].control.isVisible()
    chosen = made.chosen()
    assert (chosen.device, chosen.screen, chosen.device_options) == ("falcon", 2, {"firmware": firmware})
    made.editors["device"].control.setCurrentIndex(made.editors["device"].control.findData("mouse"))
    assert not made.editors["firmware"].control.isVisible()
    assert made.chosen().device_options == {}
    made = opened(device="falcon", firmware=str(tmp_path / "gone.bin"))
    assert not made.begin.isEnabled()
    assert "gone.bin" in made.verdict.text()
    made.editors["firmware"].control.clear()
    assert made.begin.isEnabled()
    assert made.chosen().device_options == {}


def test_a_session_beyond_the_last_is_refused(qtbot, tmp_path, opened):
    source = tmp_path / "grouped.toml"
    source.write_text(
        STUDY.replace("format = 2\n", 'format = 2\nsequences = [["hello", "thin"], ["thick", "end"]]\n'),
        encoding="utf-8",
        newline="\n",
    )
    made = opened(study_facts(str(source)))
    made.editors["session"].control.setValue(2)
    settle(qtbot, made)
    assert made.begin.isEnabled()
    made.editors["session"].control.setValue(3)
    assert not made.begin.isEnabled()
    assert "permitted: 1 to 2" in made.verdict.text()


def test_replaced_participant_is_asked_for_where_rows_are_dealt(qtbot, tmp_path, opened):
    study = tmp_path / "square.toml"
    study.write_text(
        source_bytes("demo").decode().replace('\norder = "shuffled"', '\norder = "latin"'),
        encoding="utf-8",
        newline="\n",
    )
    dialog = opened(study_facts(str(study)))
    settle(qtbot, dialog)
    assert dialog.editors["row_of"].control.isVisible()
    qtbot.waitUntil(lambda: not parts_cut_off(dialog))  # once its height fits its questions
    assert dialog.chosen().row_of is None
    qtbot.keyClicks(dialog.editors["row_of"].control, "P002")
    assert dialog.begin.isEnabled()
    assert dialog.chosen().row_of == "P002"
    assert "order; leave empty" in dialog.editors["row_of"].aside.text()
    dialog.editors["row_of"].control.setText("anna")
    assert "rows are assigned by the number" in dialog.verdict.text()
    assert not dialog.begin.isEnabled()


def grouped(tmp_path: Path, assignment: str) -> Path:
    study = tmp_path / "grouped.toml"
    head = f'study.name = "grouped"\nstudy.group_assignment = "{assignment}"\n'
    study.write_text((STUDY + GROUPS).replace('study.name = "grouped"\n', head), encoding="utf-8", newline="\n")
    return study


def test_a_rehearsal_names_the_groups_across_which_it_distributes_participants(qtbot, tmp_path, results):
    made = RehearsalDialog(study_facts(str(grouped(tmp_path, "pre-existing"))), results)
    qtbot.addWidget(made)
    texts = [shown.text() for shown in made.findChildren(QLabel)]
    assert any("among the groups first_thin and first_thick in the planned ratio." in text for text in texts), texts


def test_a_preexisting_group_is_chosen_before_a_session_begins_and_kept_in_the_next_one(
    qtbot, tmp_path, opened, results
):
    path = grouped(tmp_path, "pre-existing")
    study = load(str(path))
    studies.begun(results / "grouped", "P001", study, path.read_bytes(), group="first_thick").close()
    made = opened(study_facts(str(path)))
    settle(qtbot, made)
    group = made.editors["group"]
    assert group.control.isVisible()
    assert group.value is None
    assert not made.begin.isEnabled()
    assert made.verdict.text() == "Choose the participant's group"
    assert "order and position in the group; leave empty" in made.editors["row_of"].aside.text()
    assert made.verdict.property("role") == "text2", "nothing is wrong yet"
    made.editors["participant"].control.setText("P 3")
    assert made.verdict.property("role") == "bad"
    made.editors["participant"].control.setText("P002")
    qtbot.keyClicks(group.control, "first_thin")
    assert made.begin.isEnabled()
    assert (made.chosen().participant, made.chosen().group) == ("P002", "first_thin")
    made.editors["row_of"].control.setText("P001")
    assert "'P001' in group first_thick cannot be replaced by P002 in group first_thin" in made.verdict.text()
    made.editors["row_of"].control.clear()
    made.editors["participant"].control.setText("P001")
    made.editors["session"].control.setValue(2)
    assert (group.value, group.isEnabled()) == ("first_thick", False)
    assert made.begin.isEnabled()
    made.editors["participant"].control.setText("P003")
    assert (group.value, group.isEnabled()) == (None, True)
    assert not made.begin.isEnabled()


def test_questions_that_scroll_are_not_cut_off_at_the_right(qtbot, tmp_path, opened, monkeypatch):
    monkeypatch.setattr(dialogs, "_FRAME", 400)  # as on a lower screen
    made = opened(study_facts(str(grouped(tmp_path, "pre-existing"))))
    settle(qtbot, made)
    bars = [bar for bar in made.findChildren(QScrollBar) if bar.orientation() == Qt.Orientation.Vertical]
    qtbot.waitUntil(lambda: any(bar.isVisible() for bar in bars))
    seen = [part for part in parts_cut_off(made) if not part.visibleRegion().isEmpty()]
    assert not seen, "wider than the room beside the scroll bar"


def test_a_randomised_group_is_not_asked_for(qtbot, tmp_path, opened):
    made = opened(study_facts(str(grouped(tmp_path, "randomised"))))
    settle(qtbot, made)
    assert not made.editors["group"].control.isVisible()
    assert made.begin.isEnabled()
    assert made.chosen().group is None


def test_each_question_says_what_it_asks_and_what_is_chosen_at_first(opened, monkeypatch, results):
    monkeypatch.setattr(dialogs, "screens_shown", lambda: SCREENS)
    drawn = iter([4711, 77])
    monkeypatch.setattr(dialogs, "draw_seed", lambda: next(drawn))
    made = opened(operator="AK", screen="eDP-1")
    asked = {name: editor.field.label for name, editor in made.editors.items()}
    assert asked.items() >= {
        "participant": "Participant", "session": "Session", "seed": "Seed", "operator": "Operator",
        "language": "Language of the participant's pages", "device": "Device", "screen": "Participant's screen",
        "windowed": "In a window instead of full screen", "pilot": "Pilot: marked with a frame and stored separately",
        "results": "Results folder for this study", "group": "Group", "row_of": "Replaces participant",
        "firmware": "Falcon's firmware",
    }.items()  # fmt: skip
    asides = {name: made.editors[name].aside.text() for name in ("participant", "seed", "group")}
    assert asides == {
        "participant": "letters and digits, not a name", "seed": "determines all random orders and is recorded",
        "group": "recorded as a property of the participant",
    }  # fmt: skip
    chosen = made.chosen()
    assert (chosen.participant, chosen.session, chosen.seed, chosen.operator) == ("P001", 1, 4711, "AK")
    assert (chosen.language, chosen.device, chosen.screen, chosen.windowed, chosen.pilot) == (
        "en",
        "mouse",
        1,
        False,
        False,
    )
    assert (chosen.results, chosen.source) == (results / "rek2024", "rek2024")
    screen = made.editors["screen"].control
    assert [screen.itemText(at) for at in range(screen.count())] == [f"Screen {s.number}: {s.words}" for s in SCREENS]
    languages = made.editors["language"].control
    assert [(languages.itemText(at), languages.itemData(at)) for at in range(2)] == [("English", "en"), ("Dutch", "nl")]
    assert (made.editors["operator"].control.maxLength(), made.editors["operator"].control.placeholderText()) == (
        40, "Initials, such as AK"
    )  # fmt: skip
    limits = made.editors["session"].control
    assert (limits.minimum(), limits.maximum()) == (1, 99)
    texts = [part.text() for part in made.findChildren(QLabel)]
    about = "Feeling simulated liquids  ·  2 parts, 10 settings, 62 answers  ·  about 18 min"
    assert {"New session", about, "Nothing is created until you begin."} <= {*texts}
    participant = made.editors["participant"].control
    assert (made.focusWidget(), participant.selectedText()) == (participant, "P001")
    (redraw,) = (button for button in made.findChildren(ActionButton) if button.text() == "Draw another")
    redraw.click()
    assert made.editors["seed"].value == 77


def test_a_folder_that_was_chosen_stays_whatever_the_device(opened, results, tmp_path):
    made = opened()
    device, folder = made.editors["device"].control, made.editors["results"].control
    for name, shown in (
        ("scripted", "rek2024-scripted"),
        ("falcon", "rek2024"),
        ("falcon-emulated", "rek2024-falcon-emulated"),
    ):
        device.setCurrentIndex(device.findData(name))
        assert folder.text() == str(results / shown)
    folder.setText(str(tmp_path / "mine"))
    for name in ("scripted", "mouse"):
        device.setCurrentIndex(device.findData(name))
    made.editors["pilot"].control.setChecked(True)
    assert made.chosen().results == tmp_path / "mine"
    folder.setText("")
    assert (made.verdict.text(), made.begin.isEnabled()) == ("Choose a results folder", False)


def test_a_verdict_is_sentence_icon_and_colour(opened):
    made = opened()
    looks = [(made.verdict.property("role"), made.verdict_icon.name, made.verdict_icon.ink)]
    made.editors["seed"].control.setText("-1")
    looks.append((made.verdict.property("role"), made.verdict_icon.name, made.verdict_icon.ink))
    assert looks == [("ok", "check", "ok"), ("bad", "warning", "bad")]
    assert made.verdict.text().startswith("The seed must be a whole number from 0 to")
    with pytest.raises(ValueError, match="the seed must be a whole number"):
        made.chosen()


def test_the_suggested_workspace_can_be_changed_but_not_left_out(qtbot, tmp_path):
    parent = QWidget()
    qtbot.addWidget(parent)
    dialog = WorkspaceDialog(parent, LIGHT, tmp_path / "offered")
    assert (dialog.windowTitle(), dialog.go_on.text(), dialog.back.text()) == (
        "Choose your workspace", "Use this folder", "Not now"
    )  # fmt: skip
    assert (dialog.folder, dialog.isModal(), dialog.path.field.label) == (
        tmp_path / "offered",
        True,
        "Workspace folder",
    )
    assert dialog.path.below.text() == "The workspace will contain the folders protocols and results."
    dialog.show()
    dialog.path.control.setText("")
    dialog.go_on.click()
    assert (dialog.isVisible(), dialog.missing.text()) == (True, "Please choose a folder.")
    dialog.path.control.setText("~/mine")
    with qtbot.waitSignal(dialog.accepted):
        dialog.go_on.click()
    assert dialog.folder == Path.home() / "mine"
    assert list(tmp_path.iterdir()) == []
