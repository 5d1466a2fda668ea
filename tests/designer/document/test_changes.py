"""Changes of a study: names that follow, elements added and copied, series, texts and fragments."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

import pytest

from study_app.designer.document import steps
from study_app.designer.document.additions import (
    check_values,
    edits_to_add,
    edits_to_add_language,
    edits_to_copy_with,
    edits_to_fill_in,
    edits_to_move,
    localised_texts,
    number_row,
    short_text_edits,
)
from study_app.designer.document.document import template
from study_app.designer.document.fields import (
    check_id,
    choices_at,
    edits_to_delete,
    edits_to_rename,
    initial_value,
    orphaned_keys,
    paths_to_delete,
    referenced_element,
    references_to,
)
from study_app.designer.document.steps import DuplicateElement, MakeSeries, StepContext
from study_app.designer.document.study import Study, read_study
from study_app.designer.document.toml_edits import Set, Unset
from study_app.designer.form.form import form_of
from study_app.designer.measures.study_facts import copied_texts, facts, missing_texts
from study_app.designer.templates import FOLDER
from study_app.errors import StudyError
from study_app.ids import MAX_ID
from study_app.protocol.orders.schedule import build_schedule
from study_app.protocol.participants.groups import sequences_in
from study_app.protocol.source.document import Path, entries
from tests.designer.document.grown import PROTOCOLS, texts
from tests.designer.document.random_edits import at

NAMES = sorted(path.stem for path in PROTOCOLS.glob("*.toml"))


def study_of(name: str) -> Study:
    return read_study((PROTOCOLS / f"{name}.toml").read_bytes(), PROTOCOLS)


def things(document: Any) -> list[Path]:
    sections = [path for path, _ in entries(document, "*.*") if path[0] not in {"study", "device", "scene", "limits"}]
    tables = [path for path in sections if isinstance(path[1], str) and path[0] != "analysis"]
    return [*tables, *(path for path, _ in entries(document, "questionnaires.*.items.*"))]


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_renaming_updates_every_reference_and_leaves_sessions_unchanged(name: str) -> None:
    study = study_of(name)
    for thing in things(study.document)[::4]:
        if thing[0] in {"designs", "methods"} or (len(thing) == 4 and "instrument" in str(study.document[thing[0]])):
            continue
        changed, _ = study.with_edits(*edits_to_rename(study.document, thing, "quite_other"))
        assert changed.protocol is not None, (thing, changed.problems)
        assert study.protocol is not None
        before, after = (build_schedule(version.protocol, "P001", 1).steps for version in (study, changed))
        assert [type(step) for step in before] == [type(step) for step in after]
        if thing[0] in {"liquids", "conditions", "tasks", "scales", "pages"}:  # other names are those of random streams
            named = repr(before).replace(f"'{thing[1]}'", "'quite_other'")
            assert repr(after) in {repr(before), named}, thing
        back, _ = changed.with_edits(
            *edits_to_rename(changed.document, _renamed(thing), str(_name(study.document, thing)))
        )
        assert back.text == study.text


def _renamed(thing: Path) -> Path:
    return thing if isinstance(thing[-1], int) else (*thing[:-1], "quite_other")


def _name(document: Any, thing: Path) -> Any:
    for step in thing:
        document = document[step]
    return document["id"] if isinstance(thing[-1], int) else thing[-1]


@pytest.mark.parametrize(
    ("thing", "place"), [(("tasks", "reach"), ("blocks", "delay", "task")),
                         (("liquids", "water"), ("stimuli", "delay", "condition"))],
)  # fmt: skip
def test_elements_that_imply_the_only_element_are_deleted_with_it(thing: Path, place: Path) -> None:
    study = study_of("delayjnd")
    assert orphaned_keys(study.document, [thing]) == (place,)
    assert place[:2] in paths_to_delete(study.document, thing, study.is_required)


def test_elements_that_imply_the_only_condition_fall_back_to_its_liquid() -> None:
    study = study_of("delaydetect")
    condition, liquid = ("conditions", "water"), ("liquids", "water")
    assert orphaned_keys(study.document, [condition]) == ()
    assert paths_to_delete(study.document, condition, study.is_required) == (condition,)
    changed, _ = study.with_edits(*edits_to_delete([condition]))
    assert not changed.faults
    assert orphaned_keys(study.document, [condition, liquid]) == (("stimuli", "delay", "condition"),)
    assert {condition, ("stimuli", "delay")} <= {*paths_to_delete(study.document, liquid, study.is_required)}


def test_liquids_are_called_conditions_in_a_study_without_conditions() -> None:
    text = re.sub(r"\[conditions\.\w+\]\n(?:\w+ = .*\n)+", "", (FOLDER / "compare-liquids.toml").read_text("utf-8"))
    study = read_study(text.replace('conditions = ["practice"]', 'conditions = ["syrup"]').encode(), FOLDER)
    assert not study.problems
    place = ("blocks", "liquids", "conditions", 1)
    assert referenced_element(study.document, place) == ("liquids", "oil")
    assert references_to(study.document, ("liquids", "oil")) == (place,)
    assert choices_at(study.document, place) == ("water", "oil", "honey", "syrup")
    for edits in (
        edits_to_rename(study.document, ("liquids", "oil"), "butter"),
        edits_to_delete(paths_to_delete(study.document, ("liquids", "oil"), study.is_required)),
    ):
        changed, _ = study.with_edits(*edits)
        assert not changed.problems


@pytest.mark.parametrize(
    ("name", "recorded", "free"),
    [
        ("Butter", {"oil"}, "butter"),
        ("Butter", {"oil", "butter"}, "butter_2"),
        ("Oil", {"oil"}, "oil"),
        ("honey", {"oil"}, "honey_2"),
    ],
)
def test_a_refused_name_comes_with_one_that_neither_the_study_nor_other_answers_use(
    name: str, recorded: set[str], free: str
) -> None:
    study = read_study((FOLDER / "compare-liquids.toml").read_bytes(), FOLDER)
    with pytest.raises(StudyError, match=f'"{free}" is available$'):
        edits_to_rename(study.document, ("liquids", "oil"), name, frozenset(recorded))


@pytest.mark.parametrize("name", ["", "Water", "2nd", "with blank", "é", "a" * (MAX_ID + 1)])
def test_check_id_refuses_invalid_ids(name: str) -> None:
    with pytest.raises(StudyError, match="is not a valid ID: use at most"):
        check_id(name)


def test_a_new_liquid_exerts_a_force_and_a_new_ball_fits_the_tank() -> None:
    study = template("empty")
    edits, path = edits_to_add(study, ("liquids",))
    study, _ = study.with_edits(*edits)
    assert study.faults == ()
    assert study.document["liquids"][path[1]] == {"density_kg_m3": 1200}
    assert initial_value(study.document, (*path, "body", "diameter_m")) == 0.068


REK = (PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8")
NO_DELAY = ("conditions", "delay_0")


@pytest.fixture(scope="module")
def study() -> Study:
    return read_study(REK.encode(), PROTOCOLS)


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ((2000,), "2000 is not permitted: Visual delay must be at most 1000"),
        ((-5, 30), "-5 is not permitted: Visual delay must be at least 0"),
        ((30, 30.0), "30 is listed twice or is equal to the original value"),
        ((30, 0), "0 is listed twice or is equal to the original value"),
        ((), "a series must contain 1 to 24 copies"),
        (tuple(range(1, 26)), "a series must contain 1 to 24 copies"),
    ],
)
def test_values_are_refused_in_one_sentence(study: Study, values: tuple[float, ...], why: str) -> None:
    row = number_row(study.document, NO_DELAY, (*NO_DELAY, "delay_ms"))
    with pytest.raises(StudyError, match=f"^{why}$"):
        check_values(study.document, row, values)


def test_copies_of_a_series_come_in_order_after_their_original_in_each_list(study: Study) -> None:
    step = MakeSeries(NO_DELAY, (*NO_DELAY, "delay_ms"), (30, 60)).step(StepContext(study, NO_DELAY))
    after, _ = study.with_edits(*step.edits)
    names = at(after.document, ("blocks", "delays", "conditions"))
    series = [at(after.document, ("conditions", name, "delay_ms")) for name in names]
    assert series == [0, 30, 60, 50, 75, 100, 125, 150, 200]
    assert step.select == ("conditions", names[1])


@pytest.mark.parametrize(
    ("title", "copied"),
    [("Twice 2", "Twice 7"), ("Part 1", "Part 1, 7"), ("Liquids", "Liquids, 7"), ("2 liquids", "2 liquids, 7")],
)
def test_a_copy_with_another_number_has_it_in_its_title_and_fits_the_study(title: str, copied: str) -> None:
    path = ("blocks", "liquids")
    study, _ = DEMO.with_edits(Set((*path, "title"), title), Set((*path, "repetitions"), 2))
    edits, copy = edits_to_copy_with(study, path, number_row(study.document, path, (*path, "repetitions")), 7)
    after, _ = study.with_edits(*edits)
    block = at(after.document, copy)
    assert (copy, block["title"], block["repetitions"]) == (("blocks", "liquids_7"), copied, 7)
    assert block["code_prefix"] not in {"L", "D"}
    assert [step for step in after.document["sequence"] if "liquids" in step] == ["liquids", "liquids_7"]
    assert {fault.kind for fault in after.faults} == {"part"}, "which part it belongs to is for the author to say"


TEXTS = texts()


@pytest.mark.slow
@pytest.mark.parametrize("name", TEXTS)
def test_an_entry_comes_to_its_place(name: str) -> None:
    study = Study(TEXTS[name])
    lists = [*sequences_in(study.document), *entries(study.document, "questionnaires.*.items")]
    for place, listed in lists:
        count = len(listed)
        for index, to in ((0, count), (count - 1, 0), (0, count // 2)):
            edits, path = edits_to_move(study, (*place, index), to)
            after, _ = study.with_edits(*edits)
            wanted = [*listed[:index], *listed[index + 1 :]]
            wanted.insert(to - (index < to), listed[index])
            assert list(at(after.document, place)) == wanted
            assert at(after.document, path) == listed[index]
        assert edits_to_move(study, (*place, 0), 0) == ((), (*place, 0))


TITLE = ("pages", "welcome", "title")
DEMO = read_study((PROTOCOLS / "demo.toml").read_bytes(), PROTOCOLS)


def test_a_point_is_duplicated_with_its_numbers() -> None:
    place = ("tasks", "reach", "targets_mm")
    step = DuplicateElement((*place, 0)).step(StepContext(DEMO))
    after, _ = DEMO.with_edits(*step.edits)
    assert at(after.document, place) == ((-30, 0, 0), (-30, 0, 0), (30, 0, 0))


@pytest.fixture(scope="module")
def translated() -> Study:
    """Return the demo with two more languages, copied from the first one in one step."""
    study = DEMO
    for code in ("nl", "de"):
        study, _ = study.with_edits(*edits_to_add_language(study, code))
    for code in ("nl", "de"):
        study, _ = study.with_edits(*edits_to_fill_in(study, code))
    return study


def words(study: Study) -> list[str]:
    return [warning for warning in facts(study).warnings if "translated into" in warning]


def test_copies_in_two_languages_are_counted_until_edited(translated: Study) -> None:
    count = sum(any(map(str.isalpha, str(text["en"]))) for _, text in localised_texts(translated))
    dutch = count - 1  # "baseline" is Dutch, too
    assert (translated.faults, copied_texts(translated)) == ((), {"nl": dutch, "de": count})
    assert words(translated) == [
        f"study.title: {copies} texts are still in English and must be translated into {name}; this is the first of "
        "them"
        for name, copies in (("Dutch", dutch), ("German", count))
    ]
    assert (copied_texts(DEMO), words(DEMO)) == ({}, [])
    for edit in (Set((*TITLE, "nl"), "Een eerste blik"), Unset((*TITLE, "nl"))):
        edited, _ = translated.with_edits(edit)
        assert copied_texts(edited) == {"nl": dutch - 1, "de": count}
        assert missing_texts(edited) == ({"nl": 1} if isinstance(edit, Unset) else {})
    in_dutch = {"instrument": "nasa-tlx", "intro": {"nl": "Beoordeel de taak."}}
    assert missing_texts(translated.with_edits(Set(("questionnaires", "load"), in_dutch))[0]) == {"de": 1}
    plain, _ = translated.with_edits(*(Set((*TITLE, code), "7") for code in ("en", "nl")))
    assert copied_texts(plain) == {"nl": dutch - 1, "de": count}, "7 is the same in all; the German is English"


ITEM = ("questionnaires", "liquid", "items", 0)


def with_question(text: str, short: str) -> Study:
    source = (PROTOCOLS / "rek2024.toml").read_text(encoding="utf-8")
    start = source.index("[[questionnaires.liquid.items]]")
    end = source.index("[[questionnaires.liquid.items]]", start + 1)
    table = f'[[questionnaires.liquid.items]]\nid = "feels_liquid"\ntext = {text}\nshort = {short}\n\n'
    return read_study((source[:start] + table + source[end:]).encode(), PROTOCOLS)


@pytest.mark.parametrize(
    ("text", "short", "expected"),
    [
        ('"New question"', '"New question"', {("short",): "Was it cold"}),
        ('{ en = "Was", nl = "Was" }', '{ en = "Was", nl = "Kou" }', {("short", "en"): "Was it cold"}),
        ('{ en = "Was", nl = "Was" }', '{ en = "Cold", nl = "Was" }', {}),
        ('{ nl = "Was" }', '{ nl = "Was" }', {}),
        ('"Was it cold?"', '"Cold"', {}),
        ('{ en = "Was" }', '"Was"', {}),
    ],
)
def test_a_short_text_equal_to_the_text_follows_it(text: str, short: str, expected: dict[Any, str]) -> None:
    edits = short_text_edits(with_question(text, short), (*ITEM, "text"), "en", "Was it cold?")
    assert {edit.path[len(ITEM) :]: edit.value for edit in edits} == expected  # type: ignore[union-attr]


def test_the_id_of_a_copy_with_a_long_number_is_as_long_as_permitted() -> None:
    path = ("conditions", "d" * MAX_ID)
    study, _ = DEMO.with_edits(*edits_to_rename(DEMO.document, ("conditions", "late"), path[1]))
    row = number_row(study.document, path, (*path, "delay_ms"))
    for value, ending in ((7, "_7"), (12.25, "_12_25"), (125, "_125")):
        copy = edits_to_copy_with(study, path, row, value)[1]
        assert copy == ("conditions", "d" * (MAX_ID - len(ending)) + ending)


def test_points_of_a_scale_are_listed_language_by_language_and_those_of_the_study_first() -> None:
    labels = {"fr": ["non", "oui"], "en": ["no", "maybe", "yes"], "nl": ["nee"]}
    study, _ = DEMO.with_edits(
        Set(("study", "languages"), ["nl", "en"]), Set(("scales", "agreement", "labels"), labels)
    )
    form = form_of(study, ("scales", "agreement"))
    points = next(row for section in form.sections for row in section.rows if row.path[-1] == "labels").facts
    assert points.languages == (("nl", "Dutch"), ("en", "English"), ("fr", "French"))
    assert points.points == (("nee", "no", "non"), ("", "maybe", "oui"), ("", "yes", ""))


THICK, LIQUIDS = ("liquids", "thick"), ("blocks", "liquids")
GONE = {"liquids.thick.density_kg_m3": None, "liquids.thick.effects": None}


@pytest.mark.parametrize(
    ("request_", "words", "select", "said", "changes"),
    [
        (steps.SetValue((*THICK, "density_kg_m3"), 9), "Change Density", None, "", {"liquids.thick.density_kg_m3": 9}),
        (steps.RemoveKey(("study", "resume")), "Remove Resume", None, "", {"study.resume": None}),
        (
            steps.AddEntry(("sequence",), "delays"), "Add to Session order", None, "",
            {"sequence": ("welcome", "liquids", "reaching", "delays", "thanks", "delays")},
        ),
        (
            DuplicateElement(THICK), "Duplicate Thick", ("liquids", "thick_2"), "",
            {"liquids.thick_2.density_kg_m3": 1400, "liquids.thick_2.effects": ("drag",)},
        ),
        (
            steps.MoveElement(LIQUIDS, 1), "Move Liquids down", LIQUIDS, "Liquids, now 3 of 5",
            {"sequence": ("welcome", "reaching", "liquids", "delays", "thanks")},
        ),
        (
            steps.MoveElement(LIQUIDS, -1), "Move Liquids up", LIQUIDS, "Liquids, now 1 of 5",
            {"sequence": ("liquids", "welcome", "reaching", "delays", "thanks")},
        ),
        (
            steps.MoveTo(("sequence", 3), 1), "Move Delays", ("blocks", "delays"), "Delays, now 2 of 5",
            {"sequence": ("welcome", "delays", "liquids", "reaching", "thanks"), "blocks.delays.part": 1,
             "blocks.liquids.part": 2},
        ),
        (
            steps.AddToSession(LIQUIDS, (("sequence", 3), ("sequence", 1))), "Add Liquids to the session", None,
            "Liquids, now step 2", {"sequence": ("welcome", "liquids", "liquids", "reaching", "liquids", "delays",
                                                 "thanks")},
        ),
        (steps.DeleteElement(THICK), "Delete Thick", ("liquids", "thin"), "", GONE),
        (
            steps.DeleteElement(THICK, "all"), "Delete Thick", ("liquids", "thin"), "",
            GONE | {"conditions.thick.liquid": None, "conditions.thick.delay_ms": None,
                    "blocks.liquids.conditions": ("thin",)},
        ),
        (
            steps.DeleteElement(THICK, "other", "thin"), "Delete Thick", ("liquids", "thin"), "",
            GONE | {"conditions.thick.liquid": "thin"},
        ),
        (
            steps.RenameElement(THICK, "honey"), "Rename to honey, 1 place updated", ("liquids", "honey"),
            "1 place updated", GONE | {"liquids.honey.density_kg_m3": 1400, "liquids.honey.effects": ("drag",),
                                       "conditions.thick.liquid": "honey"},
        ),
        (
            steps.AddElement(("liquids",)), "Add liquid", ("liquids", "liquid"), "",
            {"liquids.liquid.density_kg_m3": 1200},
        ),
        (
            steps.Several("Both", (steps.SetText(("study", "title"), "en", "New"), steps.RemoveKey(("study", "name")))),
            "Both", None, "", {"study.title": "New", "study.name": None},
        ),
    ],
)  # fmt: skip
def test_a_request_is_one_step_with_its_title_selection_and_changes_only(
    request_: steps.Request, words: str, select: Path | None, said: str, changes: dict[str, Any]
) -> None:
    study = study_of("demo")
    step = request_.step(StepContext(study, ("liquids", "thin")))
    assert (step.title, step.select, step.announcement) == (words, select, said)
    before, after = (dict(leaves(each.document)) for each in (study, study.with_edits(*step.edits)[0]))
    assert {key: after.get(key) for key in {**before, **after} if before.get(key) != after.get(key)} == changes


def leaves(value: Any, path: Path = ()) -> Iterator[tuple[str, Any]]:
    """Yield the dotted path and the value of every key that holds no table."""
    tables = isinstance(value, tuple) and any(isinstance(entry, Mapping) for entry in value)
    inner = enumerate(value) if tables else value.items() if isinstance(value, Mapping) else None
    if inner is None:
        yield ".".join(map(str, path)), value
        return
    for key, entry in inner:
        yield from leaves(entry, (*path, key))


@pytest.mark.parametrize(
    ("how", "words", "title"), [("add", "Add French", {"en": "T"}), ("copy", "Fill in Dutch", {"en": "T", "nl": "T"}),
                                ("remove", "Remove Dutch", {"en": "T"})]
)  # fmt: skip
def test_a_language_is_added_filled_in_or_removed(how: Any, words: str, title: Any) -> None:
    languages = '["en", "nl"]' if how == "remove" else '["en"]' if how == "add" else '["en", "nl"]'
    held = '{ en = "T", nl = "U" }' if how == "remove" else '{ en = "T" }' if how == "copy" else '"T"'
    study = read_study(f"format = 2\n[study]\nname = 'a'\nlanguages = {languages}\ntitle = {held}\n".encode())
    step = steps.ChangeLanguage(how, "fr" if how == "add" else "nl").step(StepContext(study))
    changed = study.with_edits(*step.edits)[0].document["study"]
    assert (step.title, changed["title"]) == (words, title)
    assert changed["languages"] == {"add": ("en", "fr"), "copy": ("en", "nl"), "remove": ("en",)}[how]
