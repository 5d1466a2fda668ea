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
def open_dialog(qtbot, results):
    """Return a function that opens the dialog of a study on a machine with these settings."""

    def open_(facts=None, **settings):
        dialog = NewSessionDialog(facts or study_facts("rek2024"), results, machine=MachineSettings(**settings))
        qtbot.addWidget(dialog)
        dialog.open()
        return dialog

    return open_


@pytest.fixture
def dialog(open_dialog):
    return open_dialog()


def use(results: Path, participant: str, session: int = 1) -> None:
    folder = results / "rek2024" / "data" / f"sub-{participant}" / f"ses-{session:02d}"
    folder.mkdir(parents=True)
    (folder / "checksums.sha256").touch()  # something that comes after a session's beginning


def test_a_session_begun_by_another_program_is_refused(dialog, results, qtbot):
    settle(qtbot, dialog)
    use(results, "P001")
    dialog.editors["seed"].control.setText("7")
    qtbot.waitUntil(lambda: not dialog.begin.isEnabled())
    assert "already has session 1" in dialog.verdict.text()


def settle(qtbot, dialog):
    """Wait until the folder has been read again."""
    qtbot.waitUntil(lambda: not dialog.findChild(Background).busy)


def parts_cut_off(dialog) -> list[QWidget]:
    """Return the widgets that are wider than their visible area."""
    visible = [part for part in dialog.findChildren(QWidget) if part.isVisible()]
    return [part for part in visible if part.visibleRegion().boundingRect().width() < part.width()]


def files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*"))


def test_a_free_id_is_suggested(open_dialog, results):
    use(results, "P001")
    use(results, "P004")
    dialog = open_dialog()
    seed, rehearsed = dialog.editors["seed"], RehearsalDialog(dialog.facts, results, parent=dialog).editors["seed"]
    assert seed.value in range(1, MAX_SEED + 1)
    for number, permitted in ((0, True), (MAX_SEED, True), (MAX_SEED + 1, False)):
        seed.control.setText(str(number))
        assert dialog.begin.isEnabled() == permitted
    assert (rehearsed.control.minimum(), rehearsed.control.maximum()) == (0, MAX_SEED), "the same in both dialogs"
    seed.control.setText("7")
    assert not dialog.editors["row_of"].control.isVisible(), "no rows are assigned in this study"
    assert dialog.editors["windowed"].control.isChecked(), "there is one screen for both windows"
    assert dialog.editors["participant"].control.text() == "P005"
    assert dialog.begin.isEnabled()
    assert dialog.verdict.text() == "The ID P005 can be used for session 1"


@pytest.mark.parametrize("windowed", [False, True])
def test_a_pilot_is_shown_in_a_window_and_the_choice_before_comes_back(dialog, results, windowed):
    box, pilot = dialog.editors["windowed"], dialog.editors["pilot"].control
    box.control.setChecked(windowed)
    for chosen, state, folder in ((True, (True, False), "rek2024-pilot"), (False, (windowed, True), "rek2024")):
        pilot.setChecked(chosen)
        assert (box.value, box.isEnabled()) == state
        assert dialog.chosen().results == results / folder
        assert dialog.chosen().pilot is chosen


def test_a_used_id_offers_its_next_session_and_a_new_participant(open_dialog, results):
    for session in (1, 3):
        use(results, "P001", session)
    dialog = open_dialog()
    session, participant = dialog.editors["session"], dialog.editors["participant"]
    for way, expected in ((0, ("P001", 4)), (1, ("P002", 1))):
        participant.control.setText("P001")
        session.show_value(1)
        assert not dialog.begin.isEnabled()
        assert [button.text() for button in dialog.suggestions] == ["Session 4 of P001", "New participant P002"]
        dialog.suggestions[way].click()
        assert (participant.value, session.value) == expected
        assert dialog.begin.isEnabled()
        assert not dialog.suggestions[0].isVisible()


def test_a_note_states_whether_the_results_folder_is_in_the_workspace(open_dialog, tmp_path, monkeypatch):
    for workspace, words in (("", "in the workspace"), ("other", "outside the workspace: Home will not list its")):
        monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path / workspace))
        assert open_dialog().editors["results"].aside.text().startswith(words)


def test_a_falcon_by_its_serial_number_can_be_preferred_and_an_unknown_device_is_the_mouse(open_dialog):
    assert open_dialog(device="falcon:FT123").chosen().device == "falcon:FT123"
    assert open_dialog(device="hammer").chosen().device == "mouse"
    assert open_dialog(device="scripted").chosen().results.name == "rek2024-scripted"


def test_a_study_with_changed_conditions_is_refused_with_advice(results, open_dialog):
    facts = study_facts("demo")
    (results / "demo" / "data" / "sub-P001" / "ses-01").mkdir(parents=True)
    (results / "demo" / "data" / "sub-P001" / "ses-01" / "checksums.sha256").touch()
    open_or_draw_key(results / "demo", facts.protocol)
    liquids = facts.protocol.liquids
    unused = next(iter(liquids.values())).model_copy(update={"id": "unused"})
    changed = facts.protocol.model_copy(update={"liquids": {**liquids, "unused": unused}})
    dialog = open_dialog(replace(facts, protocol=changed))
    assert not dialog.begin.isEnabled()
    assert "undo that change" in dialog.verdict.text()
    assert dialog.editors["participant"].control.text() == "P002"


def test_begin_creates_no_file_and_returns_the_choices(dialog, results, qtbot):
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


def test_a_session_begins_with_the_settings_of_this_machine_unless_its_firmware_is_missing(
    tmp_path, monkeypatch, open_dialog
):
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
    dialog = open_dialog(**set_here)
    assert dialog.chosen().operator == "AK"
    assert dialog.editors["firmware"].control.isVisible()
    chosen = dialog.chosen()
    assert (chosen.device, chosen.screen, chosen.device_options) == ("falcon", 2, {"firmware": firmware})
    dialog.editors["device"].control.setCurrentIndex(dialog.editors["device"].control.findData("mouse"))
    assert not dialog.editors["firmware"].control.isVisible()
    assert dialog.chosen().device_options == {}
    dialog = open_dialog(device="falcon", firmware=str(tmp_path / "gone.bin"))
    assert not dialog.begin.isEnabled()
    assert "gone.bin" in dialog.verdict.text()
    dialog.editors["firmware"].control.clear()
    assert dialog.begin.isEnabled()
    assert dialog.chosen().device_options == {}


def test_a_session_beyond_the_last_is_refused(qtbot, tmp_path, open_dialog):
    source = tmp_path / "grouped.toml"
    source.write_text(
        STUDY.replace("format = 2\n", 'format = 2\nsequences = [["hello", "thin"], ["thick", "end"]]\n'),
        encoding="utf-8",
        newline="\n",
    )
    dialog = open_dialog(study_facts(str(source)))
    dialog.editors["session"].control.setValue(2)
    settle(qtbot, dialog)
    assert dialog.begin.isEnabled()
    dialog.editors["session"].control.setValue(3)
    assert not dialog.begin.isEnabled()
    assert "permitted: 1 to 2" in dialog.verdict.text()


def test_the_replaced_participant_is_requested_if_rows_are_assigned(qtbot, tmp_path, open_dialog):
    study = tmp_path / "square.toml"
    study.write_text(
        source_bytes("demo").decode().replace('\norder = "shuffled"', '\norder = "latin"'),
        encoding="utf-8",
        newline="\n",
    )
    dialog = open_dialog(study_facts(str(study)))
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


def write_grouped_study(tmp_path: Path, assignment: str) -> Path:
    study = tmp_path / "grouped.toml"
    head = f'study.name = "grouped"\nstudy.group_assignment = "{assignment}"\n'
    study.write_text((STUDY + GROUPS).replace('study.name = "grouped"\n', head), encoding="utf-8", newline="\n")
    return study


def test_a_rehearsal_names_the_groups_across_which_it_distributes_participants(qtbot, tmp_path, results):
    dialog = RehearsalDialog(study_facts(str(write_grouped_study(tmp_path, "pre-existing"))), results)
    qtbot.addWidget(dialog)
    texts = [label.text() for label in dialog.findChildren(QLabel)]
    assert any("among the groups first_thin and first_thick in the planned ratio." in text for text in texts), texts


def test_a_preexisting_group_is_chosen_before_a_session_begins_and_kept_in_the_next_one(
    qtbot, tmp_path, open_dialog, results
):
    path = write_grouped_study(tmp_path, "pre-existing")
    study = load(str(path))
    studies.begun(results / "grouped", "P001", study, path.read_bytes(), group="first_thick").close()
    dialog = open_dialog(study_facts(str(path)))
    settle(qtbot, dialog)
    group = dialog.editors["group"]
    assert group.control.isVisible()
    assert group.value is None
    assert not dialog.begin.isEnabled()
    assert dialog.verdict.text() == "Choose the participant's group"
    assert "order and position in the group; leave empty" in dialog.editors["row_of"].aside.text()
    assert dialog.verdict.property("role") == "text2", "nothing is wrong yet"
    dialog.editors["participant"].control.setText("P 3")
    assert dialog.verdict.property("role") == "bad"
    dialog.editors["participant"].control.setText("P002")
    qtbot.keyClicks(group.control, "first_thin")
    assert dialog.begin.isEnabled()
    assert (dialog.chosen().participant, dialog.chosen().group) == ("P002", "first_thin")
    dialog.editors["row_of"].control.setText("P001")
    assert "'P001' in group first_thick cannot be replaced by P002 in group first_thin" in dialog.verdict.text()
    dialog.editors["row_of"].control.clear()
    dialog.editors["participant"].control.setText("P001")
    dialog.editors["session"].control.setValue(2)
    assert (group.value, group.isEnabled()) == ("first_thick", False)
    assert dialog.begin.isEnabled()
    dialog.editors["participant"].control.setText("P003")
    assert (group.value, group.isEnabled()) == (None, True)
    assert not dialog.begin.isEnabled()


def test_questions_that_scroll_are_not_cut_off_at_the_right(qtbot, tmp_path, open_dialog, monkeypatch):
    monkeypatch.setattr(dialogs, "_FRAME", 400)  # as on a lower screen
    dialog = open_dialog(study_facts(str(write_grouped_study(tmp_path, "pre-existing"))))
    settle(qtbot, dialog)
    bars = [bar for bar in dialog.findChildren(QScrollBar) if bar.orientation() == Qt.Orientation.Vertical]
    qtbot.waitUntil(lambda: any(bar.isVisible() for bar in bars))
    cut_off = [part for part in parts_cut_off(dialog) if not part.visibleRegion().isEmpty()]
    assert not cut_off, "wider than the room beside the scroll bar"


def test_a_randomised_group_is_not_requested(qtbot, tmp_path, open_dialog):
    dialog = open_dialog(study_facts(str(write_grouped_study(tmp_path, "randomised"))))
    settle(qtbot, dialog)
    assert not dialog.editors["group"].control.isVisible()
    assert dialog.begin.isEnabled()
    assert dialog.chosen().group is None


def test_each_question_has_its_label_and_default(open_dialog, monkeypatch, results):
    monkeypatch.setattr(dialogs, "screens_shown", lambda: SCREENS)
    drawn = iter([4711, 77])
    monkeypatch.setattr(dialogs, "draw_seed", lambda: next(drawn))
    dialog = open_dialog(operator="AK", screen="eDP-1")
    labels = {name: editor.field.label for name, editor in dialog.editors.items()}
    assert labels.items() >= {
        "participant": "Participant", "session": "Session", "seed": "Seed", "operator": "Operator",
        "language": "Language of the participant's pages", "device": "Device", "screen": "Participant's screen",
        "windowed": "In a window instead of full screen", "pilot": "Pilot: marked with a frame and stored separately",
        "results": "Results folder for this study", "group": "Group", "row_of": "Replaces participant",
        "firmware": "Falcon's firmware",
    }.items()  # fmt: skip
    asides = {name: dialog.editors[name].aside.text() for name in ("participant", "seed", "group")}
    assert asides == {
        "participant": "letters and digits, not a name", "seed": "determines all random orders and is recorded",
        "group": "recorded as a property of the participant",
    }  # fmt: skip
    chosen = dialog.chosen()
    assert (chosen.participant, chosen.session, chosen.seed, chosen.operator) == ("P001", 1, 4711, "AK")
    assert (chosen.language, chosen.device, chosen.screen, chosen.windowed, chosen.pilot) == (
        "en",
        "mouse",
        1,
        False,
        False,
    )
    assert (chosen.results, chosen.source) == (results / "rek2024", "rek2024")
    screen = dialog.editors["screen"].control
    assert [screen.itemText(at) for at in range(screen.count())] == [f"Screen {s.number}: {s.words}" for s in SCREENS]
    languages = dialog.editors["language"].control
    assert [(languages.itemText(at), languages.itemData(at)) for at in range(2)] == [("English", "en"), ("Dutch", "nl")]
    assert (dialog.editors["operator"].control.maxLength(), dialog.editors["operator"].control.placeholderText()) == (
        40, "Initials, such as AK"
    )  # fmt: skip
    limits = dialog.editors["session"].control
    assert (limits.minimum(), limits.maximum()) == (1, 99)
    texts = [part.text() for part in dialog.findChildren(QLabel)]
    about = "Feeling simulated liquids  ·  2 parts, 10 settings, 62 answers  ·  about 18 min"
    assert {"New session", about, "Nothing is created until you begin."} <= {*texts}
    participant = dialog.editors["participant"].control
    assert (dialog.focusWidget(), participant.selectedText()) == (participant, "P001")
    (redraw,) = (button for button in dialog.findChildren(ActionButton) if button.text() == "Draw another")
    redraw.click()
    assert dialog.editors["seed"].value == 77


def test_a_folder_that_was_chosen_stays_whatever_the_device(open_dialog, results, tmp_path):
    dialog = open_dialog()
    device, folder = dialog.editors["device"].control, dialog.editors["results"].control
    for name, folder_name in (
        ("scripted", "rek2024-scripted"),
        ("falcon", "rek2024"),
        ("falcon-emulated", "rek2024-falcon-emulated"),
    ):
        device.setCurrentIndex(device.findData(name))
        assert folder.text() == str(results / folder_name)
    folder.setText(str(tmp_path / "mine"))
    for name in ("scripted", "mouse"):
        device.setCurrentIndex(device.findData(name))
    dialog.editors["pilot"].control.setChecked(True)
    assert dialog.chosen().results == tmp_path / "mine"
    folder.setText("")
    assert (dialog.verdict.text(), dialog.begin.isEnabled()) == ("Choose a results folder", False)


def test_a_verdict_is_sentence_icon_and_colour(open_dialog):
    dialog = open_dialog()
    looks = [(dialog.verdict.property("role"), dialog.verdict_icon.name, dialog.verdict_icon.ink)]
    dialog.editors["seed"].control.setText("-1")
    looks.append((dialog.verdict.property("role"), dialog.verdict_icon.name, dialog.verdict_icon.ink))
    assert looks == [("ok", "check", "ok"), ("bad", "warning", "bad")]
    assert dialog.verdict.text().startswith("The seed must be a whole number from 0 to")
    with pytest.raises(ValueError, match="the seed must be a whole number"):
        dialog.chosen()


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
