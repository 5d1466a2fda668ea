"""Messages about actions that are not possible, and about what happened elsewhere: title, reason and consequence."""

import re
from collections.abc import Callable
from typing import Any

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.header import NEW, OPEN
from study_app.designer.measures.cards import Segment, _Strip
from study_app.lab.ab_comparison import Setting
from study_app.store.versions.drafts import Draft, write_draft
from study_app.store.versions.study_versions import content_hash

pytestmark = pytest.mark.slow
THIN, THICK = ("liquids", "thin"), ("liquids", "thick")


def edit(designer: Any, *edits: Any) -> None:
    designer.editing.make_step("Change", *edits)


def test_a_block_is_opened_in_the_lab_as_its_first_and_second_liquid(designer: Any) -> None:
    requests: list[Any] = []
    feeling = designer.controller.feeling
    feeling.asked.connect(requests.append)
    designer.open()
    edit(designer, Set(("blocks", "liquids", "conditions"), ["thick", "thin"]))
    for path in (("blocks", "liquids"), ("conditions", "late"), THICK):
        feeling.feel_liquids(path)
    settings = [(liquids.a.name, liquids.b.name, liquids.study) for liquids in requests]
    assert settings == [("Thick", "Thin", "kitchen"), ("Thin", "Thin", "kitchen"), ("Thick", "Thick", "kitchen")]
    densities = [setting.scene.liquids[0].density_kg_m3 for setting in (requests[0].a, requests[0].b)]
    assert densities == [designer.value(*path, "density_kg_m3") for path in (THICK, THIN)]
    designer.open("demo")
    feeling.feel_liquids(THIN)
    assert requests[-1].study == "", "a study that ships cannot be changed"
    assert designer.messages == []


def test_an_element_with_a_problem_is_not_opened_in_the_lab(designer: Any) -> None:
    designer.open()
    edit(designer, Unset((*THIN, "density_kg_m3")))
    designer.controller.feeling.asked.connect(lambda _liquids: pytest.fail("opened"))
    designer.controller.feeling.feel_liquids(THIN)
    ((title, reason),) = designer.messages
    assert title == "The element cannot be opened in the lab yet"
    assert reason.startswith("Correct this problem first: ")
    assert "liquids.thin.density_kg_m3" in reason


def delete_liquid(designer: Any) -> None:
    edit(designer, Unset(THICK))


def move_liquid_into_file(designer: Any) -> None:
    edit(designer, Set(THICK, {"file": "syrup.toml"}))


def make_read_only(designer: Any) -> None:
    designer.editing.opened.read_only = "The study is read-only."


@pytest.mark.parametrize(
    ("act", "reason"),
    [
        (lambda designer: designer.open("demo"), "A different study is now open in the designer."),
        (make_read_only, "The study is read-only."),
        (delete_liquid, "The study no longer contains the liquid thick."),
        (move_liquid_into_file, "Thick is in a separate liquid file. Save it there as a preset."),
    ],
)
def test_a_liquid_that_cannot_be_put_back_leaves_the_study_unchanged(
    designer: Any, act: Callable[[Any], None], reason: str
) -> None:
    designer.open()
    feeling = designer.controller.feeling
    scene = designer.study.protocol.scene_of("thick")
    feeling.feel_liquids(THICK)
    act(designer)
    before = designer.text
    liquid = scene.liquids[0].model_copy(update={"density_kg_m3": 1234.5})
    feeling.put_liquid_back("A", Setting("Thick", scene, scene.model_copy(update={"liquids": (liquid,)})))
    assert designer.text == before
    assert designer.messages == [("The liquid was not put back into the study", reason)]


def test_settings_of_the_whole_study_are_named_when_a_liquid_is_put_back(designer: Any) -> None:
    designer.open()
    feeling = designer.controller.feeling
    returned: list[None] = []
    feeling.returned.connect(lambda: returned.append(None))
    scene = designer.study.protocol.scene_of("thick")
    feeling.feel_liquids(("blocks", "liquids"))
    liquid = scene.liquids[0].model_copy(update={"density_kg_m3": 1234.0})
    body = scene.body.model_copy(update={"diameter_m": 0.071})
    changed = scene.model_copy(update={"liquids": (liquid,), "body": body})
    feeling.put_liquid_back("B", Setting("Thick", scene, changed))
    thin = designer.study.protocol.scene_of("thin")
    lighter = thin.liquids[0].model_copy(update={"density_kg_m3": 890.0})
    feeling.put_liquid_back("A", Setting("Thin", thin, thin.model_copy(update={"liquids": (lighter,)})))
    assert [designer.value(*path, "density_kg_m3") for path in (THIN, THICK)] == [890, 1234]
    assert re.search(r"^density_kg_m3 = 1234\b(?!\.)", designer.text, re.M), "a whole number is written without a point"
    assert (designer.editing.selected, len(returned)) == (THIN, 2)
    assert designer.messages == [
        ("Thick was put back into the study", "These settings apply to all liquids in the study: diameter.")
    ]


def test_each_entry_of_the_list_of_studies_opens_its_study(designer: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    designer.open()
    header, requests = designer.place.header, list[tuple[str, str]]()
    header.study_asked.disconnect()
    header.new_asked.disconnect()
    header.study_asked.connect(lambda source: requests.append(("open", source)))
    header.new_asked.connect(lambda: requests.append(("new", "")))
    monkeypatch.setattr("study_app.designer.header.choose_protocol", lambda _by, title: f"{title}/other.toml")
    current = header.study.currentIndex()
    assert [header.study.findText(text) for text in ("New study…", "Open file…")] == [
        header.study.findData(NEW), header.study.findData(OPEN)
    ]  # fmt: skip
    for source in (NEW, OPEN, "demo", "kitchen"):
        header.study.activated.emit(header.study.findData(source))
        assert header.study.currentIndex() == current, "until another study is open"
    assert requests == [("new", ""), ("open", "Open study/other.toml"), ("open", "demo")]


def test_edits_in_another_window_are_kept_as_a_version_and_can_be_compared(designer: Any) -> None:
    designer.open()
    file = designer.file.read_bytes()
    edit(designer, Set(("blocks", "liquids", "repetitions"), 3))
    designer.saving.write_draft(at_once=True)
    other = file.decode().replace("A first look", "Typed elsewhere")
    write_draft(designer.file, Draft(text=other, base=content_hash(file)))
    edit(designer, Set(("blocks", "liquids", "repetitions"), 4))
    designer.saving.write_draft(at_once=True)
    banner = designer.place.banner
    assert banner.sentence.text() == (
        "This study is also being edited in another window. The unsaved edits made there are kept as a version"
    )
    assert [(action, button.text()) for action, button in banner.buttons.items()] == [("compare", "Compare")]
    banner.buttons["compare"].click()
    changes = designer.controller.changes
    assert changes.chosen == content_hash(other.encode())
    changed = [line for line in changes.difference.toPlainText().splitlines() if line[:1] in {"-", "+"}]
    assert any(line.startswith("-") and "Typed elsewhere" in line for line in changed)
    assert any(line.startswith("+repetitions = 4") for line in changed)


def test_make_a_copy_of_a_read_only_study_chooses_it_on_the_page_of_a_new_study(designer: Any) -> None:
    designer.open("demo")
    banner = designer.place.banner
    assert [(action, button.text()) for action, button in banner.buttons.items()] == [("copy", "Make a copy…")]
    banner.buttons["copy"].click()
    assert designer.place.stack.currentWidget() is designer.place.new_page
    (chosen,) = [button.choice.source for button in designer.place.new_page.buttons if button.isChecked()]
    assert chosen == "demo"


def test_a_click_in_the_strip_of_a_session_opens_the_step_below_it(qtbot: Any) -> None:
    paths: list[Any] = []
    shares = {("pages", "welcome"): 0.2, ("blocks", "liquids"): 0.5, ("blocks", "delays"): 0.3}
    strip = _Strip(tuple(Segment(path[1], share, False, path) for path, share in shares.items()), paths.append)
    qtbot.addWidget(strip)
    strip.resize(400, 14)
    strip.show()
    assert strip.accessibleName() == "Session order: welcome, liquids, delays"
    assert strip.toolTip().splitlines()[-1] == "Click a step to open it"
    for x in (2, 78, 82, 278, 282, 398):
        QTest.mouseClick(
            strip, Qt.MouseButton.LeftButton, pos=strip.rect().topLeft() + type(strip.rect().topLeft())(x, 7)
        )
    QTest.mouseClick(strip, Qt.MouseButton.RightButton)
    assert paths == [path for path in shares for _ in range(2)]
