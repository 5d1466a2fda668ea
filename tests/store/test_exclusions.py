import codecs
import json
import shutil
from dataclasses import replace
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, rule, run_state_machine_as_test

from study_app.errors import StoreError
from study_app.store import unblinding
from study_app.store.exclusions import Exclusion, exclude, exclusions, include, keep, reversals
from study_app.store.files.folders import StudyFolder
from study_app.store.unblinding import RULES, late_exclusions, unblind
from study_app.store.verification.whole_study import verify_study
from tests.platforms import files_up_to, needs_links
from tests.store.conftest import Start

pytestmark = pytest.mark.slow


NOW = datetime(2026, 3, 2, 9, 30, tzinfo=timezone(timedelta(hours=1)))


@pytest.fixture
def folder(tmp_path: Path, start: Start, finished: Start) -> Path:
    """Return a study in which P007 has five trials and P008 has none."""
    finished()
    start("P008").finish("withdrawn")
    return tmp_path / "study"


def test_a_session_and_a_trial_are_left_out_with_their_reasons(folder: Path) -> None:
    assert exclusions(folder) == ()
    first = exclude(folder, "P008", 1, by="rule 3", reason="withdrew", now=NOW)
    second = exclude(folder, "P007", 1, trial=2, by=" AB ", reason=" =1+1, it rang ", now=NOW)
    assert first == Exclusion(
        participant="P008",
        session=1,
        trial=None,
        rule_or_person="rule 3",
        reason="withdrew",
        excluded_at="2026-03-02T09:30:00.000+01:00",
        key_open=False,
    )
    assert second == Exclusion(
        participant="P007",
        session=1,
        trial=2,
        rule_or_person="AB",
        reason="=1+1, it rang",
        excluded_at="2026-03-02T09:30:00.000+01:00",
        key_open=False,
    )
    assert exclusions(folder) == (first, second)
    for row, reason_text in ((first, r"(withdrew)"), (second, "(=1+1, it rang)")):
        with pytest.raises(StoreError) as error:
            exclude(folder, row.participant, 1, trial=row.trial, by="CD", reason="slept")
        assert str(error.value).endswith(f" has been excluded since 2026-03-02T09:30:00.000+01:00 {reason_text}")
    assert (folder / "exclusions.csv").read_text(encoding="utf-8") == (
        "participant,session,trial,rule_or_person,reason,excluded_at,key_open\n"
        "P008,1,n/a,rule 3,withdrew,2026-03-02T09:30:00.000+01:00,false\n"
        'P007,1,2,AB,"\'=1+1, it rang",2026-03-02T09:30:00.000+01:00,false\n'
    )


def test_a_decision_after_unblinding_is_late_although_the_clock_was_set_back(folder: Path) -> None:
    early = exclude(folder, "P008", 1, by="rule 3", reason="withdrew", now=NOW)
    unblind(folder, "CD", "to analyse")
    assert datetime.now().astimezone() > NOW
    late = exclude(folder, "P007", 1, by="AB", reason="slow", now=NOW)
    by_rule = tuple(replace(late, trial=3, rule_or_person=name) for name in RULES)
    assert late_exclusions(folder, (*by_rule, *exclusions(folder))) == (late,), "rules decide without a person"
    include(folder, "P008", 1, by="AB", reason="it counts", now=NOW)
    assert late_exclusions(folder, exclusions(folder)) == (late, early)
    assert verify_study(folder).is_sound


def test_times_decide_which_exclusions_of_an_earlier_version_are_late(folder: Path) -> None:
    path = folder / "exclusions.csv"
    later = (datetime.now().astimezone() + timedelta(hours=1)).isoformat(timespec="milliseconds")
    path.write_text(
        "participant,session,trial,rule_or_person,reason,excluded_at\n"
        f"P008,1,n/a,AB,slow,2026-03-02T09:30:00.000+01:00\nP007,1,2,AB,the phone rang,{later}\n",
        encoding="utf-8",
        newline="\n",
    )
    assert late_exclusions(folder, exclusions(folder)) == (), "the key is sealed"
    unblind(folder, "CD", "to analyse")
    assert [row.fields().get("key_open", "not a key") for row in exclusions(folder)] == ["not a key"] * 2
    assert [row.participant for row in late_exclusions(folder, exclusions(folder))] == ["P007"]
    assert verify_study(folder).is_sound
    exclude(folder, "P007", 1, trial=1, by="AB", reason="tired")
    assert [row.key_open for row in exclusions(folder)] == [None, None, True]


def test_the_first_reveal_in_whole_seconds_decides_which_earlier_exclusions_are_late(tmp_path: Path) -> None:
    (tmp_path / "blinding").mkdir()
    moments = "2026-03-02T09:30:05+01:00", "2026-03-02T09:30:01+01:00", "2026-03-02T09:30:09+01:00"
    records = [{"at": at, "by": "AB", "reason": "analysis", "key_hash": "a" * 64} for at in moments]
    StudyFolder(tmp_path).reveals.write_text(
        "".join(f"{json.dumps(record)}\n" for record in records), "utf-8", newline="\n"
    )
    times = ("09:30:01.999+01:00", "09:30:02.000+01:00", "08:30:01.500+00:00", "08:30:02.500+00:00", "noon")
    rows = [
        Exclusion(
            participant="P7", session=number, trial=None, rule_or_person="AB", reason="", excluded_at=f"2026-03-02T{at}"
        )
        for number, at in enumerate(times, start=1)
    ]
    assert [row.session for row in late_exclusions(tmp_path, rows)] == [2, 4]
    exclusions_judged = [replace(row, key_open=row.session > 3) for row in rows]
    assert [row.session for row in late_exclusions(tmp_path, exclusions_judged)] == [4, 5], "no times are compared"


def test_a_rule_does_not_exclude_a_session_that_a_person_included_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unblinding, "_missed_catch_trials", lambda *_: ["3 of 4 catch trials", "2 of 2 catch trials"])
    rule_exclusions = unblinding.exclude_inattentive(folder)
    assert [(row.participant, row.rule_or_person) for row in rule_exclusions] == [("P007", "catch"), ("P008", "catch")]
    assert {row.reason for row in rule_exclusions} == {"3 of 4 catch trials; 2 of 2 catch trials"}
    include(folder, "P007", 1, by="AB", reason="the task was understood late")
    assert unblinding.exclude_inattentive(folder) == ()
    with pytest.raises(StoreError, match="is excluded: include it without --rule"):
        keep(folder, "P008", 1, rule="fast_answers", by="AB", reason="it counts")
    for planned in ("fast_answers", "below_chance"):
        keep(folder, "P007", 1, rule=planned, by="AB", reason="it counts")
        with pytest.raises(StoreError, match=f"has already been kept, although the rule {planned} applies"):
            keep(folder, "P007", 1, rule=planned, by="AB", reason="it counts")
    assert [row.rule_or_person for row in reversals(folder)] == ["catch", "fast_answers", "below_chance"]


def test_a_full_disk_leaves_the_list_as_it_was(folder: Path) -> None:
    row = exclude(folder, "P008", 1, by="AB", reason="withdrew")
    before = (folder / "exclusions.csv").read_bytes()
    with files_up_to(2000), pytest.raises(StoreError, match=r"exclusions\.csv cannot be written \(File too large\)"):
        exclude(folder, "P007", 1, by="AB", reason="long " * 500)
    with files_up_to(0), pytest.raises(StoreError):
        include(folder, "P008", 1, by="CD", reason="wrong")
    assert (folder / "exclusions.csv").read_bytes() == before
    exclude(folder, "P007", 1, by="AB", reason="late, “very” late")
    assert exclusions(folder)[0] == row
    assert exclusions(folder)[1].reason == "late, “very” late"


def test_a_list_that_a_spreadsheet_saved_is_read(folder: Path) -> None:
    exclude(folder, "P007", 1, trial=2, by="AB", reason="tired")
    path = folder / "exclusions.csv"
    decided = exclusions(folder)
    path.write_bytes(codecs.BOM_UTF8 + path.read_bytes().replace(b"\n", b"\r\n"))
    assert exclusions(folder) == decided
    assert [error for error in verify_study(folder).errors if error.place == "exclusions.csv"] == []
    exclude(folder, "P007", 1, by="AB", reason="withdrew")
    assert exclusions(folder)[0] == decided[0]
    assert not path.read_bytes().startswith(codecs.BOM_UTF8)


def test_a_reversed_exclusion_stays_on_record(folder: Path) -> None:
    kept_exclusion = exclude(folder, "P008", 1, by="rule 3", reason="withdrew", now=NOW)
    trial = exclude(folder, "P007", 1, trial=2, by="AB", reason="the phone rang", now=NOW)
    assert include(folder, "P007", 1, trial=2, by=" CD ", reason="it did not 🌊", now=NOW) == trial
    assert exclusions(folder) == (kept_exclusion,)
    (line,) = (folder / "exclusions_reversed.jsonl").read_text(encoding="utf-8").splitlines()
    record = json.loads(line)
    assert (record["by"], record["reason"], record["at"]) == ("CD", "it did not 🌊", exclusions(folder)[0].excluded_at)
    assert record["exclusion"]["reason"] == "the phone rang"
    again = exclude(folder, "P007", 1, trial=2, by="AB", reason="it did", now=NOW)
    assert exclusions(folder) == (kept_exclusion, again)
    verification = verify_study(folder)
    assert verification.is_sound
    assert "exclusions_reversed" not in str(verification)


def test_a_reason_is_kept_as_it_can_be_read(folder: Path) -> None:
    for letter in "\0\x1b\x85\u202e":
        with pytest.raises(StoreError, match=rf"--reason contains the character U\+{ord(letter):04X}, which cannot be"):
            exclude(folder, "P007", 1, by="catch", reason=f"missed {letter} many")
    kept_exclusion = exclude(folder, "P007", 1, by="catch", reason="missed \u2028 many\n trials ")
    assert kept_exclusion.reason == "missed many trials"
    include(folder, "P007", 1, by="CD", reason="understood late \u2029 and well")
    assert [(row.participant, row.rule_or_person) for row in reversals(folder)] == [("P007", "catch")]
    assert unblind(folder, "CD", "to analyse").left == ()
    assert verify_study(folder).is_sound


def test_a_list_with_an_endless_cell_is_named(folder: Path) -> None:
    (folder / "exclusions.csv").write_bytes(b"x" * 200_000)
    with pytest.raises(StoreError, match=r"is not valid CSV \(field larger than field limit"):
        exclusions(folder)


@needs_links
@pytest.mark.parametrize("name", ["exclusions.csv", "exclusions_reversed.jsonl"])
def test_a_list_that_a_link_leads_out_of_the_folder_is_refused(tmp_path: Path, name: str) -> None:
    study, outside = tmp_path / "study", tmp_path / "outside"
    study.mkdir()
    outside.write_bytes(b"")
    (study / name).symlink_to(outside)
    with pytest.raises(StoreError, match=r"contains a link to .*, which is outside"):
        (exclusions if name.endswith("csv") else reversals)(study)


DECIDED = st.tuples(st.sampled_from(["P007", "P008"]), st.sampled_from([None, 1, 2, 3, 5, 6]))
REASONS = st.text("""aé —,;'"=+-@n/\n\u2028""", min_size=1, max_size=12)


def test_exclusions_are_a_set_that_decisions_change(folder: Path) -> None:
    """Exclude and include in any order with any reasons, and compare with a dict and a list."""
    count = iter(range(10**6))

    class Decisions(RuleBasedStateMachine):
        def __init__(self) -> None:
            super().__init__()
            self.excluded: dict[tuple[str, int | None], Exclusion] = {}
            self.reversed: list[Exclusion] = []
            self.place = folder.parent / f"copy-{next(count)}"
            shutil.copytree(folder, self.place)

        @rule(decided=DECIDED, reason=REASONS)
        def exclude(self, decided: tuple[str, int | None], reason: str) -> None:
            person, trial = decided
            recorded = trial is None or (person == "P007" and trial <= 5)
            if recorded and reason.strip() and not {decided, (person, None)} & self.excluded.keys():
                now = NOW + timedelta(seconds=next(count))
                exclusion = exclude(self.place, person, 1, trial=trial, by="AB", reason=reason, now=now)
                assert (exclusion.what, exclusion.reason) == ((person, 1, trial), " ".join(reason.split()))
                assert exclusion.excluded_at == now.isoformat(timespec="milliseconds")
                self.excluded[decided] = exclusion
            else:
                with pytest.raises(StoreError):
                    exclude(self.place, person, 1, trial=trial, by="AB", reason=reason)
            self.check()

        @rule(decided=DECIDED)
        def include(self, decided: tuple[str, int | None]) -> None:
            if decided in self.excluded:
                self.reversed.append(self.excluded.pop(decided))
                include(self.place, decided[0], 1, trial=decided[1], by="CD", reason="it counts")
            else:
                with pytest.raises(StoreError, match="is not excluded"):
                    include(self.place, decided[0], 1, trial=decided[1], by="CD", reason="it counts")
            self.check()

        def check(self) -> None:
            assert list(exclusions(self.place)) == [*self.excluded.values()]
            assert list(reversals(self.place)) == self.reversed

    few = settings(
        max_examples=8, stateful_step_count=20, deadline=None, derandomize=True, database=None,
        phases=[Phase.generate], suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    run_state_machine_as_test(Decisions, settings=few)


def test_a_missing_participant_session_or_trial_is_named_with_the_existing_ones(folder: Path, tmp_path: Path) -> None:
    for participant, session, trial, expected in (
        ("P007", 2, None, "does not contain session 2 of participant P007; sessions of that participant: 1"),
        ("P009", 1, None, "does not contain session 1 of participant P009; participants: P007, P008"),
        ("P007", 1, 6, "session 1 of participant P007 does not contain trial 6; its trials are 1, 2, 3, 4, 5"),
        ("P008", 1, 1, "session 1 of participant P008 does not contain trial 1; its trials are none"),
    ):
        with pytest.raises(StoreError) as error:
            exclude(folder, participant, session, trial=trial, by="AB", reason="slept")
        assert str(error.value).removeprefix(f"{folder} ") == expected
    with pytest.raises(StoreError, match=r"of participant P001; participants: none$"):
        exclude(tmp_path / "empty", "P001", 1, by="AB", reason="slept")
    exclude(folder, "P007", 1, by="AB", reason="slept", now=NOW)
    message = r"^participant P007, session 1, trial 2 has been excluded since .* \(slept\)$"
    with pytest.raises(StoreError, match=message):
        exclude(folder, "P007", 1, trial=2, by="CD", reason="it rang")


@pytest.mark.parametrize(
    "changes",
    [
        {"participant": 7}, {"rule_or_person": None}, {"reason": 1}, {"excluded_at": 2026}, {"session": "1"},
        {"key_open": "false"}, {"more": 1}, None,
    ],
)  # fmt: skip
def test_a_damaged_line_of_the_reversed_exclusions_is_named(folder: Path, changes: dict[str, object] | None) -> None:
    for reason in ("slept", "it rang"):
        exclude(folder, "P007", 1, by="AB", reason=reason, now=NOW)
        include(folder, "P007", 1, by="CD", reason=f"é: {reason}", now=NOW)
    assert [row.reason for row in reversals(folder)] == ["slept", "it rang"]
    path = StudyFolder(folder).reversed_exclusions
    assert "é: slept" in path.read_text(encoding="utf-8"), "people can read it"
    first, second = path.read_bytes().splitlines()
    record = json.loads(second)
    if changes is None:
        del record["exclusion"]
    else:
        record["exclusion"] |= changes
    path.write_bytes(first + b"\n\n" + json.dumps(record).encode() + b"\n")
    with pytest.raises(StoreError) as error:
        reversals(folder)
    assert str(error.value) == (f"{path}, line 3 is not a reversed exclusion: remove it, or restore it from a backup")
