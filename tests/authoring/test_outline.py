from study_app.authoring.edited_study import read
from study_app.authoring.outline import found, outline, title_of
from tests.authoring.grown import PROTOCOLS

TEXT = (PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8")
STUDY = read(TEXT.encode())


def test_outline_lists_the_session_its_parts_and_the_study() -> None:
    seen = outline(STUDY)
    steps = [one.path[1] for one in seen.session if one.depth == 0]
    assert tuple(steps) == STUDY.document["sequence"]
    below = [one.path for one in seen.session if one.depth]
    assert ("tasks", "reach") in below
    assert ("questionnaires", "liquid", "items", 0) in below
    assert {one.path[0] for one in seen.parts if one.depth == 0} >= {"liquids", "conditions", "pages", "groups"}
    assert ("liquids", "syrup") in [one.path for one in seen.parts]
    assert [one.path for one in seen.study] == [("study",), ("device",), ("scene",), ("limits",), ("analysis",)]


def test_elements_count_their_faults_and_those_within_them() -> None:
    study = read(TEXT.replace('liquid = "syrup"', 'liquid = "sirup"').encode())
    counts = {one.path: one.faults for one in outline(study).parts}
    assert counts["conditions", "practice"] == 1
    assert counts["conditions",] == 1
    assert counts["liquids",] == 0


def test_titles_are_texts_of_the_first_language_or_readable_ids() -> None:
    assert title_of(STUDY.document, ("pages", "consent")) == "Welcome"
    assert title_of(STUDY.document, ("liquids", "light_oil")) == "Light oil"
    assert title_of(STUDY.document, ("questionnaires", "liquid", "items", 1)) == "Immersive"


def test_found_looks_at_titles_ids_and_texts_of_every_language() -> None:
    assert found(STUDY.document, ("pages", "consent"), "WELKOM")
    assert found(STUDY.document, ("tasks", "reach_for_30_s"), "reach_for")
    assert not found(STUDY.document, ("tasks", "reach"), "welcome")
