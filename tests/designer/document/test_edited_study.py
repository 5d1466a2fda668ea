"""An edited study: its document and faults are those of its text, in a trial too; undo, redo, and what is refused."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from study_app.designer.document.document import Document
from study_app.designer.document.fields import rows
from study_app.designer.document.study import read
from study_app.designer.document.toml_edits import Duplicate, Edit, Insert, Move, Rename, Set, Unset
from study_app.designer.document.toml_text import Refused
from study_app.errors import ProtocolError
from study_app.protocol.load import load, parse
from study_app.protocol.source.files import shipped
from tests.designer.document.grown import PROTOCOLS

DEMO = read((PROTOCOLS / "demo.toml").read_bytes())


@pytest.mark.parametrize("name", shipped())
def test_a_study_is_what_check_reads(name: str) -> None:
    study = read((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS)
    assert study.protocol == load(name)
    assert study.problems == ()


@pytest.mark.parametrize(("old", "new"), [('liquid = "thin"', 'liquid = "thn"'), ("format = 1", "format = ")])
def test_problems_are_those_of_check(old: str, new: str) -> None:
    source = DEMO.text.replace(old, new).encode()
    with pytest.raises(ProtocolError) as raised:
        parse(source, "demo")
    assert read(source).problems == raised.value.problems


def test_undo_and_redo_restore_text_and_selection() -> None:
    opened = Document(DEMO, ("liquids", "thin"))
    opened.undo()
    opened.redo()
    found = [(DEMO.text, ("liquids", "thin"))]
    for words, edit, select in (
        ("Change the title", Set(("study", "title"), "New"), ("study",)), ("Remove the limits", Unset(("limits",)), ()),
    ):  # fmt: skip
        opened.edit(words, edit, select=select)
        found.append((opened.study.text, opened.selected))
    for at in (1, 0):
        opened.undo()
        assert (opened.study.text, opened.selected) == found[at]
    for at in (1, 2):
        opened.redo()
        assert (opened.study.text, opened.selected) == found[at]
    opened.undo()
    opened.edit("Other", Set(("study", "title"), "Other"))
    assert ([step.words for step in opened.done], opened.undone) == (["Change the title", "Other"], [])


def test_steps_of_one_key_join_until_the_keyboard_rests(monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = 0.0
    monkeypatch.setattr("study_app.designer.document.document.time", SimpleNamespace(monotonic=lambda: now_s))
    opened = Document(DEMO)
    for now_s, key in ((1.0, "title"), (1.5, "title"), (3.0, "title"), (3.1, "other"), (3.2, None), (3.3, None)):
        opened.edit("Type", Set(("study", "title"), f"New at {now_s}"), key=key)
    assert len(opened.done) == 5
    for _ in range(5):
        opened.undo()
    assert opened.study.text == DEMO.text


def test_a_step_that_changes_nothing_is_none() -> None:
    same = Document(DEMO, ())
    same.edit("Same", Set(("format",), 1), select=("study",))
    assert (same.done, same.selected) == ([], ("study",))


def test_a_text_that_is_not_toml_keeps_its_last_document_and_is_typed_on() -> None:
    broken = Document(DEMO)
    broken.edit("Type", text=DEMO.text.replace("format = 1", "format = "))
    assert not broken.study.is_toml
    assert broken.study.document == DEMO.document
    assert "not TOML" in broken.study.problems[0].message
    with pytest.raises(Refused, match="correct its text first"):
        broken.edit("Change", Set(("format",), 2))
    assert len(broken.done) == 1
    broken.edit("Type", text=DEMO.text)
    assert broken.study.protocol == DEMO.protocol
    broken.undo()
    broken.undo()
    assert broken.study.text == DEMO.text


def test_a_study_with_a_liquid_file_shows_its_own_text_alone(tmp_path: Path) -> None:
    (tmp_path / "thick.toml").write_text("[liquids.any]\ndensity_kg_m3 = 1400\n")
    own = '[liquids.thick]\ndensity_kg_m3 = 1400\neffects = ["drag"]'
    text = DEMO.text.replace(own, '[liquids.thick]\nfile = "thick.toml"')
    study = read(text.encode(), tmp_path)
    assert study.protocol is not None
    assert set(study.document) == set(DEMO.document)
    assert study.document["liquids"]["thick"] == {"file": "thick.toml"}
    assert not [row for row in rows(study.document, ("liquids", "thick")) if row.kind == "unknown"]


def test_typed_refuses_half_a_character() -> None:
    with pytest.raises(Refused, match="half a character"):
        DEMO.typed(DEMO.text + "# \ud800")


def test_read_refuses_what_is_not_utf_8() -> None:
    with pytest.raises(Refused, match="line 2 is not UTF-8 text"):
        read(b"a = 1\nb = '\xff'\n")


BLOCK = ("blocks", "delays", "conditions")
EDITS: tuple[Edit, ...] = (
    Set(("conditions", "water", "delay_ms"), 5000),
    Duplicate(("conditions", "water"), "sea"),
    Insert((*BLOCK, 1), "sea"),
    Move((*BLOCK, 1), 3),
    Rename(("conditions", "delay_50"), "late", ((*BLOCK, 1),)),
    Unset((*BLOCK, 4)),
    Set(("liquids", "brine"), {"density_kg_m3": 1200, "effects": ["drag"], "wake": {"length": 40}}),
    Unset(("study", "title")),
)


@pytest.mark.slow
def test_a_trial_has_the_document_and_the_faults_of_the_text() -> None:
    study = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    tried = study.trial
    for edit in EDITS:
        written, (tried, _) = study.edited(edit)[0], tried.edited(edit)
        assert tried.document == written.document
        assert tried.faults == written.faults
        study = written
    assert study.faults


def test_an_edit_that_makes_no_sense_is_refused_and_so_is_a_text_that_is_not_toml() -> None:
    study = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    with pytest.raises(Refused):
        study.trial.edited(Unset(("liquids", "tar")))
    with pytest.raises(Refused):
        _ = study.typed("[")[0].trial
