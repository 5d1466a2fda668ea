"""Results that are refused: missing, changed, torn, foreign, under another key."""

import csv
import json
import re
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from study_app.analysis.data.study_tables import Study, group_counts, load_study
from study_app.errors import StoreError
from study_app.protocol.blocks import block_titles
from study_app.protocol.load import parse
from study_app.protocol.source.files import source_bytes
from study_app.store.files.columns import RESPONSES
from study_app.store.files.csv_files import table_problems
from tests.analysis import made_up
from tests.analysis.conftest import Results, make_results
from tests.analysis.tables.differing_answers import by_condition, refusal

pytestmark = pytest.mark.slow


def cell(study: Study, code: str, item: str) -> dict:
    for block in study.blocks:
        if code in block.codes:
            table = study.aggregate(block)
            return table[(table["code"] == code) & (table["item"] == item)].iloc[0].to_dict()
    raise LookupError(code)


SWAPPED = {'"L"': '"X"', '"D"': '"L"', '"X"': '"D"'}


def test_the_kind_of_a_block_comes_from_the_receipt_and_not_from_the_code_prefix(tmp_path: Path) -> None:
    text = source_bytes("rek2024").decode()
    for old, new in SWAPPED.items():
        text = text.replace(f"code_prefix = {old}", f"code_prefix = {new}")
    results = make_results(tmp_path / "swapped", parse(text.encode(), "swapped.toml"))
    results.add("P001", by_condition)
    assert [(block.codes[0], block.kind) for block in load_study(results.folder).blocks] == [
        ("D1", "liquids"),
        ("L1", "delays"),
    ]
    results.open()
    study = load_study(results.folder)
    assert [block.kind for block in study.blocks] == ["liquids", "delays"]
    assert [study.blocks_of(block.kind) for block in study.blocks] == [(block,) for block in study.blocks]


def test_the_kind_of_a_block_is_derived_for_receipts_of_earlier_versions(rek: Results) -> None:
    path = rek.add("P001", by_condition).receipt
    receipt_table = json.loads(path.read_bytes())
    for block in receipt_table["protocol"]["blocks"].values():
        del block["compares"]
    path.write_text(json.dumps(receipt_table), encoding="utf-8", newline="\n")
    assert [block.kind for block in load_study(rek.folder).blocks] == ["liquids", "delays"]
    rek.open()
    assert [block.kind for block in load_study(rek.folder).blocks] == ["liquids", "delays"]


def test_a_repeat_that_was_never_answered_leaves_the_answer_missing(rek: Results) -> None:
    """The answers of a discarded first attempt do not count if the second attempt has none."""
    rek.add("P001", lambda *_: 6, repeated={"L2": lambda *_: 1})
    path = rek.responses("P001")
    lines = path.read_text("utf-8").splitlines(keepends=True)
    path.write_text(
        "".join(line for line in lines if not (",2,liquids," in line and ",L2," in line)),
        encoding="utf-8",
        newline="\n",
    )
    row = cell(load_study(rek.folder), "L2", "immersive")
    assert (row["n"], row["missing"]) == (0, 1)


@pytest.mark.parametrize("status", ["unfinished", "withdrawn", "aborted", "broken"])
def test_sessions_that_were_not_completed_are_kept_and_do_not_count(rek: Results, status: str) -> None:
    rek.add("P001", lambda *_: 6)
    rek.add("P002", lambda *_: 1, status=status, trials=4)
    study = load_study(rek.folder)
    assert (study.n, study.people, study.left_out) == (1, ("P001",), 1)
    assert len(study.responses) == 62 + 27 - 0
    assert cell(study, "L1", "immersive")["n"] == 1


@pytest.mark.parametrize("name", ["simulated", "pilot"])
def test_one_simulated_or_pilot_session_makes_the_study_one(name: str) -> None:
    settings = made_up.liquids(2)
    case_study = made_up.study(settings, list(made_up.everybody(settings, 2, lambda *_: 4)))
    participants = case_study.participants.assign(**{name: [False, True]})
    assert getattr(replace(case_study, participants=participants), name)
    assert not getattr(replace(case_study, participants=participants[:1]), name)


def test_an_excluded_trial_takes_all_its_attempts_and_is_one_presentation(rek: Results) -> None:
    rek.add("P001", lambda *_: 6, repeated={"L2": lambda *_: 1})
    (trial,) = {int(number) for number in load_study(rek.folder).trials.query("code == 'L2'")["trial"]}
    rek.exclude("P001", trial=trial)
    study = load_study(rek.folder)
    row = cell(study, "L2", "immersive")
    assert (row["n"], row["presented"], row["presented_excluded"], row["missing"]) == (0, 0, 1, 0)
    assert list(study.trials.query("code == 'L2'")["excluded"]) == [True, True]


def test_an_excluded_unfinished_session_is_listed_once(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    rek.add("P002", lambda *_: 1, status="withdrawn", trials=4)
    rek.exclude("P002")
    study = load_study(rek.folder)
    assert (study.left_out, len(study.excluded_sessions)) == (0, 1)


def test_reasons_of_session_and_trial_are_joined_and_an_empty_reason_excludes(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    rek.exclude("P001", trial=3, reason="spilled tea")
    rek.exclude("P001", reason="tired")
    reasons = dict(load_study(rek.folder).trials[["trial", "exclusion_reason"]].itertuples(index=False))
    assert (reasons[2], reasons[3]) == ("tired", "tired; spilled tea")
    rek.add("P002", lambda *_: 6)
    rek.exclude("P002", reason="")
    assert load_study(rek.folder).n == 0


@pytest.mark.parametrize(
    ("excluded", "says"),
    [
        ({"participant": "P010"}, "participant P010, session 1, which does not exist"),
        ({"participant": "P001", "session": 2}, "participant P001, session 2, which does not exist"),
        ({"participant": "P001", "trial": 99}, "participant P001, session 1, trial 99, which does not exist"),
    ],
)
def test_an_exclusion_without_its_session_or_trial_is_refused(rek: Results, excluded: dict, says: str) -> None:
    rek.add("P001", lambda *_: 6)
    rek.exclude(**excluded)
    message = refusal(rek.folder)
    assert says in message
    assert "exclusions.csv" in message


def test_a_list_of_exclusions_that_makes_no_sense_is_refused(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    (rek.folder / "exclusions.csv").write_text("who,why\n", encoding="utf-8", newline="\n")
    with pytest.raises(StoreError, match=r"exclusions\.csv"):
        load_study(rek.folder)


def test_an_empty_or_foreign_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "holiday.txt").write_text("x", encoding="utf-8", newline="\n")
    assert "does not contain any sessions" in refusal(tmp_path)


def test_the_folder_above_the_studies_names_them(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    message = refusal(rek.folder.parent)
    assert f"specify one, such as {rek.folder}" in message


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (",immersive,statement,2,4,4,", ",immersive,statement,2,4,good,", "column value: 'good'"),
        (",immersive,statement,2,4,4,", ",immersive,statement,2,4, 4,", "column value: ' 4'"),
        (",immersive,statement,2,4,4,", ",immersive,statement,2,4,4_0,", "column value: '4_0'"),
        (
            ",immersive,statement,2,4,4,",
            f",immersive,statement,{'9' * 20},4,4,",
            f"column number: '{'9' * 20}' is not a whole number",
        ),
        (",12.25,", ",-5,", "column first_choice_s: '-5' is not a number of at least 0 or n/a"),
        (",12.25,", ",nan,", "column first_choice_s: 'nan' is not"),
        (",12.25,", ",1e999,", "column first_choice_s: '1e999' is not"),
        ("2026-01-05T", "٢٠٢٦-01-05T", "column answered_at: '٢٠٢٦-01-05T10:00:00.000+01:00' is not a time with a"),
        ("2026-01-05T10:00:00.000+01:00", "yesterday", "column answered_at: 'yesterday' is not a time with a"),
        (",false,false,n/a,", ",maybe,false,n/a,", "column simulated: 'maybe' is not true or false"),
        (",false,false,n/a,", ",False,false,n/a,", "column simulated: 'False' is not true or false"),
        (",main,", ",mian,", "column phase: 'mian' is not one of main, practice, baseline"),
        (",immersive,statement,2,4,4,", ",immersive,", "cells, not"),
        (",immersive,statement,2,4,4,", ",immersive,statement,2,4,4,,", "cells, not"),
        (",immersive,statement,2,4,4,", "\n,immersive,statement,2,4,4,", "cells, not"),
        (",immersive,statement,2,4,4,", ',"immersive"x,statement,2,4,4,', "is not a valid UTF-8 CSV file"),
        (",immersive,statement,2,4,4,", ",imersive,statement,2,4,4,", "does not contain the statement 'imersive'"),
        (",L1,immersive,", ",L9,immersive,", "for code 'L9'"),
        (",L1,immersive,", ",L1,feels_liquid,", "occurs twice"),
        ("study,participant", "study,person", "does not begin with the columns"),
        ("rek2024,P001,1,", "rek2024,P007,1,", "column participant: 'P007' instead of 'P001'"),
        ("rek2024,P001,1,", "other,P001,1,", "column study: 'other' instead of 'rek2024'"),
    ],
)
def test_a_changed_table_is_refused_with_file_row_and_value(real: Results, old: str, new: str, says: str) -> None:
    real.add("P001", lambda *_: 4)
    path = real.responses("P001")
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8", newline="\n")
    message = refusal(real.folder)
    assert says in message
    assert str(path) in message
    match = re.search(r"(row \d+), column (\w+: '.*?' is .*?);", message)
    if match:  # `verify` refuses the same cell in the same row
        assert list(table_problems(path.read_bytes(), RESPONSES)) == [", ".join(match.groups())]


def test_quotes_do_not_change_the_values(real: Results) -> None:
    real.add("P001", by_condition)
    path, before = real.responses("P001"), load_study(real.folder).responses
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n", quoting=csv.QUOTE_ALL).writerows(rows)
    pd.testing.assert_frame_equal(load_study(real.folder).responses, before)


def test_a_missing_table_is_refused(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    rek.trials("P001").unlink()
    assert "cannot be read (No such file" in refusal(rek.folder)


@pytest.mark.parametrize("content", [b"", b"[1]", b"{}", b'{"protocol": {"study": 3}}'])
def test_a_broken_receipt_is_refused(rek: Results, content: bytes) -> None:
    session = rek.add("P001", lambda *_: 4)
    session.receipt.write_bytes(content)
    assert str(session.receipt) in refusal(rek.folder)


def test_sessions_under_another_key_are_not_pooled(rek: Results, tmp_path: Path) -> None:
    rek.add("P001", lambda *_: 4)
    session = rek.add("P002", lambda *_: 4)
    session.receipt.write_text(
        session.receipt.read_text("utf-8").replace(rek.key.hash, "0" * 64), encoding="utf-8", newline="\n"
    )
    assert "different sealed keys" in refusal(rek.folder)


def test_sessions_that_were_asked_other_statements_are_not_pooled(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    session = rek.add("P002", lambda *_: 4)
    session.receipt.write_text(
        session.receipt.read_text("utf-8").replace('"like_tar"', '"like_glue"'), encoding="utf-8", newline="\n"
    )
    path = rek.responses("P002")
    path.write_text(path.read_text("utf-8").replace("like_tar", "like_glue"), encoding="utf-8", newline="\n")
    assert "different statements" in refusal(rek.folder)


def test_an_opened_key_that_was_changed_is_refused(rek: Results) -> None:
    rek.add("P001", lambda *_: 4)
    rek.open()
    make_results(rek.folder.parent / "other", rek.protocol)
    (rek.folder / "blinding" / "key.sealed").write_bytes(b"e30=")
    with pytest.raises(StoreError, match=r"key\.sealed"):
        load_study(rek.folder)


def test_groups_are_counted_by_participant_in_the_order_of_their_names() -> None:
    settings = made_up.liquids(2)
    case_study = made_up.study(settings, list(made_up.everybody(settings, 6, lambda *_: 4, sessions=2)))
    groups = pd.array([name for name in ("mid", "zeta", "alpha", "zeta", "mid", "zeta") for _ in range(2)], "string")
    study = replace(case_study, participants=case_study.participants.assign(group=groups))
    assert list(group_counts(study).items()) == [("alpha", 1), ("mid", 2), ("zeta", 3)]


def test_the_id_follows_a_title_that_blocks_of_one_phase_share() -> None:
    titled = {"warm": ("practice", "Stir"), "thin": ("main", "Stir"), "late": ("main", "See"), "again": ("main", "See")}
    blocks = {name: {"phase": phase, "title": {"en": title}} for name, (phase, title) in titled.items()}
    titles = block_titles({"study": {"languages": ["en"]}, "blocks": blocks})
    assert titles == {"warm": "Stir", "thin": "Stir", "late": "See (late)", "again": "See (again)"}
