"""Entries that move together, and elements that are copied and pasted, in every protocol and in grown files."""

import pytest

from study_app.authoring.changes.fragments import copied, pasted
from study_app.authoring.changes.moves import moved
from study_app.authoring.edited_study import Study
from study_app.authoring.writer.refused import Refused
from study_app.protocol.groups.group import sequences_in
from study_app.protocol.source.document import entries
from tests.authoring.grown import texts
from tests.authoring.random_edits import at, owners

TEXTS = texts()
PASTED = 8
"""So many elements of each text are copied, evenly spread."""


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_entries_come_together_to_their_place_in_their_order(name: str) -> None:
    study = Study(TEXTS[name])
    lists = [*sequences_in(study.document), *entries(study.document, "questionnaires.*.items")]
    for place, listed in lists:
        count = len(listed)
        for chosen, to in (([0], count), ([count - 1], 0), (list(range(0, count, 2)), count // 2)):
            edits, paths = moved(study, [(*place, index) for index in chosen], to)
            after, _ = study.edited(*edits)
            rest = [entry for index, entry in enumerate(listed) if index not in chosen]
            first = to - sum(index < to for index in chosen)
            wanted = [*rest[:first], *(listed[index] for index in chosen), *rest[first:]]
            assert list(at(after.document, place)) == wanted
            assert [at(after.document, path) for path in paths] == [listed[index] for index in chosen]


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_a_pasted_copy_has_the_values_and_comments_of_its_original(name: str) -> None:
    study = Study(TEXTS[name])
    before = owners(study.text)
    found = [path for path, value in entries(study.document, "*.*") if isinstance(value, dict)]
    found += [path for path, _ in entries(study.document, "questionnaires.*.items.*")]
    for path in found[:: max(1, len(found) // PASTED)]:
        try:
            made = pasted(study, path, copied(study, [path]))
        except Refused:
            assert path[0] in {"study", "scene", "device", "analysis", "limits"}
            continue
        after = Study(made.text, before=study.document)
        (copy,) = made.paths
        old, new = at(study.document, path), at(after.document, copy)
        assert {**old, "id": 0} == {**new, "id": 0}
        if f"[{path[0]}.{path[1]}]" in study.text or len(path) > 2:
            comments = owners(made.text)
            for (place, comment), count in before.items():
                if place[: len(path)] == path:
                    assert comments[(*copy, *place[len(path) :]), comment] >= count, (path, comment)
        lines = set(study.text.splitlines())
        assert lines <= set(made.text.splitlines())


def test_names_within_a_pasted_text_follow_the_one_that_was_taken() -> None:
    study = Study(TEXTS["demo"])
    text = '[conditions.new]\nliquid = "thick"\ndelay_ms = 0\n\n[liquids.thick]\ndensity_kg_m3 = 1\n'
    made = pasted(study, ("pages", "welcome"), text)
    document = Study(made.text).document
    assert document["conditions"]["new"]["liquid"] == "thick_2"
    assert made.paths == (("conditions", "new"), ("liquids", "thick_2"))
    assert document["liquids"]["thick"] == study.document["liquids"]["thick"]


def test_keys_before_a_header_do_not_end_up_in_another_table() -> None:
    study = Study(TEXTS["demo"])
    made = pasted(study, ("liquids", "thick"), "liquids.honey.density_kg_m3 = 1_420\n")
    assert Study(made.text).document["liquids"]["honey"] == {"density_kg_m3": 1420}


@pytest.mark.parametrize("text", ["study.name = 'x'", "liquids.x = 5", "# a comment", "liquids = 4", "other.x.y = 1"])
def test_what_is_no_element_of_a_study_is_refused(text: str) -> None:
    with pytest.raises(Refused):
        pasted(Study(TEXTS["demo"]), ("liquids", "thick"), text)
