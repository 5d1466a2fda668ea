import pytest

from study_app.authoring.additions import added, duplicated
from study_app.authoring.changes.initial_values import initial
from study_app.authoring.edited_study import read
from study_app.authoring.fields import row_at
from study_app.authoring.new_study import template
from study_app.authoring.writer.refused import Refused
from study_app.protocol.source.document import Path
from tests.authoring.grown import PROTOCOLS

SECTIONS: tuple[Path, ...] = (
    ("liquids",), ("conditions",), ("tasks",), ("scales",), ("questionnaires",), ("pages",), ("blocks",),
    ("questionnaires", "liquid", "items"),
)  # fmt: skip
KINDS = ("choice", "number", "rating", "slider", "text")


@pytest.mark.slow
@pytest.mark.parametrize("study", ["demo", "rek2024", "slime"])
@pytest.mark.parametrize("section", SECTIONS, ids=".".join)
def test_a_new_element_passes_check(study: str, section: Path) -> None:
    before = read((PROTOCOLS / f"{study}.toml").read_bytes(), PROTOCOLS)
    edits, path = added(before, section)
    after, _ = before.edited(*edits)
    assert row_at(after.document, path) is not None
    assert after.faults == (), after.faults


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_a_new_question_of_each_kind_passes_check(kind: str) -> None:
    before = read((PROTOCOLS / "slime.toml").read_bytes(), PROTOCOLS)
    edits, path = added(before, ("questionnaires", "liquid", "items"), {"kind": kind})
    after, _ = before.edited(*edits)
    assert after.faults == (), after.faults
    assert after.document["questionnaires"]["liquid"]["items"][path[-1]]["kind"] == kind


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["explore", "reach", "follow"])
def test_a_new_task_of_each_kind_passes_check(kind: str) -> None:
    before = read((PROTOCOLS / "slime.toml").read_bytes(), PROTOCOLS)
    edits, _ = added(before, ("tasks",), {"kind": kind})
    assert before.edited(*edits)[0].faults == ()


@pytest.mark.parametrize("section", [*SECTIONS[:-1], ("stimuli",), ("designs",), ("methods",)], ids=".".join)
def test_a_new_element_of_the_empty_study_passes_check(section: Path) -> None:
    before = template("empty")
    edits, path = added(before, section)
    after, _ = before.edited(*edits)
    assert row_at(after.document, path) is not None
    assert after.faults == (), after.faults


def test_a_new_questionnaire_of_the_empty_study_has_a_scale_and_texts_in_words() -> None:
    before = template("empty")
    after, _ = before.edited(*added(before, ("questionnaires",))[0])
    assert after.document["questionnaires"]["questionnaire"]["scale"] in after.document["scales"]
    assert [item["short"] for item in after.document["questionnaires"]["questionnaire"]["items"]] == ["New question"]


def test_nothing_is_added_to_what_holds_no_elements() -> None:
    study = read((PROTOCOLS / "demo.toml").read_bytes())
    with pytest.raises(Refused, match="nothing can be added to Device"):
        added(study, ("device",))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "copy"),
    [
        (("liquids", "water"), ("liquids", "water_2")),
        (("tasks", "reach"), ("tasks", "reach_2")),
        (("pages", "rest"), ("pages", "rest_2")),
        (("blocks", "liquids"), ("blocks", "liquids_2")),
    ],
)
def test_a_copy_has_its_own_name_letter_and_place_in_the_session(path: Path, copy: Path) -> None:
    before = read((PROTOCOLS / "rek2024.toml").read_bytes(), PROTOCOLS)
    edits, found = duplicated(before, path)
    assert found == copy
    after, _ = before.edited(*edits)
    original, copied = (after.document[where[0]][where[1]] for where in (path, copy))
    assert {key: value for key, value in copied.items() if key != "code_prefix"} == {
        key: value for key, value in original.items() if key != "code_prefix"
    }
    if path[0] == "blocks":
        assert copied["code_prefix"] not in {"L", "D"}
        assert copy[1] in after.document["sequence"]
    else:
        assert {fault.message for fault in after.faults} <= {'has the same numbers as "water"'}


def test_a_copy_of_a_question_has_its_own_id_right_after_the_original() -> None:
    before = read((PROTOCOLS / "demo.toml").read_bytes())
    path = ("questionnaires", "liquid", "items", 0)
    edits, found = duplicated(before, path)
    after, _ = before.edited(*edits)
    items = after.document["questionnaires"]["liquid"]["items"]
    assert found[-1] == 1
    assert [item["id"] for item in items] == ["feels_liquid", "feels_liquid_2", "like_honey"]
    with pytest.raises(Refused, match="cannot be copied"):
        duplicated(before, ("format",))


def test_a_new_liquid_exerts_a_force_and_a_new_ball_fits_the_tank() -> None:
    study = template("empty")
    edits, path = added(study, ("liquids",))
    study, _ = study.edited(*edits)
    assert study.faults == ()
    assert study.document["liquids"][path[1]] == {"density_kg_m3": 1200}
    assert initial(study.document, (*path, "body", "diameter_m")) == 0.068
