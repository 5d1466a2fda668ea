"""What is shown of a study, sound or not: uses of elements, forms, the file with its marks, measures."""

import pathlib
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from study_app.designer.document.additions import repairs
from study_app.designer.document.document import template
from study_app.designer.document.elements import outline, used_by
from study_app.designer.document.fields import blocks_using
from study_app.designer.document.study import Study, read
from study_app.designer.document.toml_edits import Edit, Set, Unset
from study_app.designer.document.toml_text import retyped, shown
from study_app.designer.form.form import form
from study_app.designer.measures.cards import UNKNOWN, Figures, Line, Lines, MeasureCard
from study_app.designer.measures.levels import AS_ASKED
from study_app.designer.measures.measures_page import clipped_sentence
from study_app.designer.measures.measures_view import MeasuresView, measures_view
from study_app.designer.measures.simulation import Controls, GroupPrecision, Measurable, Observed, Simulated
from study_app.designer.measures.study_facts import facts, restored_part
from study_app.designer.outline import outline_rows
from study_app.designer.participant.playable import NotPlayableError, playable, showing
from study_app.designer.place.file import file_text
from study_app.designer.problems import problem_rows
from study_app.designer.templates import FOLDER, templates
from study_app.protocol.source.document import Path, entries, value_at
from study_app.protocol.source.files import shipped, shipped_file
from tests.designer.document.grown import PROTOCOLS


def study_of(file: pathlib.Path) -> Study:
    return read(file.read_bytes(), file.parent)


@pytest.mark.parametrize(
    ("name", "path", "words", "blocks"),
    [
        ("delaydetect", ("conditions", "water"), "used by 1 stimulus", ("training", "delay")),
        ("delayjnd", ("tasks", "reach"), "used by 1 block", ("delay",)),
        ("delayjnd", ("liquids", "water"), "used by 1 stimulus", ("delay",)),
    ],
)
def test_what_is_the_only_one_is_used_where_its_name_is_left_out(
    name: str, path: Path, words: str, blocks: tuple[str, ...]
) -> None:
    study = study_of(PROTOCOLS / f"{name}.toml")
    assert (used_by(study.document, path), blocks_using(study.document, path)) == (words, blocks)


def test_liquids_are_used_as_conditions_where_a_study_has_none() -> None:
    document = {"liquids": {"water": {}, "oil": {}}, "blocks": {"one": {"conditions": ("water",)}}}
    assert [used_by(document, ("liquids", name)) for name in ("water", "oil")] == ["used by 1 block", "not used"]
    assert blocks_using(document, ("liquids", "water")) == ("one",)


@pytest.mark.parametrize("file", [*PROTOCOLS.glob("*.toml"), *FOLDER.glob("*.toml")], ids=lambda file: file.stem)
def test_what_is_not_used_can_be_deleted(file: pathlib.Path) -> None:
    study = study_of(file)
    elements = (path for path, _ in entries(study.document, "*.*"))
    for path in [one for one in elements if used_by(study.document, one) == "not used"]:
        assert study.edited(Unset(path))[0].faults == study.faults, path


ITEM = ("questionnaires", "remarks", "items", 0)
WRONG: tuple[tuple[str, Path, tuple[Any, ...]], ...] = (
    ("viscosity-jnd", ("study",), ("x",)),
    ("viscosity-jnd", ("study", "languages"), (5, "x", [{}])),
    ("viscosity-jnd", ("blocks",), (None, 5)),
    ("viscosity-jnd", ("sequence",), ("x", [])),
    ("questionnaire-only", (*ITEM, "id"), (5, [], {})),
    ("questionnaire-only", (*ITEM, "kind"), ([], {})),
    ("questionnaire-only", ITEM[:3], ("x", [])),
    ("rate-realism", ("blocks", "liquids", "order"), (5, {})),
    ("delay-detection", ("designs", "pair", "kind"), (5, {})),
)


@pytest.mark.parametrize(
    ("name", "path", "value"), [(name, path, value) for name, path, values in WRONG for value in values]
)
def test_a_value_of_a_wrong_type_is_a_fault_that_every_view_shows(name: str, path: Path, value: Any) -> None:
    sound = template(name)
    edit: Edit = Unset(path) if value is None else Set(path, value)
    study, _ = sound.edited(edit)
    assert study.faults
    known = facts(study)
    outline_rows(study, known.steps_s, "")
    problems = problem_rows(study)
    assert len(problems) == len(study.faults)
    for fault in study.faults:
        repairs(study, fault)
    protocol = restored_part(study, sound.document).protocol
    for selected in {("study",), path[:2], path[:4]}:
        if not isinstance(value_at(study.document, selected), dict):
            continue
        form(study, selected)
        measures_view(study, known, selected, Controls(), Simulated(), dict.fromkeys(problems, ()))
        if protocol is not None:
            showing(protocol, selected)
        with pytest.raises(NotPlayableError):
            playable(study, selected)


@pytest.fixture(scope="module")
def study() -> Study:
    return read(shipped_file("rek2024").read_bytes(), shipped_file("rek2024").parent)


ENDS = st.sampled_from(["\n", "\r\n"])


@pytest.mark.slow
@given(st.lists(st.tuples(st.sampled_from(["a", "b = 1", "# é😀\u00a0", ""]), ENDS), max_size=8), st.data())
def test_typing_changes_no_end_of_line_elsewhere(lines: list[tuple[str, str]], data: st.DataObject) -> None:
    text = "".join(line + end for line, end in lines)
    pane = shown(text)
    first = data.draw(st.integers(0, len(pane)))
    last = data.draw(st.integers(first, len(pane)))
    typed = pane[:first] + data.draw(st.sampled_from(["", "x", "new\nline", "\n"])) + pane[last:]
    after = retyped(text, typed)
    assert shown(after) == typed
    if typed == pane:
        assert after == text
    shortest = 0
    while shortest < min(len(pane), len(typed)) and pane[shortest] == typed[shortest]:
        shortest += 1
    before = pane[:shortest].count("\n")
    kept = text.splitlines(keepends=True)[:before]
    assert after.startswith("".join(kept))


@pytest.mark.parametrize("newline", ["\n", "\r\n"])
def test_the_selected_element_and_faulty_lines_are_marked(newline: str) -> None:
    text = shipped_file("rek2024").read_text(encoding="utf-8").replace("\n", newline)
    text = text.replace('order = "shuffled"', 'order = "shufled"', 1)
    found = file_text(read(text.encode()), "x.toml", ("blocks", "liquids"))
    lines = found.text.split("\n")
    (first, last), *others = found.selected
    assert not others
    assert lines[first] == "[blocks.liquids]"
    assert lines[last].startswith("questionnaire = ")
    assert [lines[line] for line in found.faulty] == ['order = "shufled"']


FILES = [*(shipped_file(name) for name in shipped()), *(FOLDER / f"{name}.toml" for name in templates())]


def leaves(value: Any, path: tuple[Any, ...] = ()) -> set[tuple[Any, ...]]:
    """The keys of an element, those of tables within it too; entries of lists are forms of their own."""
    if isinstance(value, dict) and (value or not path):
        return {found for key, inner in value.items() for found in leaves(inner, (*path, key))}
    return {path}


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_every_key_of_every_element_is_in_its_form_with_its_value(file: pathlib.Path) -> None:
    study = read(file.read_bytes(), file.parent)
    shown = outline(study)
    for element in {one.path for one in (*shown.session, *shown.parts, *shown.study)}:
        if len(element) == 1 and element[0] not in {"study", "device", "scene", "limits", "analysis"}:
            continue
        if value_at(study.document, element) is None:
            continue
        made = form(study, element)
        rows = {row.path: row.value for row in made.rows}
        for leaf in leaves(value_at(study.document, element), element):
            if leaf[-1] == "id" and len(leaf) > 3:
                assert made.id is not None
                continue
            around = next((leaf[:length] for length in range(len(leaf), 0, -1) if leaf[:length] in rows), None)
            assert around is not None, leaf
            assert rows[around] == value_at(study.document, around)


def shipped_study(name: str) -> Study:
    return read(shipped_file(name).read_bytes(), shipped_file(name).parent)


def view(
    study: Study, path: Path, simulated: Simulated | None = None, controls: Controls | None = None
) -> MeasuresView:
    return measures_view(study, facts(study), path, controls or Controls(), simulated or Simulated(), {})


def lines_of(card: MeasureCard) -> tuple[Line, ...]:
    return next((part.lines for part in card.parts if isinstance(part, Lines)), ())


def test_a_force_that_a_limit_clips_is_said_and_sums_of_a_broken_study_are_not_known() -> None:
    study = shipped_study("rek2024")
    weak, _ = study.edited(Set(("device", "force_limit_n"), 0.5))
    (force,) = [card for card in view(weak, ("study",)).cards if card.title == "Force of each liquid"]
    assert {line.verdict[2] for line in lines_of(force)} == {"clipped by the force limit"}
    assert {line.share for line in lines_of(force)} == {1.0}
    broken, _ = study.edited(Set(("blocks", "liquids", "repetitions"), -1))
    session = view(broken, ("study",)).cards[0]
    figures = session.parts[0]
    assert isinstance(figures, Figures)
    assert {number for number, _ in figures.figures} == {UNKNOWN}
    assert any(len(lines_of(card)) == 4 for card in view(broken, ("study",)).cards)


def test_cards_say_which_levels_are_clipped_and_whether_that_is_simulated() -> None:
    levels = Set(("stimuli", "damping", "levels"), [0.02, 2.0])
    free = {"kind": "explore", "min_s": 2, "max_s": 4, "instruction": "Feel."}
    paced, _ = template("viscosity-jnd").edited(levels, Set(("stimuli", "damping", "standards"), [32]))
    unpaced, _ = template("viscosity-jnd").edited(
        levels, Set(("stimuli", "damping", "standards"), [12]), Set(("tasks", "stir"), free)
    )
    measured = Simulated(
        measurable=Measurable((0.02, 0.4), ()), group=GroupPrecision(12, 60, 0.15, 80, 0.9, 107, 1, 60, 9)
    )
    for study, said, group in (
        (paced, "Levels above 65.6 % are clipped: observers are simulated with what the limits leave", ""),
        (
            unpaced,
            f"Levels above 122 % are clipped in fast motions, whose trials are repeated. {AS_ASKED}",
            f". {AS_ASKED}",
        ),
        (template("viscosity-jnd"), "", ""),
    ):
        jnds, _, people, _ = view(study, ("blocks", "viscosity"), measured).numbers
        assert jnds.more == said
        own = view(study, ("blocks", "training")).levels
        assert own is not None
        assert clipped_sentence(own) == ""  # it presents no clipped level
        assert people.more == f"80 % are enough; with 107 trials: 100 %{group}"


@pytest.mark.parametrize(
    ("study", "block", "name"), [("viscosityjnd", "viscosity", "JND"), ("forcedelay", "delay", "threshold")]
)
def test_what_is_simulated_is_called_a_threshold_where_the_standard_is_nothing(
    study: str, block: str, name: str
) -> None:
    words = view(shipped_study(study), ("blocks", block)).words
    assert words is not None
    assert words.name == name


CLIPPED = "levels are clipped"


@pytest.mark.parametrize(
    ("key", "value", "threshold", "why", "more"),
    [
        ("levels", [0.005, 0.03], None, "levels are too small", "All levels are below twice the level error"),
        ("standards", [32], 0.19, "", ""),
        ("standards", [52], 0.019, CLIPPED, "Levels above 1.92 % are"),
        ("standards", [52], 0.19, CLIPPED, "Levels above 1.92 % are"),
        ("standards", [8, 52], None, CLIPPED, "Levels above 1.92 % of standard 52 N·s/m are"),
        ("standards", [60], 0.19, "the standard is clipped", "The standard is"),
        ("standards", [8, 60], None, "the standard is clipped", "The standard 60 N·s/m is"),
    ],
)
def test_where_nothing_is_measured_the_cards_say_why(
    key: str, value: list[float], threshold: float | None, why: str, more: str
) -> None:
    study, _ = template("viscosity-jnd").edited(Set(("stimuli", "damping", key), value))
    if why:
        asked = Controls(threshold=threshold or 0.19)
        jnds = view(study, ("blocks", "viscosity"), Simulated(measurable=Measurable(None, ())), asked).numbers[0]
        assert (jnds.number, jnds.note) == ("none", ("bad", "warning", why))
        assert jnds.more.startswith(f"{more} clipped" if "clipped" in why else more)
    if threshold is None:
        return
    observed = Observed(threshold, 0.02, 400, 0.75, (0.1,), (0.7,), ((0.7,),), (), ((1, (0.1,) * 5),), (), 0.03, 80)
    group = GroupPrecision(12, 60, 0.15, 80, 1.0, 107, 1.0, 60, 12)
    simulated, asked = Simulated(observed, group=group), Controls(threshold=threshold)
    _, one, people, _ = view(study, ("blocks", "viscosity"), simulated, asked).numbers
    if threshold == 0.019 or not why:  # its levels are presented in full
        assert (one.number, people.note[2]) == ("± 3", "Enough")
        return
    for card in (one, people):
        assert (card.number, card.note) == (UNKNOWN, ("bad", "warning", CLIPPED))
        assert card.more == f"{more} clipped: observers are simulated with what the limits leave"
