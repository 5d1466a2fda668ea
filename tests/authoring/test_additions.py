"""Elements that are added, copied, or switched to another kind."""

import pytest

from study_app.authoring.additions import added, duplicated
from study_app.authoring.changes.initial_values import initial
from study_app.authoring.conversions import left_by, switched
from study_app.authoring.edited_study import Study, read
from study_app.authoring.fields import row_at
from study_app.authoring.new_study import template
from study_app.authoring.writer.refused import Refused
from study_app.protocol.source.document import Path, value_at
from tests.authoring.grown import PROTOCOLS


def study_of(name: str) -> Study:
    return read((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS)


ITEMS = ("questionnaires", "liquid", "items")
SECTIONS = ("liquids", "conditions", "tasks", "scales", "questionnaires", "pages", "blocks")
ADDED = [
    *((study, path, {}) for study in ("demo", "rek2024", "slime") for path in (*((one,) for one in SECTIONS), ITEMS)),
    *(("empty", (one,), {}) for one in (*SECTIONS, "stimuli", "designs", "methods")),
    *(("slime", ITEMS, {"kind": kind}) for kind in ("choice", "number", "rating", "slider", "text")),
    *(("slime", ("tasks",), {"kind": kind}) for kind in ("explore", "reach", "follow")),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "section", "given"), ADDED)
def test_a_new_element_of_each_kind_passes_check(name: str, section: Path, given: dict[str, str]) -> None:
    before = template(name) if name == "empty" else study_of(name)
    edits, path = added(before, section, given)
    after, _ = before.edited(*edits)
    assert row_at(after.document, path) is not None
    assert given.items() <= value_at(after.document, path).items()
    assert after.faults == (), after.faults


def test_a_new_questionnaire_of_the_empty_study_has_a_scale_and_texts_in_words() -> None:
    before = template("empty")
    after, _ = before.edited(*added(before, ("questionnaires",))[0])
    assert after.document["questionnaires"]["questionnaire"]["scale"] in after.document["scales"]
    assert [item["short"] for item in after.document["questionnaires"]["questionnaire"]["items"]] == ["New question"]


def test_nothing_is_added_to_what_holds_no_elements() -> None:
    study = study_of("demo")
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
    before = study_of("rek2024")
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
    before = study_of("demo")
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


TASK = ("tasks", "explore")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["reach", "follow"])
def test_switched_keeps_what_both_kinds_have_and_gives_back_the_rest(kind: str) -> None:
    study = study_of("slime")
    left = left_by(study, TASK, kind)
    assert set(left) == {"min_s", "max_s"}
    other, _ = study.edited(*switched(study, TASK, kind, {}))
    table = other.document["tasks"]["explore"]
    assert table["kind"] == kind
    assert table["instruction"] == study.document["tasks"]["explore"]["instruction"]
    assert not {"min_s", "max_s"} & set(table)
    assert not [fault for fault in other.faults if "missing" in fault.message or "unknown" in fault.message]
    back, _ = other.edited(*switched(other, TASK, "explore", left))
    assert back.document == study.document


def test_switched_leaves_the_kind_of_a_statement_out() -> None:
    study = study_of("viscosityjnd")
    item = ("questionnaires", "about_you", "items", 0)
    changed, _ = study.edited(*switched(study, item, None, {}))
    assert set(changed.document["questionnaires"]["about_you"]["items"][0]) == {"id", "text", "short"}


def test_switched_refuses_a_kind_that_does_not_exist() -> None:
    with pytest.raises(Refused, match="there is no kind 'swim' here: explore, reach, follow"):
        switched(study_of("demo"), TASK, "swim", {})
