import pytest

from study_app.authoring.conversions import left_by, switched
from study_app.authoring.edited_study import Study, read
from study_app.authoring.writer.refused import Refused
from tests.authoring.grown import PROTOCOLS

TASK = ("tasks", "explore")


def study_of(name: str) -> Study:
    return read((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS)


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
