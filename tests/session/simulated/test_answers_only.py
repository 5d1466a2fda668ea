"""Answers without a servo: the files that a held session leaves, and the answers that the model gives."""

import csv
import shutil
from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.protocol.load import load, parse
from study_app.session.simulated import answers_only
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.session.simulated.rehearsal import condition_features, rehearse
from study_app.store import receipt
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.protocol.edited_studies import text_of
from tests.store.forging import cover_up
from tests.studies import made_up

pytestmark = pytest.mark.slow

FELT = made_up("rek2024")
WALL_CLOCK = ("answered_at", "trial_started_at", "session_started_at", "session_ended_at")


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return [{k: v for k, v in row.items() if k not in WALL_CLOCK} for row in csv.DictReader(file)]


def tables(folder: Path) -> dict[str, list[dict[str, str]]]:
    return {path.relative_to(folder).as_posix(): rows(path) for path in sorted((folder / "data").rglob("*.csv"))}


@pytest.fixture(scope="module")
def twelve(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("answers") / "rek2024"
    return rehearse_answers("rek2024", participants=12, seed=1, results=folder, features=FELT)


def test_by_default_it_keeps_apart_from_participants(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for number in (1, 2):
        folder = rehearse_answers("rek2024", participants=1, seed=1, features=FELT)
        assert folder == Path("results") / f"rek2024-rehearsal-{number}"


def test_the_folder_is_sound_and_every_row_says_simulated(twelve: Path) -> None:
    verification = verify_study(twelve)
    assert (verification.errors, verification.warnings, verification.sessions) == ((), (), 12)
    for name, rows in tables(twelve).items():
        assert rows, name
        assert {row["simulated"] for row in rows} == {"true"}, name


def test_a_receipt_that_was_changed_with_its_proofs_differs_from_the_journal(twelve: Path, tmp_path: Path) -> None:
    study = shutil.copytree(twelve, tmp_path / "study")
    path = study / "data/sub-P001/ses-01/receipt.json"
    receipt.write(path, receipt.read(path) | {"screens": {}})
    cover_up(study)
    assert ("differs from the journal in the settings used when the session began") in "\n".join(
        map(str, verify_study(study).errors)
    )


def test_the_same_call_gives_the_same_answers_and_another_seed_others(twelve: Path, tmp_path: Path) -> None:
    again, other = (
        rehearse_answers("rek2024", participants=12, seed=seed, results=tmp_path / str(seed), features=FELT)
        for seed in (1, 2)
    )
    assert tables(again) == tables(twelve)
    assert tables(other) != tables(twelve)


@pytest.mark.parametrize(("name", "block", "task_s"), [("compared", "pairs", 4.0), ("levels", "viscosity", 1.0)])
def test_a_precise_observer_chooses_the_stronger_interval_and_takes_the_tasks_time(
    tmp_path: Path, name: str, block: str, task_s: float
) -> None:
    text = text_of(name).replace("repetitions = 40", "repetitions = 4")
    (tmp_path / "study.toml").write_text(text, encoding="utf-8", newline="\n")
    feelings = {where: feeling for where, feeling in made_up(tmp_path / "study.toml").items() if where[0] == block}
    study = rehearse_answers(tmp_path / "study.toml", participants=1, seed=1, results=tmp_path / "s", features=feelings)
    (session,) = StudyFolder(study).sessions()
    lines = open_events(journal.read(session.journal), read_key(study))
    begin_lines, stronger, right = (
        {line.event: line for line in lines[:1]},
        {"SC": "second", "CS": "first"},
        list[bool](),
    )
    for line in lines:
        if line.event == "responses" and (begin_lines["trial_started"].level or 1.0) > 0.3:
            right.append(line.items[0].value == stronger[begin_lines["trial_started"].arrangement])
        if line.event == "interval_ended":
            assert line.t_s - begin_lines["interval_started"].t_s == pytest.approx(task_s)
        if line.event == "interval_started" and line.interval == 2:
            assert line.t_s - begin_lines["interval_ended"].t_s == pytest.approx(0.05 + 0.6 + 0.001)
        begin_lines[line.event] = line
    assert sum(right) >= 0.9 * len(right) > 3
    assert begin_lines["session_ended"].t_s == begin_lines["responses"].t_s


def test_fewer_participants_answer_as_the_first_of_many(twelve: Path, tmp_path: Path) -> None:
    few = tables(rehearse_answers("rek2024", participants=3, seed=1, results=tmp_path / "few", features=FELT))
    many = tables(twelve)
    assert all(many[name] == rows for name, rows in few.items() if "sub-" in name)


@needs_servo
def test_answers_alone_equal_those_of_a_rehearsal_with_the_same_features(tmp_path: Path) -> None:
    rehearsed = rehearse("demo", participants=1, seed=3, results=tmp_path / "held", recordings=False)
    features = condition_features(load("demo"), seed=3, people=1)
    assert all(len(once) == 1 for once in features.values()), "otherwise which of them is felt is drawn"
    answered = rehearse_answers("demo", participants=1, seed=3, results=tmp_path / "answered", features=features)
    columns = ("trial", "code", "item", "number", "response", "changes")
    lived, answered_only = (
        [
            [row[name] for name in columns]
            for name_, held_ in tables(folder).items()
            if "responses" in name_
            for row in held_
        ]
        for folder in (rehearsed, answered)
    )
    assert lived == answered_only


@needs_servo
def test_features_are_computed_for_every_condition(tmp_path: Path) -> None:
    study = load("demo")
    features = condition_features(study, seed=1, people=2)
    assert features.keys() == {
        (block.id, condition) for block in study.blocks.values() for condition in block.conditions
    }
    for (block, condition), lived in features.items():
        assert len(lived) == 2 * study.blocks[block].repetitions
        for feeling in lived:
            assert feeling.force_mean_n > 0
            assert feeling.delay_s == pytest.approx(study.delay_s(condition), abs=0.015)
    assert not any(tmp_path.iterdir())


@needs_servo
def test_each_liquid_of_a_pair_is_felt_in_its_own_interval() -> None:
    text = text_of("compared").replace("repetitions = 40", "repetitions = 2").replace("nspm = 9", "nspm = 16")
    features = condition_features(parse(text.encode(), "compared.toml"), seed=1, people=1)
    thin, thick = ([feeling.force_mean_n for feeling in features["pairs", liquid]] for liquid in ("thin", "thick"))
    assert max(thin) < min(thick)


def test_ended_by_the_user_it_leaves_whole_sessions_and_their_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def enough(line: str) -> None:
        if line.startswith("P003"):
            raise KeyboardInterrupt

    monkeypatch.setattr(answers_only, "REPORT_INTERVAL_S", 0.0)
    folder = tmp_path / "rek2024"
    with pytest.raises(KeyboardInterrupt):
        rehearse_answers("rek2024", participants=9, seed=1, results=folder, features=FELT, progress=enough)
    verification = verify_study(folder)
    assert (verification.errors, verification.sessions) == ((), 3)
    assert load_study(folder).n == 3
