"""Elements that are added, copied, or switched to another kind."""

import pytest

from study_app.designer.document.additions import added
from study_app.designer.document.changes import switched
from study_app.designer.document.fields import initial
from study_app.designer.document.study import Study, read
from study_app.designer.new_study.new_study import template
from tests.designer.document.grown import PROTOCOLS


def study_of(name: str) -> Study:
    return read((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS)


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
    edits, left = switched(study, TASK, kind, {})
    assert set(left) == {"min_s", "max_s"}
    other, _ = study.edited(*edits)
    table = other.document["tasks"]["explore"]
    assert table["kind"] == kind
    assert table["instruction"] == study.document["tasks"]["explore"]["instruction"]
    assert not {"min_s", "max_s"} & set(table)
    assert not [fault for fault in other.faults if "missing" in fault.message or "unknown" in fault.message]
    back, _ = other.edited(*switched(other, TASK, "explore", left)[0])
    assert back.document == study.document
