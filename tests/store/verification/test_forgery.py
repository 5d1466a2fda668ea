"""Results changed by hand: what `verify` finds by itself, and what with fingerprints that were kept elsewhere."""

import base64
import hashlib
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StoreError
from study_app.protocol.model import Protocol
from study_app.protocol.simulated import TrialFeatures
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store import receipt
from study_app.store.files.folders import StudyFolder
from study_app.store.integrity.checksums import read_list
from study_app.store.journals import journal_events as events
from study_app.store.verification.whole_study import verify_study
from tests.protocol.forms.mixed import mixed_file
from tests.store.conftest import Start, Tables
from tests.store.forging import Lines, cover_up, forge
from tests.studies import made_up

pytestmark = pytest.mark.slow

P007 = "data/sub-P007/ses-01"


@pytest.fixture
def study(tmp_path: Path, finished: Start) -> Path:
    """Two ended rehearsed sessions; tmp_path/kept.txt is a copy of their fingerprints."""
    for person in ("P007", "P008"):
        finished(person, simulated=True)
    shutil.copy(tmp_path / "study" / "fingerprints.txt", tmp_path / "kept.txt")
    return tmp_path / "study"


def errors_text(study: Path, kept: Path | None = None) -> str:
    return "\n".join(map(str, verify_study(study, kept).errors))


def forget_a_participant(study: Path) -> None:
    shutil.rmtree(study / "data" / "sub-P007")


def test_a_session_that_was_aborted_before_its_last_page_came_again_is_sound(
    tmp_path: Path, start: Start, tables_of_study: Tables
) -> None:
    tables = tables_of_study()
    tables["sequence"] = [*tables["sequence"], "consent"]
    store = start(protocol=Protocol.model_validate(tables))
    store.append(events.PageShown(page="consent"))
    store.append(events.PageLeft(page="consent"))
    store.finish("aborted", "tired")
    verification = verify_study(tmp_path / "study")
    assert (verification.errors, verification.warnings) == ((), ())


@pytest.mark.parametrize(
    ("removed", "number"),
    [
        (lambda line: line["event"] == "responses", 2),
        (lambda line: line["event"] == "form_answered", 2),
        (lambda line: line["event"] == "form_answered" and line["form"] == "end", 1),
        (lambda line: line["event"] in ("form_answered", "choice", "item_shown"), 2),
    ],
)
def test_a_removed_confirmation_is_found_where_the_session_went_on(
    tmp_path: Path, removed: Callable[[dict[str, Any]], bool], number: int
) -> None:
    """The session may also have been completed right after it, or its last form may lack answers."""
    features = {
        ("stir", name): (
            TrialFeatures(
                force_mean_n=1.0, force_peak_n=4.0, speed_rms_mps=0.1, push_share=0.02, roughness_n=0.03, delay_s=0.0
            ),
        )
        for name in ("thin", "thick")
    }
    shorter = 'sequence = ["start", "stir", "load", "usability", "end"]', 'sequence = ["start", "stir", "end"]'
    file = mixed_file(tmp_path, shorter)
    study = rehearse_answers(file, participants=1, seed=1, results=tmp_path / "mixed", features=features)
    assert verify_study(study).errors == ()
    journal = study / "data" / "sub-P001" / "ses-01" / "journal.jsonl"

    def edit(lines: Lines) -> None:
        lines[:] = [line for line in lines if not removed(line)]

    forge(journal, edit)
    cover_up(study)
    assert errors_text(study).count("was never confirmed: a line was removed") == number


@pytest.mark.parametrize("key", ["value", "changes", "onset_s", "first_s", "last_s"])
def test_a_confirmed_answer_that_was_not_chosen_is_found(study: Path, key: str) -> None:
    def edit(lines: Lines) -> None:
        confirmed = next(line for line in lines if line["event"] == "responses")
        confirmed["items"][0][key] += 1

    forge(study / P007 / "journal.jsonl", edit)
    cover_up(study)
    assert "that differs from the one chosen earlier: it has been changed" in errors_text(study)


def test_a_session_that_left_its_last_page_was_not_aborted(tmp_path: Path) -> None:
    study = rehearse_answers("demo", participants=1, seed=1, results=tmp_path / "demo", features=made_up("demo"))
    session = study / "data" / "sub-P001" / "ses-01"
    forge(session / "journal.jsonl", lambda lines: lines[-1].update(status="aborted"))
    receipt.write(session / "receipt.json", receipt.read(session / "receipt.json") | {"status": "aborted"})
    cover_up(study)
    assert "its status is 'aborted', although the last page was completed: it has been changed" in errors_text(study)


def test_a_fingerprint_is_computed_as_documented(study: Path) -> None:
    """It can be computed without this program: SHA-256 of some lines of the list, in base32."""
    proofs = read_list(StudyFolder(study).fingerprints)
    assert proofs
    for proof, place in proofs:
        lines = (study / place / "checksums.sha256").read_text("utf-8").splitlines(keepends=True)
        proved = "".join(line for line in lines if "_data.csv" not in line and "rebuilt.txt" not in line)
        letters = base64.b32encode(hashlib.sha256(proved.encode()).digest()).decode().lower()
        assert proof.replace("-", "") == letters[:12]


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "is not a file: specify a copy"),
        (b"", "does not contain fingerprints"),
        (b"\xff\n", "line 1 is not a fingerprint: a line must look like"),
        (b"k3vq-7m2p-xw4d data/sub-P007/ses-01\nx\n", "line 2 is not a fingerprint"),
    ],
)
def test_a_file_that_is_not_a_copy_of_the_fingerprints_is_named(
    study: Path, tmp_path: Path, content: bytes | None, sentence: str
) -> None:
    path = tmp_path / "copy.txt"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(StoreError, match=sentence):
        verify_study(study, path)


def test_the_command_compares_with_the_copy(study: Path, tmp_path: Path) -> None:
    words = ["verify", str(study), "--fingerprints", str(tmp_path / "kept.txt")]
    result = CliRunner().invoke(commands, words)
    assert (result.exit_code, result.output.splitlines()[-1]) == (0, "2 sessions: sound")
    forget_a_participant(study)
    cover_up(study)
    result = CliRunner().invoke(commands, words)
    assert (result.exit_code, result.output.splitlines()[-1]) == (3, "1 session: not sound")
    assert f"error: {P007}: is missing, but" in result.output
