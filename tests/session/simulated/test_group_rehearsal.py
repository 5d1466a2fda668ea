"""A rehearsal of a study with groups that was interrupted goes on in the participant's group."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from study_app.session.simulated.rehearsal import rehearse, resume_rehearsal
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.journal_lines import raw
from tests.protocol.groups.grouped import GROUPS, STUDY

pytestmark = [pytest.mark.slow, needs_servo]


def session_content(study: Path, session: SessionFolder) -> tuple[str, list[tuple[Any, ...]], list[Any]]:
    """Return the group, the trials and the answers of a session."""
    lines = raw(open_events(journal.read(session.journal), read_key(study)))
    trials = {line["trial"]: (line["block"], line["code"]) for line in lines if line["event"] == "trial_started"}
    answers = {line["trial"]: line["items"][0]["value"] for line in lines if line["event"] == "responses"}
    return lines[0]["group"], sorted(trials.items()), sorted(answers.items())


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("groups")
    (folder / "grouped.toml").write_text(
        (STUDY + GROUPS).replace("min_s = 1\nmax_s = 3", "min_s = 0.3\nmax_s = 0.6"), encoding="utf-8", newline="\n"
    )
    return rehearse(folder / "grouped.toml", participants=2, seed=3, results=folder / "study", recordings=False)


@pytest.mark.parametrize(
    "share", [0.15, *(pytest.param(share, marks=pytest.mark.nightly) for share in (0.4, 0.6)), 0.9]
)
def test_a_resumed_participant_stays_in_the_group_and_answers_alike(study: Path, tmp_path: Path, share: float) -> None:
    folder = tmp_path / "study"
    shutil.copytree(study, folder)
    groups = set()
    (folder / "fingerprints.txt").unlink()
    for session in StudyFolder(folder).sessions():
        whole = session_content(folder, session)
        groups.add(whole[0])
        content = session.journal.read_bytes()
        session.journal.write_bytes(content[: round(share * len(content))])
        for derived_file in (*session.path.glob("*.csv"), session.checksums):
            derived_file.unlink()
        text = session.receipt.read_text("utf-8").replace('"status": "completed"', '"status": "unfinished"')
        session.receipt.write_text(text, encoding="utf-8", newline="\n")
        resume_rehearsal(session.path, protocol=study.parent / "grouped.toml")
        assert session_content(folder, session) == whole
        assert reproduce_session(session.path).differences == []
    assert groups == {"first_thin", "first_thick"}
    assert verify_study(folder, None).errors == ()
