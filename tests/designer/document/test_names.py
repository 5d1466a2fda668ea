"""Renaming and deleting with everything that names the thing; titles of the outline."""

import re
from typing import Any

import pytest

from study_app.designer.document.names import (
    check_id,
    choices_at,
    deletions,
    left_without,
    named_at,
    references_to,
    renamed,
    with_references,
)
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_text import Refused
from study_app.designer.new_study.templates import FOLDER
from study_app.ids import MAX_ID
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.source.document import Path, entries
from tests.designer.document.grown import PROTOCOLS

NAMES = sorted(path.stem for path in PROTOCOLS.glob("*.toml"))


def study_of(name: str) -> Study:
    return read((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS)


def things(document: Any) -> list[Path]:
    sections = [path for path, _ in entries(document, "*.*") if path[0] not in {"study", "device", "scene", "limits"}]
    tables = [path for path in sections if isinstance(path[1], str) and path[0] != "analysis"]
    return [*tables, *(path for path, _ in entries(document, "questionnaires.*.items.*"))]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_renamed_leaves_no_reference_and_no_session_changed(name: str) -> None:
    study = study_of(name)
    for thing in things(study.document)[::4]:
        if thing[0] in {"designs", "methods"} or (len(thing) == 4 and "instrument" in str(study.document[thing[0]])):
            continue
        changed, _ = study.edited(*renamed(study.document, thing, "quite_other"))
        assert changed.protocol is not None, (thing, changed.problems)
        assert study.protocol is not None
        before, after = (build_schedule(one.protocol, "P001", 1).steps for one in (study, changed))
        assert [type(step) for step in before] == [type(step) for step in after]
        if thing[0] in {"liquids", "conditions", "tasks", "scales", "pages"}:  # other names are those of random streams
            named = repr(before).replace(f"'{thing[1]}'", "'quite_other'")
            assert repr(after) in {repr(before), named}, thing
        back, _ = changed.edited(*renamed(changed.document, _renamed(thing), str(_name(study.document, thing))))
        assert back.text == study.text


def _renamed(thing: Path) -> Path:
    return thing if isinstance(thing[-1], int) else (*thing[:-1], "quite_other")


def _name(document: Any, thing: Path) -> Any:
    for step in thing:
        document = document[step]
    return document["id"] if isinstance(thing[-1], int) else thing[-1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "thing", [("liquids", "water"), ("scales", "agreement"), ("tasks", "explore"), ("pages", "rest")]
)
def test_with_references_leaves_none_that_dangles(thing: Path) -> None:
    study = study_of("rek2024")
    paths = with_references(study.document, thing, study.needs)
    assert paths[-1] == thing
    changed, _ = study.edited(*deletions(paths))
    assert not [fault for fault in changed.faults if "there is no" in fault.message and '"' in fault.message], thing


@pytest.mark.parametrize(
    ("thing", "place"), [(("tasks", "reach"), ("blocks", "delay", "task")),
                         (("liquids", "water"), ("stimuli", "delay", "condition"))],
)  # fmt: skip
def test_what_leaves_the_name_of_the_only_one_out_goes_with_it(thing: Path, place: Path) -> None:
    study = study_of("delayjnd")
    assert left_without(study.document, [thing]) == (place,)
    assert place[:2] in with_references(study.document, thing, study.needs)


def test_the_only_condition_leaves_its_liquid_to_what_leaves_its_name_out() -> None:
    study = study_of("delaydetect")
    condition, liquid = ("conditions", "water"), ("liquids", "water")
    assert left_without(study.document, [condition]) == ()
    assert with_references(study.document, condition, study.needs) == (condition,)
    changed, _ = study.edited(*deletions([condition]))
    assert not changed.faults
    assert left_without(study.document, [condition, liquid]) == (("stimuli", "delay", "condition"),)
    assert {condition, ("stimuli", "delay")} <= {*with_references(study.document, liquid, study.needs)}


def test_with_references_leaves_no_list_empty() -> None:
    study = read((FOLDER / "compare-liquids.toml").read_bytes(), FOLDER)
    gone = with_references(study.document, ("liquids", "syrup"), study.needs)
    assert gone == (("sequence", 1), ("blocks", "practice"), ("conditions", "practice"), ("liquids", "syrup"))
    changed, _ = study.edited(*deletions(gone))
    assert not changed.faults


def test_liquids_are_named_as_conditions_where_a_study_has_none() -> None:
    text = re.sub(r"\[conditions\.\w+\]\n(?:\w+ = .*\n)+", "", (FOLDER / "compare-liquids.toml").read_text())
    study = read(text.replace('conditions = ["practice"]', 'conditions = ["syrup"]').encode(), FOLDER)
    assert not study.problems
    place = ("blocks", "liquids", "conditions", 1)
    assert named_at(study.document, place) == ("liquids", "oil")
    assert references_to(study.document, ("liquids", "oil")) == (place,)
    assert choices_at(study.document, place) == ("water", "oil", "honey", "syrup")
    for edits in (
        renamed(study.document, ("liquids", "oil"), "butter"),
        deletions(with_references(study.document, ("liquids", "oil"), study.needs)),
    ):
        changed, _ = study.edited(*edits)
        assert not changed.problems


@pytest.mark.parametrize("name", ["", "Water", "2nd", "with blank", "é", "a" * (MAX_ID + 1)])
def test_check_id_refuses_what_is_no_id(name: str) -> None:
    with pytest.raises(Refused, match="is not an id: write at most"):
        check_id(name)
