"""A study with every kind of question, from its rehearsal to tables, verification, export, SPSS and report."""

import json
import re
import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.export.tables import wide_table
from study_app.analysis.report.first_page import cards
from study_app.analysis.report.methods import methods
from study_app.analysis.report.write_report import report
from study_app.protocol import questions
from study_app.protocol.load import load
from study_app.protocol.warnings.study_warnings import warnings
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.exclusions import exclude
from study_app.store.files.folders import StudyFolder
from study_app.store.unblinding import unblind
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.protocol.forms.mixed import mixed_file
from tests.studies import made_up

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

PEOPLE = 6


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("mixed")
    protocol = mixed_file(place)
    return rehearse_answers(
        protocol, participants=PEOPLE, seed=1, results=place / "results", features=made_up(protocol)
    )


@pytest.fixture(scope="module")
def study(folder: Path) -> Study:
    return load_study(folder)


def test_only_the_scale_of_an_answer_has_ends(study: Study) -> None:
    questions = {question.id: question for question in study.others.questions}
    ends = {"age": None, "since": None, "comment": None, "thickness": (1, 5), "pleasant": (0, 100), "effort": (0, 100)}
    assert {name: questions[name].scale_ends for name in ends} == ends
    assert questions["age"].bounds == (16, 99)


def test_answers_that_are_given_missing_and_off_the_scale_are_counted(study: Study) -> None:
    """About each liquid, the first of six participants does not answer, and the next two cannot judge."""
    answered = study.answered.copy()
    place = answered[answered["item"] == "thickness"].groupby("code").cumcount()
    answered.loc[place.index[place < 3], ["response", "value"]] = pd.NA
    answered.loc[place.index[place.isin([1, 2])], "cannot_judge"] = True
    results = evaluate(replace(study, answered=answered), recordings=False)
    (thickness,) = (result for result in results.questions if result.item == "thickness")
    counts = {"n": 3, "participants": 3, "cannot_judge": 2, "missing": 1}
    assert [{name: group.numbers[name] for name in counts} for group in thickness.groups] == [counts] * 2


def test_order_is_reproduced_where_answers_hid_questions(tmp_path: Path) -> None:
    condition = 'id = "pleasant"\nshow_if = { item = "thickness", at_least = 3 }'
    protocol = mixed_file(tmp_path, ('id = "pleasant"', condition))
    folder = rehearse_answers(
        protocol, participants=8, seed=1, results=tmp_path / "results", features=made_up(protocol)
    )
    sessions = StudyFolder(folder).sessions()
    answered = len(load_study(folder).answered.query("item == 'pleasant'"))
    assert 0 < answered < 2 * len(sessions)  # hidden from some
    assert [reproduce_session(session.path).differences for session in sessions] == [[]] * 8
    assert verify_study(folder).errors == ()


def test_answers_of_an_excluded_session_do_not_count(folder: Path, tmp_path: Path) -> None:
    copied = tmp_path / "copied"
    shutil.copytree(folder, copied)
    exclude(copied, "P002", 1, by="AB", reason="asleep")
    left = load_study(copied)
    age_question = next(question for question in left.others.questions if question.id == "age")
    assert len(left.answers_to(age_question)) == PEOPLE - 1


@pytest.mark.usefixtures("png_figures_only")
@pytest.mark.parametrize("order", ["fixed", "balanced", "random", "groups"])
def test_a_form_after_each_block_is_analysed_block_by_block(tmp_path: Path, order: str) -> None:
    grouped = order == "groups"
    orders = [["load", "stir", "usability", "load", "again", "load"], ["again", "load", "stir", "load"]]
    groups = "".join(f"[groups.g{n}]\nsequence = {order}\n" for n, order in enumerate(orders)) if grouped else ""
    again = '[blocks.again]\nquestionnaire = "after"\nconditions = ["thin", "thick"]\n'
    last = 'conditions = ["thin", "thick"]'
    old = 'sequence = ["start", "stir", "load", "usability", "end"]'
    sequence = (old, "" if grouped else f"sequence = {orders[0]}"), (last, f"{last}\n{again}{groups}")
    name = 'name = "mixed"'
    name_edit = (name, name if grouped else f'{name}\nblock_order = "{order}"')
    protocol = mixed_file(tmp_path, *sequence, name_edit)
    folder = rehearse_answers(
        protocol, participants=PEOPLE, seed=1, results=tmp_path / "results", features=made_up(protocol)
    )
    assert verify_study(folder).errors == ()
    assert [reproduce_session(session.path).differences for session in StudyFolder(folder).sessions()] == [[]] * PEOPLE
    study = load_study(folder)
    began = study.trials.sort_values("trial").groupby("participant").first()
    assert set(began["part"]) == {1}
    firsts = Counter(began["block"])
    counts = {"fixed": [PEOPLE], "balanced": [PEOPLE // 2] * 2, "groups": [PEOPLE // 2] * 2}
    assert list(firsts.values()) == counts[order] if order in counts else len(firsts) == 2
    first = PEOPLE // 2 if grouped else PEOPLE
    n = {"At the start": first, "After Stir": PEOPLE, "After Again": PEOPLE}
    results = evaluate(study)
    effort = next(question for question in results.questions if (question.where, question.item) == ("load", "effort"))
    assert {group.name: group.numbers["n"] for group in effort.groups} == n
    score = next(score for score in results.scores if score.where == "load")
    assert {group.name: group.numbers["n"] for group in score.groups} == n
    table, _ = wide_table(study)
    rows = study.answered.query("form == 'load' and item == 'effort'").set_index("participant")
    codes = ["0", "stir", "again"]
    for code in codes:
        after = rows[rows["after_block"].fillna("0") == code]["value"].reindex(table.frame["participant"])
        assert table.frame[f"load__effort__{code}"].astype("Float64").to_list() == after.to_list()
    assert len({tuple(table.frame[f"load__effort__{code}"].fillna(-1)) for code in codes}) == 3
    assert "usability__sus1" in table.frame
    report(folder, tmp_path / "report", failed=pytest.fail)
    assert "After Again" in (tmp_path / "report" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("blocks", "uses"),
    [
        (("stir", "again"), {"stir": "After Stir", "again": "After Again"}),
        (("stir", "stir"), {"stir__1": "After Stir, session 1", "stir__2": "After Stir, session 2"}),
    ],
)
def test_a_form_in_each_of_two_sessions_is_analysed_session_by_session(
    tmp_path: Path, blocks: tuple[str, str], uses: dict[str, str]
) -> None:
    """Each participant counts once per session; the form also has a question with options and a text question."""
    last = 'conditions = ["thin", "thick"]'
    old = 'sequence = ["start", "stir", "load", "usability", "end"]'
    steps = ", ".join(f'["{block}", "load", "start"]' for block in blocks)
    again = f"{last}\n[blocks.again]\n{last}" if "again" in blocks else last
    protocol = mixed_file(tmp_path, (old, f"sequences = [{steps}]"), (last, again))
    folder = rehearse_answers(
        protocol, participants=PEOPLE, seed=4, results=tmp_path / "results", features=made_up(protocol)
    )
    study = load_study(folder)
    results = evaluate(study, recordings=False)
    rows = study.answered[study.answered["form"] == "load"].astype({"value": float})
    raw = rows.groupby(["session", "participant"])["value"].mean()  # the mean of the six ratings
    (score,) = (score for score in results.scores if (score.where, score.name) == ("load", "raw"))
    assert [group.name for group in score.groups] == [*uses.values()]
    for session, group in enumerate(score.groups, start=1):
        assert group.numbers["n"] == PEOPLE
        assert (group.numbers["mean"], group.numbers["sd"]) == pytest.approx((raw[session].mean(), raw[session].std()))
    table, _ = wide_table(study)
    for session, code in enumerate(uses, start=1):
        cells = table.frame[f"load__raw__{code}"].astype(float).to_list()
        assert cells == pytest.approx(raw[session].reindex(table.frame["participant"]).to_list())
    hands = study.answered[study.answered["item"] == "hand"]
    (hand,) = (result for result in results.questions if result.item == "hand")
    assert [group.numbers["counts"] for group in hand.groups] == [
        {option: int((rows["response"] == option).sum()) for option in ("left", "right", "both")}
        for _, rows in hands.groupby("session")
    ]
    assert {group.numbers["n"] for group in hand.groups} == {PEOPLE}
    assert "(six questions) after the last block of each session." in methods(study, results)


def test_readers_see_the_name_of_a_standard_questionnaire_in_place_of_its_title(tmp_path: Path) -> None:
    before = '[questionnaires.before]\ninstrument = "nasa-tlx"\ntitle.en = "At first"\n\n[questionnaires.load]'
    sequence = 'sequence = ["start", "stir", "load", "usability", "end"]'
    protocol = mixed_file(
        tmp_path, (sequence, sequence.replace('"stir"', '"before", "stir"')), ("[questionnaires.load]", before)
    )
    folder = rehearse_answers(
        protocol, participants=1, seed=1, results=tmp_path / "results", features=made_up(protocol)
    )
    places = {question.where.id: question.where.title for question in load_study(folder).others.questions}
    assert places == {
        "start": "Start",
        "before": "NASA-TLX (At first)",
        "stir": "Stir",
        "load": "NASA-TLX (Task load)",
        "usability": "SUS",
        "end": "End",
    }


@pytest.mark.usefixtures("png_figures_only")
def test_blocks_with_the_same_title_have_distinct_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Answers are random, because a simulated participant rates the task load of all blocks alike."""
    monkeypatch.setattr(questions.SliderView, "simulated", lambda _self, _opinion, draw: 5 * int(20 * draw()))
    again = '[blocks.again]\ntitle = "Stir"\nconditions = ["thin", "thick"]'
    last = 'conditions = ["thin", "thick"]'
    sequence = 'sequence = ["start", "stir", "load", "usability", "end"]'
    protocol = mixed_file(
        tmp_path, (sequence, 'sequence = ["stir", "load", "again", "load"]'), (last, f"{last}\n{again}")
    )
    assert [line for line in warnings(load(protocol), simulates=False) if "same title" in line] == [
        "blocks.again.title: block stir has the same title, “Stir”, so the report adds the IDs to both; use a "
        "different title for each block"
    ]
    folder = rehearse_answers(
        protocol, participants=PEOPLE, seed=1, results=tmp_path / "results", features=made_up(protocol)
    )
    report(folder, tmp_path / "report", failed=pytest.fail)
    content = json.loads((tmp_path / "report" / "report.json").read_bytes())
    (score,) = (score for score in content["results"]["scores"] if score["where"] == "load")
    means = {group["name"]: group["numbers"]["mean"] for group in score["groups"]}
    assert list(means) == ["After Stir (stir)", "After Stir (again)"]
    first, second = means.values()
    assert first != second
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8").replace("\u00a0", " ")
    match = re.search(
        r"score was (\S+) \[[^]]+\] after Stir \(stir\) and (\S+) \[[^]]+\] after Stir \(again\) .* "
        r"difference \(after Stir \(stir\) − after Stir \(again\)\) was (\S+) \[",
        page,
    )
    assert match is not None
    assert [float(word.replace("−", "-")) for word in match.groups()] == pytest.approx(
        [first, second, first - second], rel=5e-3
    )
    figure_names = [
        f"question-{question['where']}-{question['item']}.png" for question in content["results"]["questions"]
    ]
    assert len(figure_names) == 8, "two after each trial and those of the NASA-TLX"
    assert sorted(figure_names) == sorted(path.name for path in (tmp_path / "report").glob("question-*.png"))


@pytest.mark.parametrize("order", ["balanced", "random"])
def test_a_form_after_the_last_of_exchanged_blocks_has_all_its_answers(tmp_path: Path, order: str) -> None:
    """The form follows either block, although the file places it after one of them."""
    last = 'conditions = ["thin", "thick"]'
    sequence = 'sequence = ["start", "stir", "load", "usability", "end"]'
    protocol = mixed_file(
        tmp_path,
        (sequence, 'sequence = ["load", "stir", "again", "load"]'),
        (last, f"{last}\n[blocks.again]\n{last}"),
        ('name = "mixed"', f'name = "mixed"\nblock_order = "{order}"'),
    )
    folder = rehearse_answers(
        protocol, participants=PEOPLE, seed=1, results=tmp_path / "results", features=made_up(protocol)
    )
    assert verify_study(folder).errors == ()
    study = load_study(folder)
    rows = study.answered.query("form == 'load' and item == 'effort'")
    counts = Counter(rows["after_block"].fillna("0"))
    assert counts["0"] == counts["stir"] + counts["again"] == PEOPLE
    assert min(counts["stir"], counts["again"]) > 0
    table, _ = wide_table(study)
    assert {code: table.frame[f"load__effort__{code}"].count() for code in counts} == counts
    effort = next(
        question for question in evaluate(study).questions if (question.where, question.item) == ("load", "effort")
    )
    words = {"0": "At the start", "stir": "After Stir", "again": "After Again"}
    assert {group.name: group.numbers["n"] for group in effort.groups} == {words[code]: n for code, n in counts.items()}


def test_the_methods_describe_a_block_without_statements(tmp_path: Path) -> None:
    statement = (
        '[[questionnaires.after.items]]\nid = "feels_liquid"\ntext = "It feels like a liquid."\nshort = "Liquid"\n'
    )
    protocol = mixed_file(tmp_path, (statement, ""), ('order = "shuffled"', 'order = "williams"\nrepetitions = 3'))
    folder = rehearse_answers(
        protocol, participants=2, seed=1, results=tmp_path / "results", features=made_up(protocol)
    )
    unblind(folder, by="AK", reason="test")
    study = load_study(folder)
    words = methods(study, evaluate(study, recordings=False))
    assert (
        "In “Stir”, two conditions (thin and thick) were presented in orders from a Williams design, 3 times each; "
        "participants answered two questions after each presentation."
    ) in words
    assert "The simulated liquids were thin (" in words


def test_the_methods_count_the_questions_beside_statements(study: Study) -> None:
    words = methods(study, evaluate(study, recordings=False))
    assert "In “Stir”, participants also answered two other questions after each presentation." in words


def test_the_first_page_names_options_as_participants_read_them_and_omits_the_weights_of_a_score(
    tmp_path: Path,
) -> None:
    protocol = mixed_file(tmp_path, ('instrument = "nasa-tlx"', 'instrument = "nasa-tlx-weighted"'))
    folder = rehearse_answers(
        protocol, participants=3, seed=1, results=tmp_path / "results", features=made_up(protocol)
    )
    results = evaluate(load_study(folder), recordings=False)
    assert sum(result.weighs for result in results.questions) == 15
    sentences = [sentence for card in cards(results) for sentence in card.sentences]
    assert not [sentence for sentence in sentences if "demand or" in sentence]
    (used,) = [sentence for sentence in sentences if sentence.startswith("“Used”")]
    assert re.search("participants chose “A (mouse|haptic device)”", used)
