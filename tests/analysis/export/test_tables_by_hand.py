"""The exported tables, codebook and .sav file of a study in memory, against a few lines of its own answers."""

import hashlib
import io
import json
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from statistics import median
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyreadstat
import pytest
from pyarrow import parquet

from study_app.analysis.data.blocks import Item, OtherQuestions, PlacedScore, Setting
from study_app.analysis.data.study_tables import Study
from study_app.analysis.export import psychds_dataset, spss, table_files
from study_app.analysis.export import tables as table_module
from study_app.analysis.export.table_files import codebook_bytes, credit_lines, file_name
from study_app.analysis.export.tables import ExportTable, exported_tables, sealed_interval_columns, wide_table
from study_app.protocol.source.files import StudySource, _has_study_name
from study_app.store.exclusions import Exclusion
from study_app.store.files import SEALED, TRIALS_MISSING
from study_app.store.files.columns import INTERVALS
from study_app.store.files.csv_files import Column, header, optional, unsealed_columns
from tests.analysis.made_up import ITEMS, study
from tests.golden import as_on_linux

SETTINGS = tuple(
    Setting(code=f"L{place}", condition=f"c{place}", liquid=f"oil{place}", delay_ms=10.0 * place + 0.5)
    for place in (1, 2, 3)
)
PEOPLE = ("A-P001", "A-P002", "B-P001", "B-P009", "B-P010")
UNSURE, LEFT_OUT = ("A-P001", "L2"), "B-P010"


class Given(NamedTuple):
    """An answer of a participant; its value is None if it is missing."""

    participant: str
    code: str
    item: str
    value: int | None


@pytest.fixture(scope="module")
def answers() -> list[Given]:
    """Two answers of each person to each statement on each setting, of which some are missing."""
    draw = np.random.default_rng(20)
    return [
        Given(person, setting.code, item, None if draw.random() < 0.15 else int(draw.integers(1, 8)))
        for person in PEOPLE for _ in range(2) for setting in SETTINGS for item in ITEMS
    ]  # fmt: skip


@pytest.fixture(scope="module")
def two_site_study(answers: list[Given]) -> Study:
    """Five people of two sites; A-P001 cannot judge L2, and B-P010's session is excluded."""
    pairs = zip(answers[::2], answers[1::2], strict=True)
    case_study = study(
        SETTINGS, [(answer.participant, 1, answer.code, [answer.value, other.value]) for answer, other in pairs]
    )
    trials = case_study.trials.assign(delay_error_mean_ms=np.arange(len(case_study.trials)) * 0.25 - 3)
    rows = case_study.responses
    unsure = (rows["participant"] == UNSURE[0]) & (rows["code"] == UNSURE[1])
    rows = rows.assign(cannot_judge=unsure, response=rows["response"].mask(unsure), title=rows["item"])
    tables = {"trials": trials, "responses": rows, "participants": case_study.participants}
    for name, table in tables.items():
        excluded = table["participant"] == LEFT_OUT
        tables[name] = table.assign(excluded=excluded, counted=~excluded)
    (block,) = case_study.blocks
    block = replace(block, items=tuple(Item(id=item, text=f"It is {item}.", short=item[:3]) for item in ITEMS))
    return replace(case_study, blocks=(block,), sites=("A", "B"), answered=tables["responses"], **tables)


def counted_answers(answers: list[Given]) -> Iterator[Given]:
    for answer in answers:
        if answer.participant != LEFT_OUT and (answer.participant, answer.code) != UNSURE:
            yield answer


def test_each_answer_has_its_own_condition_delay_and_site(two_site_study: Study, answers: list[Given]) -> None:
    tables = {table.name: table.frame for table in exported_tables(two_site_study)}
    responses = tables["responses"].astype(object)
    may_miss = [
        (table.name, column.name)
        for table in exported_tables(two_site_study)
        for column in table.columns
        if column.may_miss and column.name in {"condition", "liquid", "delay_ms", "delay_achieved_ms"}
    ]
    assert may_miss == [
        *(("responses", name) for name in ("condition", "liquid", "delay_ms", "delay_achieved_ms")),
        ("trials", "delay_achieved_ms"),
    ]
    assert len(responses) == len(answers)
    for answer, (at, row) in zip(answers, responses.iterrows(), strict=True):
        place = int(answer.code[1])
        assert (row["participant"], row["code"], row["item"], row["site"]) == (*answer[:3], answer.participant[0])
        assert (row["condition"], row["liquid"], row["delay_ms"]) == (f"c{place}", f"oil{place}", 10.0 * place + 0.5)
        trial = int(str(at)) // 2
        assert row["trial"] == trial + 1
        assert row["delay_achieved_ms"] == pytest.approx(10.0 * place + 0.5 + trial * 0.25 - 3)
        is_given = answer.value is not None and (answer.participant, answer.code) != UNSURE
        assert row["response"] == str(answer.value) if is_given else pd.isna(row["response"])
        assert row["counted"] == (answer.participant != LEFT_OUT)
    assert list(tables["trials"]["code"]) == [answer.code for answer in answers[::2]]
    assert list(tables["trials"]["delay_achieved_ms"]) == list(responses["delay_achieved_ms"][::2])


def test_each_row_of_the_aggregate_counts_the_answers_on_one_setting(
    two_site_study: Study, answers: list[Given]
) -> None:
    (table,) = (table for table in exported_tables(two_site_study) if table.name == "aggregate")
    aggregate, descriptions = table.frame, {column.name: column.description for column in table.columns}
    meanings = {
        "n": "valid answers", "missing": "without an answer", "cannot_judge": "“cannot judge”", "count_3": "level 3.",
        "median": "Median", "q1": "Lower quartile", "q3": "Upper quartile", "agree_percent": "levels 5 to 7",
    }  # fmt: skip
    assert [name for name, meaning in meanings.items() if meaning not in descriptions[name]] == []
    assert list(zip(aggregate["code"], aggregate["item"], strict=True)) == [
        (setting.code, item) for setting in SETTINGS for item in ITEMS
    ]
    for row in aggregate.to_dict("records"):
        of_cell = [answer for answer in answers if answer[1:3] == (row["code"], row["item"])]
        values = [answer.value for answer in counted_answers(of_cell) if answer.value is not None]
        unsure = 2 * (row["code"] == UNSURE[1])
        assert (row["condition"], row["liquid"]) == (f"c{row['code'][1]}", f"oil{row['code'][1]}")
        assert (row["block"], row["short"], row["study"]) == ("b", row["item"][:3], "made_up")
        assert (row["simulated"], row["pilot"]) == (True, False)
        assert (row["n"], row["cannot_judge"], row["presented"]) == (len(values), unsure, 8)
        assert row["missing"] == 8 - len(values) - unsure
        assert row["participants"] == len({a.participant for a in counted_answers(of_cell) if a.value is not None})
        assert [row[f"count_{level}"] for level in range(1, 8)] == [values.count(level) for level in range(1, 8)]
        assert row["median"] == median(values)
        assert row["q1"] < row["q3"] or row["q1"] == row["q3"] == row["median"]
        assert row["agree_percent"] == pytest.approx(100 * sum(value >= 5 for value in values) / len(values), abs=0.05)


@pytest.mark.parametrize("recorded_in", ["participants", "trials"])
def test_the_wide_table_states_each_persons_group(two_site_study: Study, recorded_in: str) -> None:
    """Receipts state pre-existing groups; only the opened journal states randomised ones."""
    of_person = {"A-P001": "zinc", "A-P002": "amber", "B-P001": "zinc", "B-P010": "amber"}
    tables = {name: getattr(two_site_study, name).assign(group=pd.NA) for name in ("participants", "trials")}
    tables[recorded_in]["group"] = tables[recorded_in]["participant"].map(of_person)
    table, _ = wide_table(replace(two_site_study, **tables))
    assert header(table.columns)[:4] == ("participant", "site", "simulated", "group")
    assert list(table.frame["group"].fillna("n/a")) == ["zinc", "amber", "zinc", "n/a"]
    assert "group" not in wide_table(two_site_study)[0].frame


def test_the_wide_table_has_the_median_of_each_persons_answers(two_site_study: Study, answers: list[Given]) -> None:
    table, cells = wide_table(two_site_study)
    wide = table.frame.set_index("participant")
    assert list(wide.index) == list(PEOPLE[:-1])
    assert list(wide["site"]) == ["A", "A", "B", "B"]
    assert list(cells) == [f"{item}__c{place}" for place in (1, 2, 3) for item in ITEMS]
    for name, cell in cells.items():
        item, _, condition = name.partition("__c")
        repeated = False
        for person in wide.index:
            values = [
                answer.value
                for answer in counted_answers(answers)
                if answer[:3] == (person, f"L{condition}", item) and answer.value is not None
            ]
            repeated |= len(values) > 1
            held = wide.loc[person, name]
            assert held == median(values) if values else pd.isna(held), (name, person)
        (column,) = (column for column in table.columns if column.name == name)
        note = " The median of each participant's answers." if repeated else ""
        assert (
            column.description == f"It is {item}. About {two_site_study.blocks[0].name(cell.setting)}, in Block.{note}"
        )
        assert (column.minimum, column.maximum) == (1, 7)
        assert column.kind == ("integer" if (wide[name].dropna() % 1 == 0).all() else "number")
    responses = two_site_study.responses["response"]
    same = wide_table(
        replace(
            two_site_study, responses=two_site_study.responses.assign(response=responses.mask(responses.notna(), 4))
        )
    )[0]
    assert {column.kind for column in same.columns[3:]} == {"integer"}
    schema = parquet.read_schema(io.BytesIO(table_files._parquet_bytes(same)))
    assert {str(schema.field(column.name).type) for column in same.columns[3:]} == {"int8"}


def test_repeated_texts_have_a_column_for_each_session_and_answer_in_the_wide_table(
    two_site_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    texts = pd.DataFrame(
        {"participant": ["A-P002"] * 3, "session": [2, 1, 2], "trial": [3, 8, 1], "response": ["last", "first", "next"]}
    )
    form = SimpleNamespace(id="end", title="End", is_form=True, settings=())
    question: Any = SimpleNamespace(id="why", text="Why?", where=form, question=SimpleNamespace(value_type="text"))
    monkeypatch.setattr(Study, "answers_to", lambda *_: texts)
    others: Any = SimpleNamespace(questions=(question,), scores=())
    table = wide_table(replace(two_site_study, others=others))[0]
    wide = table.frame.set_index("participant").filter(like="end__why")
    assert wide.loc["A-P002"].to_dict() == {
        "end__why__1__1": "first",
        "end__why__2__1": "next",
        "end__why__2__2": "last",
    }
    assert wide.drop(index="A-P002").isna().all(axis=None)
    assert table.columns[-1].description == "Why? In End. Session 2, answer 2."


def test_questions_and_scores_have_their_answers_and_texts_in_the_wide_table_spss_and_codebook(
    two_site_study: Study, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    form: Any = SimpleNamespace(
        id="end", title="End", is_form=True, settings=(Setting(code="stir"), Setting(code="again")),
        name=lambda setting: f"After {setting.code}",
    )  # fmt: skip
    mild = (Setting(code="Q1", condition="mild"),)
    block: Any = SimpleNamespace(id="q", title="Oils", is_form=False, settings=mild, name=lambda it: it.condition)
    pick_question: Any = SimpleNamespace(model_dump=lambda mode: {"item": "pick", "mode": mode})
    sure: Any = SimpleNamespace(
        where=form, id="sure", text="How sure?", short="Sure", levels={"2": "low", "9": "high"}, bounds=(2, 9),
        cannot_judge="no idea", question=SimpleNamespace(value_type="number", kind_id="scale", show_if=pick_question),
    )  # fmt: skip
    options: Any = SimpleNamespace(value_type="text", kind_id="choice", show_if=None, names_several=False)
    pick: Any = SimpleNamespace(
        where=block, id="pick", text="Pick one", short="Pick", levels={"o": "Oil", "w": "Water"}, bounds=None,
        cannot_judge=None, question=options,
    )  # fmt: skip
    score: Any = SimpleNamespace(model_dump=lambda mode, exclude_defaults: {"mean_of": ["sure"]})
    raw = PlacedScore(form, "raw", "tlx", score, ())
    rows = pd.DataFrame(
        [
            *(("A-P001", "stir", value) for value in (3, 8, 4)), ("A-P002", "stir", 7), ("A-P001", "again", 8),
            ("A-P002", "again", None), ("B-P001", "again", None),
        ],
        columns=["participant", "code", "value"],
    )  # fmt: skip
    rows = rows.assign(counted=rows["participant"] != "B-P001", excluded=rows["participant"] == "B-P001")
    rows = rows.assign(cannot_judge=rows["counted"] & rows["value"].isna(), score=rows["value"] * 10 + 1)
    picked = pd.DataFrame(
        [
            ("A-P001", "Q1", "o", 2, 1),
            ("A-P001", "Q1", "w", 1, 9),
            ("A-P002", "Q1", "w", 1, 2),
            ("B-P001", "Q2", "o", 1, 1),
        ],
        columns=["participant", "code", "response", "session", "trial"],
    ).assign(counted=True, excluded=False, cannot_judge=False)
    monkeypatch.setattr(Study, "rows_in", lambda _study, where: rows if where is form else picked)
    for method in ("answers_to", "rows_of"):
        monkeypatch.setattr(Study, method, lambda _study, question: rows if question is sure else picked)
    monkeypatch.setattr("study_app.analysis.export.tables.scored", lambda _study, _score: rows)
    of_levels: Any = SimpleNamespace(id="size", where=SimpleNamespace(id="track", settings=()))
    questions_study = replace(two_site_study, others=OtherQuestions(questions=(sure, pick, of_levels), scores=(raw,)))
    track: Any = SimpleNamespace(id="track")
    assert "track__size" not in wide_table(replace(questions_study, levels=(track,)))[1]
    questions_study = replace(two_site_study, others=OtherQuestions(questions=(sure, pick), scores=(raw,)))
    table, cells = wide_table(questions_study)
    median = " The median of each participant's answers (hypotheses and the first page of the report use the mean)."
    expected = {
        "end__sure__stir": (4, 7, f"How sure? In End. After stir.{median}", 2, 9),
        "end__sure__again": (8, None, "How sure? In End. After again.", 2, 9),
        "q__pick__mild__1": ("w", "w", "Pick one. In Oils. About mild. Session 1, answer 1.", None, None),
        "q__pick__mild__2": ("o", None, "Pick one. In Oils. About mild. Session 2, answer 1.", None, None),
        "end__raw__stir": (41, 71, f"Score raw of tlx, in End. After stir.{median}", None, None),
        "end__raw__again": (81, None, "Score raw of tlx, in End. After again.", None, None),
    }
    columns = {column.name: column for column in table.columns if column.name in expected}
    assert list(columns) == [*expected]
    for name, (first, second, description, minimum, maximum) in expected.items():
        held = [None if pd.isna(cell) else cell for cell in table.frame[name]]
        assert held == [first, second, None, None], name
        column = columns[name]
        assert (column.description, column.minimum, column.maximum) == (description, minimum, maximum)
    (tmp_path / "wide.sav").write_bytes(spss.wide_sav(questions_study, table, cells))
    frame, about = pyreadstat.read_sav(tmp_path / "wide.sav", user_missing=True)
    assert frame[["end__sure__stir", "end__sure__again", "q__pick__mild__2", "end__raw__stir"]].fillna(
        -1
    ).T.to_numpy().tolist() == [[4, 7, 99, 99], [8, 98, 97, 99], [1, 99, 99, 99], [41, 71, -1, -1]]
    off = {96: "Not shown", 97: "Excluded", 99: "No answer"}
    labels = {"end__sure__again": {2: "low", 9: "high", 98: "no idea", **off}}
    labels["q__pick__mild__2"] = {1: "Oil", 2: "Water", 98: "Cannot judge", **off}
    assert {name: about.variable_value_labels[name] for name in labels} == labels
    measures = {"end__sure__again": "ordinal", "q__pick__mild__2": "nominal", "end__raw__stir": "scale"}
    assert {name: about.variable_measure[name] for name in measures} == measures
    book = json.loads(codebook_bytes(questions_study, {}))
    assert book["questions"] == [
        {
            "form": "end", "id": "sure", "kind": "scale", "text": "How sure?", "short": "Sure", "range": [2, 9],
            "levels": {"2": "low", "9": "high"}, "cannot_judge": "no idea", "show_if": {"item": "pick", "mode": "json"},
        },
        {
            "block": "q", "id": "pick", "kind": "choice", "text": "Pick one", "short": "Pick",
            "levels": {"o": "Oil", "w": "Water"},
        },
    ]  # fmt: skip
    assert book["scores"] == [{"form": "end", "name": "raw", "instrument": "tlx", "mean_of": ["sure"]}]


def test_the_codebook_counts_answers_and_names_conditions_with_the_same_delay(
    two_site_study: Study, answers: list[Given]
) -> None:
    settings = tuple(
        replace(setting, delay_ms=delay_ms) for setting, delay_ms in zip(SETTINGS, (40.0, 10.0, 10.0), strict=True)
    )
    block = replace(two_site_study.blocks[0], kind="delays", settings=settings)
    counts = Counter(
        (answer.participant, answer.code == "L1", answer.item)
        for answer in counted_answers(answers)
        if answer.value is not None
    ).values()
    assert min(counts) < 2 < max(counts)
    assert table_files._presentations(two_site_study, block) == {
        "answers_per_participant_setting_and_item": [min(counts), max(counts)],
        "sessions": [1],
        "replicates": [["L2", "L3"]],
    }


@pytest.mark.slow
def test_the_codebook_and_the_sav_file_name_every_level_setting_and_missing_answer(
    two_site_study: Study, answers: list[Given], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("study_app.analysis.export.table_files.reveals_of", lambda _folder: ({"by": "AK"},))
    table, cells = wide_table(two_site_study)
    excluded = Exclusion(
        participant=LEFT_OUT, session=1, trial=None, rule_or_person="AK", reason="spoke", excluded_at="t"
    )
    block = replace(two_site_study.blocks[0], labels=tuple("abcdefg"), cannot_judge="unsure")
    labelled = replace(two_site_study, blocks=(block,), exclusions=(excluded,))
    cells = {name: replace(cell, block=labelled.blocks[0]) for name, cell in cells.items()}
    files = table_files.table_files(labelled, (*exported_tables(labelled), table), ("sav", "wide", "parquet"), cells)
    book: dict[str, Any] = json.loads(files["codebook.json"])
    (block,) = book["blocks"]
    assert block["levels"] == dict(zip("1234567", "abcdefg", strict=True))
    assert [row["participant"] for row in book["exclusions"]] == [LEFT_OUT]
    assert (block["cannot_judge"], book["key_opened"], book["blinded"]) == ("unsure", [{"by": "AK"}], False)
    assert block["settings"] == [
        {"code": f"L{n}", "condition": f"c{n}", "liquid": f"oil{n}", "delay_ms": 10.0 * n + 0.5} for n in (1, 2, 3)
    ]
    assert block["items"] == [{"id": item, "text": f"It is {item}.", "short": item[:3]} for item in ITEMS]
    assert block["sessions"] == [1]
    head = ("participants", "sites", "sessions", "sessions_left_out", "sessions_excluded", "simulated", "pilot")
    assert [book["study"][name] for name in head] == [4, ["A", "B"], 5, 0, 1, True, False]
    schema = parquet.read_schema(io.BytesIO(files["study-made_up_description-responses_data.parquet"]))
    kinds = {"trial": "int64", "counted": "bool", "code": "string", "delay_ms": "double"}
    assert {name: str(schema.field(name).type) for name in kinds} == kinds
    path = tmp_path / "wide.sav"
    path.write_bytes(files["study-made_up_description-wide_data.sav"])
    frame, meta = pyreadstat.read_sav(path, user_missing=True)
    assert list(frame["participant"]) == list(PEOPLE[:-1])
    for name in cells:
        labels = meta.variable_value_labels[name]
        assert [labels[float(level)] for level in range(1, 8)] == list("abcdefg")
        texts = [labels.get(value, value) for value in frame[name]]
        assert (texts[0] == "unsure") == name.endswith("c2")
        assert meta.variable_measure[name] == "ordinal"
    assert {text for name in cells for text in frame[name].map(meta.variable_value_labels[name])} >= {"unsure"}


def test_missing_answers_have_the_code_of_their_reason() -> None:
    people = pd.Series(["P1", "P2", "P3", "P4", "P5", "P6", "P7", "P8"])
    rows = pd.DataFrame(
        {
            "participant": ["P2", "P3", "P4", "P4", "P5"],
            "counted": [True, False, True, False, True],
            "cannot_judge": pd.array([True, False, False, True, None], dtype="boolean"),
            "excluded": [False, True, False, True, False],
        }
    )
    others = pd.DataFrame({"participant": ["P1", "P6", "P7"], "counted": [True, True, False]})
    answer_rows = pd.concat([rows, others.assign(cannot_judge=False, excluded=[False, False, True])])
    values = pd.Series([4, *[None] * 7], dtype="Float64")
    coded = spss._code_missing_answers(values, people, rows, answer_rows)
    labels = spss._value_labels({4: "four"}, "unsure")
    assert [labels[int(value)] for value in coded] == [
        "four", "unsure", "Excluded", "No answer", "No answer", "Not shown", "Excluded", "No answer",
    ]  # fmt: skip
    assert spss._value_labels({}, "")[int(coded[1])] == "Cannot judge"


def test_names_in_sav_are_valid_and_differ_without_case() -> None:
    names = ["a b", "A_b", "all", "1st", "x" * 70, "x" * 71, "é"]
    short = list(spss._spss_names(names).values())
    assert short == ["a_b", "A_b_2", "v_all", "v_1st", "x" * 64, f"{'x' * 62}_2", "v"]


COLUMNS = (
    Column("a_text", "text", "Words.", unit="m"),
    optional("a_flag", "flag", "Whether."),
    Column("a_whole", "integer", "Count.", minimum=1, maximum=7, levels=(("1", "low"), ("7", "high"))),
    optional("a_number", "number", "Length.", unit="mm", minimum=0),
    Column("a time", "time", "When."),
)


def test_each_column_of_sav_has_its_label_format_measure_and_values(two_site_study: Study, tmp_path: Path) -> None:
    rows = {
        "a_text": ["x", None],
        "a_flag": [True, None],
        "a_whole": [3, 4711],
        "a_number": [0.5, None],
        "a time": ["z", "y"],
    }
    types = {"a_text": "string", "a_flag": "boolean", "a_whole": "Int64", "a_number": "Float64", "a time": "string"}
    frame = pd.DataFrame({name: pd.array(values, dtype=types[name]) for name, values in rows.items()})
    path = tmp_path / "x.sav"
    labels = {1: "low", 96: "Not shown", 97: "Excluded", 99: "No answer"}
    path.write_bytes(
        spss.sav(replace(two_site_study, version="2.5"), ExportTable("t", COLUMNS, frame), {"a_whole": labels})
    )
    labelled_frame, about = pyreadstat.read_sav(path, user_missing=True)
    assert about.file_label == "Made up (made_up 2.5)"
    assert about.column_names_to_labels == {
        "a_text": "Words. [m]", "a_flag": "Whether.", "a_whole": "Count.", "a_number": "Length. [mm]",
        "a_time": "a time: When.",
    }  # fmt: skip
    assert about.variable_value_labels == {"a_flag": {0: "false", 1: "true"}, "a_whole": labels}
    measure = {"a_text": "nominal", "a_flag": "nominal", "a_whole": "ordinal", "a_number": "scale", "a_time": "nominal"}
    assert about.variable_measure == measure
    assert about.missing_ranges == {"a_whole": [{"lo": 96, "hi": 99}]}
    formats = {"a_flag": "F1.0", "a_whole": "F4.0"}
    assert {name: about.original_variable_types[name] for name in formats} == formats
    assert labelled_frame.astype(object).where(labelled_frame.notna(), None).to_numpy().tolist() == [
        ["x", 1, 3, 0.5, "z"], ["", None, 4711, None, "y"],
    ]  # fmt: skip


CREDITS = {
    "authors": ["A. Kox", "B. Lam"], "license": "CC0", "citation": "Kox\n(2026)", "funder": "NWO", "url": "https://x.org",
}  # fmt: skip
STATED = {
    "author": ["A. Kox", "B. Lam"],
    "license": "CC0",
    "citation": "Kox\n(2026)",
    "funder": "NWO",
    "url": "https://x.org",
}


def test_the_codebook_describes_columns_doubts_and_credits(two_site_study: Study) -> None:
    changed: Any = SimpleNamespace(path=two_site_study.folder / "data" / "x.csv", what="differs")
    credited = replace(
        two_site_study,
        doubts=(changed,),
        protocol={**two_site_study.protocol, "study": {"credits": CREDITS}},
        settings={},
    )
    book = json.loads(codebook_bytes(credited, {"a.csv": COLUMNS}))
    assert {name: book["study"][name] for name in STATED} == STATED
    assert (book["study"]["name"], book["study"]["title"], book["study"]["version"]) == ("made_up", "Made up", "1")
    assert (book["blinded"], book["missing"], book["doubts"]) == (
        True,
        "n/a",
        [{"file": "data/x.csv", "what": "differs"}],
    )
    assert book["measures"]["agree_percent"] == "percentage of valid answers at levels 5 to 7"
    assert book["files"] == {
        "a.csv": [
            {"name": "a_text", "type": "text", "description": "Words.", "unit": "m", "may_miss": False},
            {"name": "a_flag", "type": "flag", "description": "Whether.", "may_miss": True},
            {
                "name": "a_whole", "type": "integer", "description": "Count.", "levels": {"1": "low", "7": "high"},
                "minimum": 1, "maximum": 7, "may_miss": False,
            },
            {
                "name": "a_number", "type": "number", "description": "Length.", "unit": "mm", "minimum": 0,
                "may_miss": True,
            },
            {"name": "a time", "type": "time", "description": "When.", "may_miss": False},
        ]
    }  # fmt: skip
    assert credit_lines(credited) == ("Authors: A. Kox, B. Lam.", "Licence: CC0.", "How to cite: Kox (2026).")
    assert credit_lines(two_site_study) == (
        "Authors: not stated.",
        "Licence: not stated; ask the authors before you use the data.",
        "How to cite: not stated; cite the study, its version and its authors.",
    )
    greek = replace(two_site_study, title="Ölε", sites=())
    text = codebook_bytes(greek, {}).decode()
    assert text.startswith('{\n  "study": {\n    "name": "made_up",\n    "title": "Ölε",\n')
    assert not [
        exported.name for exported in (*exported_tables(greek), wide_table(greek)[0]) if "site" in exported.frame
    ]
    of_levels: Any = replace(two_site_study, levels=(two_site_study.blocks[0],))
    sealed = sealed_interval_columns(of_levels)
    assert sealed == {*header(INTERVALS)} - {*header(unsealed_columns(INTERVALS))} != set()
    assert sealed_interval_columns(two_site_study) == set()
    design, varied = (
        SimpleNamespace(kind="pair", name="higher"),
        SimpleNamespace(vary="pitch_hz", level_kind="weber", direction="up", unit="Hz"),
    )
    levels: Any = [
        SimpleNamespace(id="pitch", title="Pitch", phase="main", design=design, stimulus=stimulus)
        for stimulus in (None, varied)
    ]
    book = json.loads(codebook_bytes(replace(credited, levels=levels), {}))
    entry = {"block": "pitch", "title": "Pitch", "phase": "main", "design": "pair", "item": "higher"}
    assert book["levels"] == [entry, {**entry, "vary": "pitch_hz", "level": "weber", "direction": "up"}]
    assert book["sealed_columns"] == sorted(SEALED | sealed)
    assert json.loads(codebook_bytes(two_site_study, {}))["sealed_columns"] == []
    table = ExportTable("trials", COLUMNS, pd.DataFrame())
    assert file_name(two_site_study, table, "sav") == "study-made_up_description-trials_data.sav"


def test_the_folder_to_share_has_each_file_in_its_place(two_site_study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    missing, study_files = ("waves.mp4",), {"kitchen.toml": b"k"}
    monkeypatch.setattr(psychds_dataset, "materials", lambda _study: psychds_dataset.Materials(study_files, missing))
    head = {"languages": ["nl", "en"], "description": {"nl": "Olie", "en": "Oil"}, "credits": CREDITS}
    shared = replace(two_site_study, protocol={"study": head, "analysis": {"alpha": 0.04}}, version="2.5")
    tables = {f"study-made_up_description-{name}_data.csv": name.encode() for name in ("trials", "wide")}
    columns = {name: COLUMNS[:2] if "trials" in name else COLUMNS[1:3] for name in tables}
    report = {**dict.fromkeys(tables, b"older"), "report.R": b"R", "report.html": b"page", "codebook.json": b"book"}
    files = psychds_dataset.dataset_files(shared, tables, columns, report)
    contents = {name.removeprefix("psych-ds/"): content for name, content in files.items()}
    dataset_description, metadata, wide, settings, protocol = (
        json.loads(contents.pop(name))
        for name in (
            "dataset_description.json", "data/file_metadata.json", "data/study-made_up_description-wide_data.json",
            "analysis/settings.json", "materials/protocol.json",
        )
    )  # fmt: skip
    assert contents.pop("CHANGES.md").startswith(b"# Changes\n\n- 2.5: exported by liquid-study ")
    assert b"missing from `materials`: waves.mp4." in contents.pop("README.md")
    assert json.loads(contents.pop("documentation/codebook.json"))["files"].keys() == tables.keys()
    del contents["data/study-made_up_description-trials_data.json"]
    assert contents == {
        ".psychds-ignore": b".psychds-ignore\n", "analysis/report.R": b"R", "results/report.html": b"page",
        "materials/kitchen.toml": b"k", **{f"data/{name}": content for name, content in tables.items()},
    }  # fmt: skip
    assert {name: dataset_description.pop(name) for name in ("name", "alternateName", "description", "version")} == {
        "name": "made_up", "alternateName": "Made up", "description": "Oil", "version": "2.5",
    }  # fmt: skip
    assert [variable["name"] for variable in dataset_description.pop("variableMeasured")] == [
        "a_text",
        "a_flag",
        "a_whole",
    ]
    assert metadata == {
        **dataset_description,
        **{name: metadata[name] for name in ("name", "alternateName", "description", "version")},
    }
    assert dataset_description["keywords"][-1] == "simulated"
    assert {name: dataset_description[name] for name in STATED} == {name: wide[name] for name in STATED} == STATED
    assert (wide["name"], [variable["name"] for variable in wide["variableMeasured"]]) == (
        "study-made_up_description-wide_data", ["a_flag", "a_whole"],
    )  # fmt: skip
    assert (settings["name"], settings["version"], settings["license"]) == ("made_up", "2.5", "CC0")
    assert settings["analysis"]["alpha"] == 0.04
    assert settings["analysis"].keys() >= {"equivalence_bound", "rising", "looks"}
    assert not settings["analysis"].keys() & {"made", "changed"}
    assert protocol == shared.protocol
    untold = replace(shared, protocol={"study": {"description": " Oil. "}})
    assert psychds_dataset._description(untold, columns)["description"] == "Oil."
    assert psychds_dataset._description(replace(untold, protocol={}), columns)["description"] == "Made up"


def test_footage_outside_of_the_folder_or_with_other_content_is_missing(
    two_site_study: Study, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file, digests = tmp_path / "kitchen.toml", {}
    for name in ("in.mp4", "other.mp4"):
        (tmp_path / name).write_bytes(name.encode())
        digests[name] = hashlib.sha256(b"in.mp4").hexdigest()
    digests |= {"../out.mp4": "1f", "/abs.mp4": "2e", "gone.mp4": "3d"}
    monkeypatch.setattr(psychds_dataset, "_footage", lambda _study: digests)
    study_file = file, StudySource(b"text", {"oil.toml": "oil", "../no.toml": "no"})
    monkeypatch.setattr(psychds_dataset, "find_study_file", lambda *_: study_file)
    own = psychds_dataset.materials(two_site_study)
    copy = psychds_dataset.FileCopy(tmp_path / "in.mp4", digests["in.mp4"])
    assert own.files == {"kitchen.toml": b"text", "oil.toml": b"oil", "in.mp4": copy}
    outside = "the file is outside the study's folder"
    assert tuple(map(as_on_linux, own.missing)) == (
        f"other.mp4 (SHA-256 {digests['in.mp4']}; the file with this name has a different SHA-256)",
        f"../out.mp4 (SHA-256 1f; {outside})", f"/abs.mp4 (SHA-256 2e; {outside})",
        "gone.mp4 (SHA-256 3d; the file cannot be read: No such file or directory)",
    )  # fmt: skip
    monkeypatch.setattr(psychds_dataset, "find_study_file", lambda *_: None)
    assert psychds_dataset.materials(two_site_study).missing[:2] == (
        "the study file",
        f"in.mp4 (SHA-256 {digests['in.mp4']})",
    )
    assert psychds_dataset.materials(replace(two_site_study, settings={})) == ({}, ())
    for name, text, is_of in (
        ("a", '[study]\nname = "oil"', True),
        ("b", '[study]\nname = "wax"', False),
        ("c", "[", False),
    ):
        (tmp_path / name).write_bytes(text.encode())
        assert _has_study_name("oil", tmp_path / name) == is_of
    assert not _has_study_name("oil", tmp_path / "nowhere")


def test_the_tables_of_levels_have_all_intervals_groups_and_results_once_the_key_is_open(
    two_site_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One block has two intervals per trial, the other three."""
    sealed = {*header(INTERVALS)} - {*header(unsealed_columns(INTERVALS))}
    intervals = pd.DataFrame(
        {name: [name] for name in (*header(INTERVALS), *header((*table_module.JUDGED, TRIALS_MISSING)))}
    )
    levels: Any = [
        SimpleNamespace(id=name, design=SimpleNamespace(intervals=count)) for name, count in (("p", 3), ("q", 2))
    ]
    rows = {"participant": ["A-P001", "B-P001"], "group": ["old", "new"], "level": [0.5, 0.25]}
    rows |= {"force_mean_n_2": [7.0, 8.0]}
    monkeypatch.setattr(
        table_module, "tracks", lambda _study: pd.DataFrame({**rows, "block": "b", "code": ["L1", "L2"]})
    )
    monkeypatch.setattr(table_module, "level_results", lambda _study, frame: list(frame["level"]))
    table = next(iter(table_module.RESULTS))
    columns = table_module.RESULTS[table].columns

    def statistic(name: str, *, is_exported: bool) -> Any:
        def rows_of(level: float) -> Any:
            person = "A-P001" if level == 0.5 else "B-P001"
            return SimpleNamespace(export_rows=lambda: [{"participant": person, columns[-1].name: None}])

        return type("Statistic", (), {"table": name, "is_exported_in": staticmethod(lambda _study: is_exported),
                                      "__new__": lambda _cls, level: rows_of(level)})  # fmt: skip

    kinds = [statistic(table, is_exported=True), statistic("none", is_exported=False)]
    monkeypatch.setattr(table_module, "statistics", lambda: kinds)
    unblinded = replace(two_site_study, levels=levels, intervals=intervals)
    tables_by_name = {exported.name: exported for exported in table_module._level_tables(unblinded)}
    assert list(tables_by_name) == ["intervals", "tracks", table]
    assert set(header(tables_by_name["intervals"].columns)) >= sealed
    tracks = tables_by_name["tracks"]
    assert list(tracks.frame["level_asked"]) == [0.5, 0.25]
    assert list(tracks.frame["condition"]) == ["c1", "c2"]
    numbered = [column for column in tracks.columns if column.name.startswith("force_mean_n_")]
    assert [column.name for column in numbered] == [f"force_mean_n_{number}" for number in (1, 2, 3)]
    assert [column.description[-15:] for column in numbered] == [f" In interval {number}." for number in (1, 2, 3)]
    assert tracks.frame["force_mean_n_1"].isna().all()
    assert list(tracks.frame["force_mean_n_2"]) == [7.0, 8.0]
    results = tables_by_name[table].frame
    assert [list(results[name]) for name in ("participant", "group", "study", "simulated", "pilot")] == [
        ["A-P001", "B-P001"], ["old", "new"], ["made_up"] * 2, [True] * 2, [False] * 2,
    ]  # fmt: skip
    closed = list(table_module._level_tables(replace(unblinded, settings={})))
    assert [exported.name for exported in closed] == ["intervals"]
    assert not set(header(closed[0].columns)) & sealed
    assert list(table_module._level_tables(two_site_study)) == []


def test_a_wide_column_is_named_with_its_block_only_if_another_block_has_the_name(two_site_study: Study) -> None:
    (block,) = two_site_study.blocks
    other = replace(block, id="c", items=block.items[:1])
    _, cells = wide_table(replace(two_site_study, blocks=(block, other)))
    shared, own = (item.id for item in block.items)
    assert list(cells) == [name for place in (1, 2, 3) for name in (f"b__{shared}__c{place}", f"{own}__c{place}")] + [
        f"c__{shared}__c{place}" for place in (1, 2, 3)
    ]
    people = two_site_study.participants.assign(simulated=two_site_study.participants["participant"] == "B-P001")
    assert list(wide_table(replace(two_site_study, participants=people))[0].frame["simulated"]) == [
        False,
        False,
        True,
        False,
    ]


@pytest.mark.parametrize(
    ("extras", "written"),
    [
        ((), {"csv": "trials wide"}),
        (("parquet",), {"csv": "trials", "parquet": "trials"}),
        (("parquet", "wide"), {"csv": "trials wide", "parquet": "trials wide"}),
        (("sav",), {"csv": "trials", "sav": "trials wide tracks"}),
    ],
)
def test_each_format_has_its_tables(
    extras: Any, written: dict[str, str], two_site_study: Study, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first table is that of the answers; tracks are added to the .sav files."""
    monkeypatch.setattr(table_files, "codebook_bytes", lambda _study, files: repr(sorted(files)).encode())
    monkeypatch.setattr(table_files, "_parquet_bytes", lambda table: f"parquet {table.name}")
    monkeypatch.setattr(table_files, "table_bytes", lambda table: f"csv {table.name}")
    monkeypatch.setattr(table_files.spss, "sav", lambda _study, table, _coded: f"sav {table.name}")
    monkeypatch.setattr(table_files.spss, "wide_sav", lambda _study, table, _cells: f"sav {table.name}")
    names = ["trials", "tracks", "wide"] if "sav" in extras else ["trials", "wide"]
    tables = [ExportTable(name, (), pd.DataFrame()) for name in names]
    files: dict[str, Any] = dict(table_files.table_files(two_site_study, tables, extras, {}))
    book = files.pop("codebook.json").decode()
    if "sav" in extras:
        written = {**written, "csv": "trials tracks"}
    expected = {
        file_name(two_site_study, ExportTable(name, (), pd.DataFrame()), ending): f"{ending} {name}"
        for ending, of_ending in written.items()
        for name in of_ending.split()
    }
    assert files == expected
    assert book == repr(sorted(name for name in expected if name.endswith(".csv")))


def test_parquet_describes_each_column_with_its_unit_and_small_whole_numbers(two_site_study: Study) -> None:
    frame = pd.DataFrame({"a_text": ["x"], "a_flag": [True], "a_whole": [7], "a_number": [0.5], "a time": ["z"]})
    schema = parquet.read_schema(io.BytesIO(table_files._parquet_bytes(ExportTable("t", COLUMNS, frame))))
    assert [str(schema.field(column.name).type) for column in COLUMNS] == ["string", "bool", "int8", "double", "string"]
    assert {name: text.decode() for name, text in schema.field("a_number").metadata.items() if name == b"unit"} == {
        b"unit": "mm"
    }
    assert [schema.field(column.name).metadata[b"description"].decode() for column in COLUMNS] == [
        "Words.", "Whether.", "Count.", "Length.", "When.",
    ]  # fmt: skip


def test_a_text_in_sav_is_cut_between_characters_and_ends_with_an_ellipsis() -> None:
    """A letter with an accent has two bytes, the ellipsis three."""
    assert spss._truncate("é" * 5, 10) == "é" * 5
    assert spss._truncate("é" * 6, 10) == "ééé…"
    assert spss._truncate("abcdefghijk", 10) == "abcdefg…"


def test_an_answer_has_the_delay_of_its_own_session_and_the_condition_behind_a_track(two_site_study: Study) -> None:
    """Each session numbers its trials from 1; the setting of a track names the condition that it presents."""
    place = {"participant": ["A-P001"] * 2, "session": [1, 2], "trial": [1, 1], "attempt": [1, 1]}
    trials = pd.DataFrame({**place, "delay_error_mean_ms": [1.5, -2.5]})
    answers = pd.DataFrame({**place, "block": "pitch", "code": ["T1", "T2"]})[::-1].reset_index(drop=True)
    behind = Setting(code="x", condition="late", liquid="oil", delay_ms=60.0)
    settings = {
        ("pitch", "T1"): Setting(code="T1", condition="8/1", of=behind),
        ("pitch", "T2"): replace(behind, code="T2"),
    }
    study_of_answers = replace(two_site_study, answered=answers, trials=trials, settings=settings)
    frame = table_module._add_conditions(study_of_answers, table_module._add_delay_error(study_of_answers))
    assert list(frame["delay_achieved_ms"]) == [57.5, 61.5]
    condition_cells = [list(frame[name]) for name in ("condition", "liquid", "delay_ms")]
    assert condition_cells == [["late"] * 2, ["oil"] * 2, [60.0] * 2]


def test_a_long_label_of_an_answer_is_cut_in_sav(two_site_study: Study, tmp_path: Path) -> None:
    """SPSS cuts the label of a value after 120 bytes, without a word."""
    table = ExportTable("t", COLUMNS[2:3], pd.DataFrame({"a_whole": pd.array([1], "Int64")}))
    (tmp_path / "x.sav").write_bytes(spss.sav(two_site_study, table, {"a_whole": {1: "w" * 200}}))
    _, about = pyreadstat.read_sav(tmp_path / "x.sav")
    assert about.variable_value_labels == {"a_whole": {1: f"{'w' * 117}…"}}
