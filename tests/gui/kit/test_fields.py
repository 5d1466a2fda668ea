"""Forms built from descriptions: display, input and signals of each kind of field; questions with fields."""

from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QLabel, QWidget

from study_app.gui.kit.dialogs import Question, Work, choose_protocol
from study_app.gui.kit.fields import Editor, Field, choice_field, number_field, seed_field, typed_file
from study_app.gui.theme.theme import LIGHT
from study_app.gui.widgets.controls import ActionButton, Check, Toggle

ENTER, ESCAPE = Qt.Key.Key_Return, Qt.Key.Key_Escape
SIZES = {"s": "Small", "m": "Medium", "l": "Large"}


class Heard:
    """An editor and its recorded signals."""

    def __init__(self, qtbot: Any, field: Field, **options: Any) -> None:
        self.qtbot, self.editor = qtbot, Editor(field, **options)
        qtbot.addWidget(self.editor)
        self.editor.show()
        self.control: Any = self.editor.control
        self.changed: list[tuple[str, Any]] = []
        self.edited: list[str] = []
        self.editor.changed.connect(lambda *change: self.changed.append(change))
        self.editor.edited.connect(self.edited.append)

    def type(self, text: str, key: Qt.Key = ENTER) -> None:
        self.control.selectAll()
        self.qtbot.keyClicks(self.control, text) if text else self.qtbot.keyClick(self.control, Qt.Key.Key_Delete)
        self.qtbot.keyClick(self.control, key)


def test_a_number_is_accepted_within_its_limits_and_shown_with_its_decimals(qtbot: Any) -> None:
    heard = Heard(qtbot, number_field("mean", "Mean", "ms", (0.5, 500.0), 2))
    editor, below = heard.editor, heard.editor.below
    assert heard.control.accessibleName() == "Mean in ms"
    assert [part.text() for part in editor.findChildren(QLabel)][:2] == ["Mean", "ms"]
    editor.show_value(23.456, "Measured today.")
    assert (heard.control.text(), editor.value, below.text()) == ("23.46", 23.46, "Measured today.")
    assert heard.changed == []
    permitted = "A number from 0.5 to 500 ms; leave empty if unknown."
    two = "“2,500” can be read as 2.5 or 2500: write 2.5 or 2500."
    for typed, refusal in (("0.4", permitted), ("501", permitted), ("ten", permitted), ("2,500", two)):
        heard.type(typed)
        assert (below.text(), below.property("role"), heard.control.property("state")) == (refusal, "bad", "refused")
        with pytest.raises(ValueError, match=refusal[:10]):
            _ = editor.value
    assert heard.changed == []
    editor.show_value(7.0)
    assert heard.control.text() == "2,500", "it is being typed"
    heard.qtbot.keyClick(heard.control, ESCAPE)
    assert (heard.control.text(), below.isHidden(), below.property("role")) == ("7", True, "text2")
    assert (heard.control.cursorPosition(), heard.control.property("dense")) == (0, "true")
    for typed in ("0.5", "500", "1,5", ""):
        heard.type(typed)
        qtbot.keyClick(heard.control, ENTER)
    assert heard.changed == [("mean", 0.5), ("mean", 500.0), ("mean", 1.5), ("mean", None)]
    heard.type("ten")
    heard.type("7")
    assert (below.isHidden(), heard.control.property("state")) == (True, "")
    needed = Heard(qtbot, number_field("mean", "Mean", "ms", (0.5, 500.0), may_miss=False))
    needed.editor.show_value(1.26)
    assert needed.control.text() == "1.3"
    needed.type("")
    assert (needed.changed, needed.editor.below.text()) == ([], "A number from 0.5 to 500 ms.")


def test_a_choice_hands_on_the_value_of_the_chosen_label(qtbot: Any) -> None:
    heard = Heard(qtbot, choice_field("size", "Size", SIZES, "as ordered"))
    editor = heard.editor
    assert [heard.control.itemText(at) for at in range(heard.control.count())] == [*SIZES.values()]
    assert (editor.value, editor.aside.text(), editor.field.label) == ("s", "as ordered", "Size")
    editor.show_value("l")
    assert (heard.control.currentText(), heard.edited, heard.changed) == ("Large", ["size"], [])
    qtbot.keyClick(heard.control, Qt.Key.Key_Up)
    assert (editor.value, heard.changed, heard.edited) == ("m", [("size", "m")], ["size"] * 2)
    editor.show_value("xxl")
    assert editor.value is None
    editor.show_options({1: "One", 2: "Two"})
    assert (editor.value, heard.control.currentText(), heard.control.count()) == (1, "One", 2)


def test_buttons_of_a_field_choose_one_of_some_values_or_switch_one(qtbot: Any) -> None:
    radios = Heard(qtbot, Field("size", "Size", "radio", tuple(SIZES.items())))
    buttons = radios.control.group.buttons()
    assert ([button.text() for button in buttons], radios.editor.value) == ([*SIZES.values()], "s")
    buttons[2].click()
    assert radios.editor.value == "l"
    for kind, control in (("switch", Toggle), ("check", Check)):
        heard = Heard(qtbot, Field("dark", "Dark", kind, hint="At night."))
        heard.editor.show_value(True)
        assert type(heard.control) is control
        assert (heard.editor.value, heard.changed, heard.edited) == (True, [], ["dark"])
        heard.control.click()
        assert (heard.editor.value, heard.changed, heard.edited) == (False, [("dark", False)], ["dark"] * 2)
        assert (heard.control.text(), heard.editor.below.text()) == ("Dark", "At night.")


def test_a_count_keeps_to_its_limits_and_a_line_to_its_length(qtbot: Any) -> None:
    count = Heard(qtbot, Field("people", "People", "count", limits=(2, 30)))
    assert (count.control.minimum(), count.control.maximum(), count.editor.value) == (2, 30, 2)
    count.editor.show_value(17)
    assert (count.editor.value, count.edited) == (17, ["people"])
    count.control.lineEdit().setText("2.5")
    with pytest.raises(ValueError, match=r"\.$"):
        _ = count.editor.value
    line = Heard(qtbot, Field("name", "Name", longest=3, placeholder="Initials", parse=str.upper))
    line.type(" abcdef")
    assert (line.changed, line.control.placeholderText()) == ([("name", "AB")], "Initials")
    assert line.edited == ["name"] * 3
    judged = Heard(qtbot, seed_field("random"), judges=True)
    judged.type("-1")
    assert (judged.changed, judged.editor.below.isHidden(), judged.editor.aside.text()) == ([], True, "random")
    judged.type("42")
    assert judged.changed == [("seed", 42)]
    judged.control.setText(str(2**64))
    with pytest.raises(ValueError, match="the seed must be a whole number from 0 to"):
        _ = judged.editor.value


@pytest.mark.parametrize(("kind", "button"), [("file", "Choose…"), ("folder", "Change…")])
def test_a_path_is_chosen_by_its_button(qtbot: Any, monkeypatch: pytest.MonkeyPatch, kind: Any, button: str) -> None:
    dialogs, chosen = [], iter(["", str(Path("/new"))])
    for name, answer in (("getOpenFileName", lambda path: (path, "")), ("getExistingDirectory", str)):
        monkeypatch.setattr(
            QFileDialog,
            name,
            lambda *arguments, name=name, answer=answer: dialogs.append((name, *arguments[1:])) or answer(next(chosen)),
        )
    heard = Heard(qtbot, Field("path", "Firmware", kind, file_filter="Binaries (*.bin)"))
    heard.editor.show_value("/old")
    (choose,) = heard.editor.findChildren(ActionButton)
    assert choose.text() == button
    choose.click()
    assert (heard.control.text(), heard.changed) == ("/old", [])
    choose.click()
    assert (heard.control.text(), heard.changed) == (str(Path("/new")), [("path", str(Path("/new")))])
    words = ("getOpenFileName", "Firmware", "/old", "Binaries (*.bin)")
    assert dialogs == [words if kind == "file" else ("getExistingDirectory", *words[1:3])] * 2


def test_a_typed_file_must_be_there(tmp_path: Path) -> None:
    file = tmp_path / "f.bin"
    file.touch()
    assert (typed_file("firmware", ""), typed_file("firmware", str(file))) == (None, file)
    for path in (tmp_path, tmp_path / "gone.bin"):
        with pytest.raises(ValueError, match=rf"firmware was not found at .*{path.name}"):
            typed_file("firmware", str(path))


@pytest.fixture
def parent(qtbot: Any) -> QWidget:
    widget = QWidget()
    qtbot.addWidget(widget)
    widget.show()
    return widget


def test_a_question_stays_open_until_its_required_fields_are_filled(qtbot: Any, parent: QWidget) -> None:
    seed, reason = seed_field(), Field("reason", "Reason")
    other = ActionButton("", "Diagnose")
    dialog = Question(
        parent, LIGHT, "End?", "It stops.", ActionButton("", "End"), back="Not now", other=other,
        fields=(seed, reason), needs={"reason": "Please enter a reason."}, warning="No way back.", width=555,
    )  # fmt: skip
    dialog.show()
    texts = [part.text() for part in dialog.findChildren(QLabel) if part.isVisible()]
    assert [text for text in texts if text][:3] == ["End?", "It stops.", "No way back."]
    assert (dialog.windowTitle(), dialog.back.text(), dialog.minimumWidth()) == ("End?", "Not now", 555)
    dialog.editors["seed"].control.setFocus()
    qtbot.keyClicks(dialog.editors["seed"].control, "seven")
    dialog.editors["reason"].control.setFocus()
    assert dialog.editors["seed"].below.isHidden()
    dialog.go_on.click()
    assert dialog.editors["seed"].below.text().startswith("the seed must be")
    assert (dialog.isVisible(), dialog.focusWidget(), dialog.missing.isHidden()) == (
        True, dialog.editors["seed"].control, True,
    )  # fmt: skip
    dialog.editors["seed"].control.setText("7")
    dialog.go_on.click()
    assert (dialog.missing.text(), dialog.missing.isVisible()) == ("Please enter a reason.", True)
    assert (dialog.isVisible(), dialog.focusWidget()) == (True, dialog.editors["reason"].control)
    dialog.editors["reason"].control.setText("late")
    with qtbot.waitSignal(dialog.accepted):
        dialog.go_on.click()
    assert (dialog.value("seed"), dialog.value("reason"), dialog.missing.isHidden()) == (7, "late", True)
    for button in (dialog.back, other):
        dialog.show()
        with qtbot.waitSignal(dialog.rejected):
            button.click()
    notice = Question(parent, LIGHT, "Saved", "It is there.")
    assert (notice.go_on.text(), notice.back.isHidden(), notice.isModal()) == ("Close", True, False)
    assert notice.go_on.isDefault()


def test_work_is_shown_until_it_ends_is_refused_or_stops(qtbot: Any, parent: QWidget) -> None:
    dialog, heard = Work(parent, LIGHT, "Export", "What?", ActionButton("", "Write"), fields=(Field("a", "A"),)), []
    for name in ("begun", "stop_asked", "opened", "rejected"):
        getattr(dialog, name).connect(lambda name=name: heard.append(name))
    dialog.show()
    field = dialog.editors["a"]
    assert (dialog.isModal(), dialog.bar.isHidden(), dialog.working, dialog.over) == (True, True, False, False)
    dialog.go_on.click()
    dialog.accept()
    assert (heard, dialog.said.text()) == (["begun"], "Beginning…")
    assert [part.isHidden() for part in (field, dialog.go_on, dialog.bar)] == [True, True, False]
    assert dialog.bar.maximum() == 0
    dialog.show_progress("1 of 4", 0.25)
    assert (dialog.said.text(), dialog.bar.maximum(), dialog.bar.value()) == ("1 of 4", 1000, 250)
    dialog.show_refused("The disk is full.")
    assert (dialog.said.text(), dialog.said.property("role"), dialog.working) == ("The disk is full.", "bad", False)
    assert [part.isHidden() for part in (field, dialog.go_on, dialog.bar)] == [False, False, True]
    dialog.go_on.click()
    assert (heard, dialog.said.property("role")) == (["begun"] * 2, "text2")
    dialog.back.click()
    dialog.reject()
    assert (heard[2:], dialog.said.text(), dialog.back.isEnabled()) == (["stop_asked"], "Stopping…", False)
    dialog.show_done("Written.", "Open")
    assert (dialog.go_on.text(), dialog.back.text(), dialog.back.isEnabled()) == ("Open", "Close", True)
    assert (dialog.said.text(), dialog.bar.isHidden(), dialog.go_on.isHidden()) == ("Written.", True, False)
    dialog.go_on.click()
    assert heard[3:] == ["opened"]
    dialog.over = False
    dialog.go_on.click()
    dialog.close_stopped()
    assert (heard[4:], dialog.isVisible(), dialog.working) == (["begun", "rejected"], False, False)
    dialog.show()
    dialog.back.click()
    assert (heard[6:], dialog.isVisible()) == (["rejected"], False)


def test_a_protocol_is_chosen_in_the_workspace(parent: QWidget, tmp_path: Path, monkeypatch: Any) -> None:
    calls: list[Any] = []
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    monkeypatch.setattr(
        QFileDialog, "getOpenFileName", lambda *arguments: calls.append(arguments) or ("/a.toml", "filter")
    )
    assert choose_protocol(parent, "Open") == "/a.toml"
    assert calls == [(parent, "Open", str(tmp_path / "protocols"), "Protocols (*.toml)")]
