import json
from pathlib import Path

import pytest

from study_app.analysis.tables.study_tables import Study, load_study
from study_app.errors import StoreError
from study_app.protocol.load import parse, source_bytes
from tests.analysis.conftest import CANNOT_JUDGE, Results, make_results
from tests.analysis.tables.differing_answers import by_condition, refusal

pytestmark = pytest.mark.slow


def cell(study: Study, code: str, item: str) -> dict:
    for block in study.blocks:
        if code in block.codes:
            table = study.aggregate(block)
            return table[(table["code"] == code) & (table["item"] == item)].iloc[0].to_dict()
    raise LookupError(code)


def test_answers_come_back_by_code_with_all_statements_and_settings(rek: Results) -> None:
    rek.add("P001", by_condition)
    rek.add("P002", by_condition)
    study = load_study(rek.folder)
    assert (study.name, study.n, study.simulated, study.revealed) == ("rek2024", 2, True, False)
    assert [(block.id, block.kind) for block in study.blocks] == [("liquids", "liquids"), ("delays", "delays")]
    assert [block.codes for block in study.blocks] == [("L1", "L2", "L3"), tuple(f"D{n}" for n in range(1, 8))]
    assert [item.short for item in study.blocks[0].items][:2] == ["Feels like a liquid", "Immersive"]
    assert len(study.responses) == 2 * 62
    for condition, level in (("water", 2), ("honey", 5), ("light_oil", 7)):
        row = cell(study, rek.code(condition, "liquids"), "like_tar")
        assert (row["n"], row["median"], row[f"count_{level}"]) == (2, level, 2)


def test_while_sealed_a_setting_is_its_code_and_nothing_else(rek: Results) -> None:
    rek.add("P001", by_condition)
    study = load_study(rek.folder)
    assert not study.settings
    assert all(
        (setting.condition, setting.liquid, setting.delay_ms) == (None, None, None)
        for block in study.blocks
        for setting in block.settings
    )


def test_opened_settings_have_names_delays_ascending_and_liquids_as_in_the_protocol(rek: Results) -> None:
    rek.add("P001", by_condition)
    rek.open()
    liquids, delays = load_study(rek.folder).blocks
    assert [liquids.name(setting) for setting in liquids.settings] == ["Water", "Honey", "Light oil"]
    assert [setting.delay_ms for setting in delays.settings] == [0, 50, 75, 100, 125, 150, 200]
    assert {setting.liquid for setting in delays.settings} == {"water"}
    assert [setting.code for setting in liquids.settings] == [
        rek.code(condition, "liquids") for condition in ("water", "honey", "light_oil")
    ]


SWAPPED = {'"L"': '"X"', '"D"': '"L"', '"X"': '"D"'}


def test_what_a_block_compares_is_told_by_its_receipt_and_not_by_the_letter_of_its_codes(tmp_path: Path) -> None:
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
    assert [block.kind for block in load_study(results.folder).blocks] == ["liquids", "delays"]


def test_receipts_of_earlier_versions_do_not_say_what_a_block_compares(rek: Results) -> None:
    path = rek.add("P001", by_condition).receipt
    told = json.loads(path.read_bytes())
    for block in told["protocol"]["blocks"].values():
        del block["compares"]
    path.write_text(json.dumps(told))
    assert [block.kind for block in load_study(rek.folder).blocks] == ["liquids", "delays"]
    rek.open()
    assert [block.kind for block in load_study(rek.folder).blocks] == ["liquids", "delays"]


def test_of_a_repeated_trial_the_last_attempt_counts_and_the_first_is_kept(rek: Results) -> None:
    rek.add("P001", lambda *_: 6, repeated={"L2": lambda *_: 1})
    study = load_study(rek.folder)
    row = cell(study, "L2", "immersive")
    assert (row["n"], row["count_1"], row["count_6"], row["presented"]) == (1, 0, 1, 1)
    kept = study.responses[(study.responses["code"] == "L2") & (study.responses["item"] == "immersive")]
    assert list(zip(kept["attempt"], kept["response"], kept["counted"], strict=True)) == [(1, 1, False), (2, 6, True)]


def test_a_repeat_that_was_never_answered_leaves_the_answer_missing(rek: Results) -> None:
    """The operator discarded the first attempt; its answers must not come back because the second has none."""
    rek.add("P001", lambda *_: 6, repeated={"L2": lambda *_: 1})
    path = rek.responses("P001")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if not (",2,liquids," in line and ",L2," in line)))
    row = cell(load_study(rek.folder), "L2", "immersive")
    assert (row["n"], row["missing"]) == (0, 1)


def test_practice_stays_apart_even_where_it_is_asked_about(small: Results) -> None:
    small.add("A", lambda *_: 3)
    study = load_study(small.folder)
    assert [block.id for block in study.blocks] == ["feel"]
    practice = study.responses[study.responses["phase"] == "practice"]
    assert len(practice) == 2
    assert not practice["counted"].any()
    assert cell(study, "L1", "smooth")["n"] == 2


def test_repetitions_cannot_judge_and_unanswered_items_are_counted(small: Results) -> None:
    small.add("A", lambda condition, item: {"smooth": 7, "warm": None}[item])
    small.add("B", lambda condition, item: {"smooth": CANNOT_JUDGE, "warm": 1}[item])
    study = load_study(small.folder)
    smooth, warm = cell(study, "L1", "smooth"), cell(study, "L1", "warm")
    assert (smooth["presented"], smooth["n"], smooth["participants"], smooth["cannot_judge"], smooth["missing"]) == (
        4,
        2,
        1,
        2,
        0,
    )
    assert (warm["n"], warm["cannot_judge"], warm["missing"], warm["count_1"]) == (2, 0, 2, 2)


def test_an_item_left_out_of_the_file_is_missing(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    path = rek.responses("P001")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if ",immersive," not in line))
    row = cell(load_study(rek.folder), "L1", "immersive")
    assert (row["n"], row["missing"]) == (0, 1)


@pytest.mark.parametrize("status", ["unfinished", "withdrawn", "aborted", "broken"])
def test_sessions_that_were_not_completed_are_kept_and_do_not_count(rek: Results, status: str) -> None:
    rek.add("P001", lambda *_: 6)
    rek.add("P002", lambda *_: 1, status=status, trials=4)
    study = load_study(rek.folder)
    assert (study.n, study.people, study.left_out) == (1, ("P001",), 1)
    assert len(study.responses) == 62 + 27 - 0
    assert cell(study, "L1", "immersive")["n"] == 1


def test_two_sessions_of_one_participant_are_one_participant(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    rek.add("P001", lambda *_: 2, session=2)
    study = load_study(rek.folder)
    row = cell(study, "L1", "immersive")
    assert (study.n, row["n"], row["participants"], row["presented"]) == (1, 2, 1, 2)


def test_of_two_sessions_only_the_excluded_one_is_left_out(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    rek.add("P001", lambda *_: 2, session=2)
    rek.exclude("P001", session=2)
    study = load_study(rek.folder)
    assert (study.people, len(study.excluded_sessions)) == (("P001",), 1)
    row = cell(study, "L1", "immersive")
    assert (row["n"], row["median"], row["presented"]) == (1, 6, 1)


def test_an_excluded_trial_takes_all_its_attempts_and_is_one_presentation(rek: Results) -> None:
    rek.add("P001", lambda *_: 6, repeated={"L2": lambda *_: 1})
    (trial,) = {int(one) for one in load_study(rek.folder).trials.query("code == 'L2'")["trial"]}
    rek.exclude("P001", trial=trial)
    study = load_study(rek.folder)
    row = cell(study, "L2", "immersive")
    assert (row["n"], row["presented"], row["presented_excluded"], row["missing"]) == (0, 0, 1, 0)
    assert list(study.trials.query("code == 'L2'")["excluded"]) == [True, True]


def test_of_repetitions_only_the_excluded_one_is_left_out(small: Results) -> None:
    small.add("A", lambda *_: 3)
    small.exclude("A", trial=small.trial("A", "heavyzembla"))
    row = cell(load_study(small.folder), small.code("heavyzembla", "feel"), "smooth")
    assert (row["n"], row["presented"], row["presented_excluded"]) == (1, 1, 1)


def test_an_unfinished_session_that_is_excluded_is_told_once(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    rek.add("P002", lambda *_: 1, status="withdrawn", trials=4)
    rek.exclude("P002")
    study = load_study(rek.folder)
    assert (study.left_out, len(study.excluded_sessions)) == (0, 1)


def test_reasons_of_session_and_trial_stand_beside_each_other_and_none_excludes_too(rek: Results) -> None:
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
def test_excluding_what_is_not_there_is_refused(rek: Results, excluded: dict, says: str) -> None:
    rek.add("P001", lambda *_: 6)
    rek.exclude(**excluded)
    message = refusal(rek.folder)
    assert says in message
    assert "exclusions.csv" in message


def test_a_list_of_exclusions_that_makes_no_sense_is_refused(rek: Results) -> None:
    rek.add("P001", lambda *_: 6)
    (rek.folder / "exclusions.csv").write_text("who,why\n")
    with pytest.raises(StoreError, match=r"exclusions\.csv"):
        load_study(rek.folder)


def test_texts_are_english_where_the_study_has_it(small: Results) -> None:
    small.add("A", lambda *_: 3)
    block = load_study(small.folder).blocks[0]
    assert block.items[0].short == "Smooth"
    assert block.cannot_judge == "Cannot judge"
    assert block.labels[0] == "a"
