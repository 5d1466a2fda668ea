"""A study whose participants have codes of their own until it is unblinded."""

import csv
from pathlib import Path

import pytest

from study_app.analysis.data.study_tables import load_study
from study_app.analysis.evaluate import evaluate
from study_app.protocol.source.files import source_bytes
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal_events import TrialStarted
from study_app.store.unblinding import unblind
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.studies import made_up

PEOPLE = 8
pytestmark = pytest.mark.slow


def rehearse_study(folder: Path, codes: str) -> Path:
    text = source_bytes("demo").decode()
    study = folder / f"{codes}.toml"
    study.write_text(text.replace("[study]", f'[study]\ncodes = "{codes}"', 1), encoding="utf-8", newline="\n")
    return rehearse_answers(study, participants=PEOPLE, seed=3, results=folder / codes, features=made_up("demo"))


def test_revealing_own_codes_of_one_participant_does_not_reveal_others(tmp_path: Path) -> None:
    folder, same = rehearse_study(tmp_path, "participant"), rehearse_study(tmp_path, "study")
    key = read_key(folder)
    meant: dict[str, set[str]] = {}
    for session in StudyFolder(folder).sessions():
        lines = journal.read(session.journal)
        for line, whole in zip(lines, open_events(lines, key), strict=True):
            if isinstance(line, TrialStarted) and isinstance(whole, TrialStarted) and line.block == "delays":
                meant.setdefault(line.code, set()).add(key.condition(whole.block, whole.code))
        reproduction = reproduce_session(session.path)
        assert reproduction.differences == []
    assert meant == {"D1": {"prompt", "late"}, "D2": {"prompt", "late"}}
    assert verify_study(folder).errors == ()

    blinded, usual = (evaluate(load_study(study_folder)) for study_folder in (folder, same))
    assert not any(value for block in blinded.blocks for value in block.findings.values())
    assert all(any(block.findings.values()) for block in usual.blocks)

    for study_folder in (folder, same):
        assert unblind(study_folder, by="AB", reason="a test").left == ()
        assert verify_study(study_folder).errors == ()
    assert coded_answers(folder) == coded_answers(same)


def coded_answers(folder: Path) -> list[tuple[str, ...]]:
    """Return participant, presented condition and answer of each row of the tables."""
    names = ("participant", "trial", "block", "code", "item", "response")
    paths = sorted(folder.rglob("*_description-responses_data.csv"))
    rows = (row for path in paths for row in csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
    return [tuple(row[name] for name in names) for row in rows]
