"""The sample that comes with the program: sound, small, simulated, and what the program makes today."""

import csv
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from study_app.store import receipt
from study_app.store.blinded.blinding import open_events, read_key
from study_app.store.files.folders import SessionFolder, StudyFolder
from study_app.store.journals import journal
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.analysis.conftest import SAMPLE
from tests.compiled import needs_servo
from tests.journal_lines import raw

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

MAKE_AGAIN = "make the sample again, by the command in results/README.md"


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def rows(session: SessionFolder, table: str) -> list[dict[str, str]]:
    """Return a table's rows without wall-clock times."""
    with session.table("rek2024", table).open(newline="", encoding="utf-8") as file:
        return [{name: cell for name, cell in row.items() if not name.endswith("_at")} for row in csv.DictReader(file)]


def measures_of_trials(session: SessionFolder, folder: Path) -> list[dict[str, float]]:
    """Return the measures of each trial: forces, motion, and activations of each limiter."""
    measured = ("limiter_", "force_", "path_", "mean_speed", "duration_")
    return [
        {name: it for name, it in line.items() if name.startswith(measured) and it is not None}
        for line in raw(open_events(journal.read(session.journal), read_key(folder)))
        if line["event"] == "trial_ended"
    ]


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    return Path(shutil.copytree(SAMPLE.path, tmp_path / "copy"))


def test_the_sample_is_sound_and_its_orders_are_reproduced() -> None:
    verification = verify_study(SAMPLE.path)
    assert (verification.errors, verification.warnings) == ((), ()), MAKE_AGAIN
    assert verification.sessions == 12
    assert [reproduce_session(session.path).differences for session in SAMPLE.sessions()] == [[]] * 12, MAKE_AGAIN


def test_the_sample_is_small_sealed_simulated_and_without_recordings() -> None:
    there = files(SAMPLE.path)
    assert sum(map(len, there.values())) < 2_500_000
    assert "blinding/key.sealed" in there
    assert not [name for name in there if name.endswith((".parquet", "reveals.jsonl", ".tmp"))]
    for session in SAMPLE.sessions():
        session_receipt = receipt.read(session.receipt)
        assert (session_receipt["simulated"], session_receipt["recordings"], session_receipt["status"]) == (
            True,
            False,
            "completed",
        )
        assert {row["simulated"] for row in rows(session, "responses")} == {"true"}


@needs_servo
def test_its_answers_and_forces_are_those_of_a_rehearsal_today(rehearsal_of: Callable[[str], Path]) -> None:
    folder = rehearsal_of("rek2024")
    for sample, again in zip(SAMPLE.sessions()[:2], StudyFolder(folder).sessions(), strict=True):
        assert rows(sample, "responses") == rows(again, "responses"), MAKE_AGAIN
        for stored, rehearsed in zip(
            measures_of_trials(sample, SAMPLE.path), measures_of_trials(again, folder), strict=True
        ):
            assert len(rehearsed) > 10
            assert stored == pytest.approx(rehearsed, rel=1e-3), MAKE_AGAIN
