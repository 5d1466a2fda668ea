"""Damaged files of a study: single bits and values of another type, with fixed seeds; recordings, too."""

import contextlib
import os
import random
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StudyError
from study_app.gui.sessions.session_facts import sessions
from study_app.protocol.model import Protocol
from study_app.store import recordings
from study_app.store.blinded import blinding
from study_app.store.exclusions import exclude
from study_app.store.journals import journal_events
from study_app.store.journals.journal import scan
from study_app.store.sessions.recovery import check_resumable, rebuild_session
from study_app.store.unblinding import unblind
from study_app.store.verification.reproduction import reproduce_session
from study_app.store.verification.whole_study import verify_study
from tests.damage import with_a_bit_flipped, with_an_odd_value, with_deep_nesting
from tests.journal_lines import event_of
from tests.store.conftest import SOURCE, Attend, Make, Start
from tests.store.forging import secret_of

pytestmark = pytest.mark.slow

FINISHED = "data/sub-P007/ses-01"
UNFINISHED = "data/sub-P008/ses-01"
SEED = int(os.environ.get("LIQUID_STUDY_DAMAGE_SEED", "5"))
CASES = int(os.environ.get("LIQUID_STUDY_DAMAGE_CASES", "5"))  # of a file, for each kind of damage
FILES = (
    f"{FINISHED}/journal.jsonl",
    f"{UNFINISHED}/journal.jsonl",
    f"{FINISHED}/receipt.json",
    f"{FINISHED}/checksums.sha256",
    "dataset_description.json",
    "blinding/key.sealed",
    "blinding/reveals.jsonl",
    "exclusions.csv",
    f"{FINISHED}/*responses_data.csv",
    f"{UNFINISHED}/*responses_data.csv",
    f"{UNFINISHED}/*trials_data.csv",
    "data/*participants_data.csv",
)


@pytest.fixture
def study(tmp_path: Path, start: Start, attend: Attend, finished: Start) -> Path:
    """P007's session is finished, P008's is not; the key was opened and a trial excluded."""
    finished = finished()
    with start("P008") as left:
        attend(left)
    exclude(tmp_path / "study", "P007", 1, trial=2, by="AB", reason="the phone rang")
    blinding.reveal(tmp_path / "study", "AB", "analysis")
    return tmp_path / "study"


@pytest.mark.variants(8)
@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("damage", [with_a_bit_flipped, with_an_odd_value, with_deep_nesting])
def test_damage_neither_raises_a_traceback_nor_hides_a_session(
    tmp_path: Path, study: Path, protocol: Protocol, name: str, damage: Callable[[bytes, random.Random], bytes]
) -> None:
    if damage is not with_a_bit_flipped and name.endswith((".csv", ".sha256")):
        pytest.skip("holds no JSON")
    chance = random.Random(f"{SEED} {name} {damage.__name__}")  # noqa: S311 - a fixed choice of damage
    (path,) = study.glob(name)
    content = path.read_bytes()
    for _ in range(CASES):
        path.write_bytes(damage(content, chance))
        look_at(tmp_path, study, protocol)
        copy = shutil.copytree(study, tmp_path / "elsewhere" / "study", dirs_exist_ok=True)
        with contextlib.suppress(StudyError):
            rebuild_session(copy / Path(name).parent)


def look_at(results: Path, study: Path, protocol: Protocol) -> None:
    """Read a study like the commands and the home window; only errors of the program may be raised."""
    assert {facts.participant for facts in sessions(results, {})} == {"P007", "P008"}
    actions: tuple[Callable[[], object], ...] = (
        lambda: verify_study(study),
        lambda: reproduce_session(study / FINISHED),
        lambda: reproduce_session(study / UNFINISHED),
        lambda: check_resumable(study / UNFINISHED, protocol, SOURCE),
        lambda: blinding.revealed_key(study),
    )
    for action in actions:
        with contextlib.suppress(StudyError):
            action()


@pytest.mark.parametrize("damage", [with_a_bit_flipped, with_an_odd_value, with_deep_nesting])
def test_a_damaged_journal_is_listed_as_damaged_and_never_sound(
    tmp_path: Path, study: Path, damage: Callable[[bytes, random.Random], bytes]
) -> None:
    path = study / FINISHED / "journal.jsonl"
    content, chance = path.read_bytes(), random.Random(SEED)  # noqa: S311 - a fixed choice of damage
    for _ in range(CASES):
        path.write_bytes(damage(content, chance))
        assert not verify_study(study).is_sound
        status_of = {facts.participant: facts.status for facts in sessions(tmp_path, {})}
        assert status_of["P008"] == "unfinished"
        if scan(path).damage is not None:
            assert status_of["P007"] == "damaged"


@pytest.fixture
def session(start: Start, samples_of: Make, summary: dict[str, Any]) -> Path:
    """Return the folder of an ended session with one recorded trial."""
    store = start(recordings=True)
    assert store.recorder is not None
    store.append(
        journal_events.TrialStarted(trial=1, attempt=1, block="b", phase="main", part=1, index=1, of=1, code="L1")
    )
    store.recorder.start(1, 1, 1000.0)
    store.recorder.append(samples_of(40))
    for pages_shown in range(9):
        store.recorder.frame(16 * pages_shown + 9, 16 * pages_shown)
    store.recorder.stop()
    store.append(event_of("trial_ended", trial=1, attempt=1, outcome="complete", **summary))
    store.finish("completed")
    return store.folder.path


def flipped(content: bytes, chance: random.Random, *, footer: bool) -> Iterator[bytes]:
    """Yield copies of the file with one bit flipped, in its footer or anywhere."""
    size = 8 + int.from_bytes(content[-8:-4], "little") if footer else len(content)
    while True:
        at = len(content) - 1 - chance.randrange(size)
        yield content[:at] + bytes([content[at] ^ 1 << chance.randrange(8)]) + content[at + 1 :]


READERS = (recordings.read_samples, recordings.read_frames, recordings.read_checks, recordings.read_facts)


@pytest.mark.parametrize("footer", [False, True], ids=["anywhere", "footer"])
@pytest.mark.parametrize("name", ["trial-001.parquet", "trial-001_frames.parquet"])
def test_a_changed_bit_of_a_recording_is_an_error_and_never_a_traceback(session: Path, name: str, footer: bool) -> None:
    """Footers are those of opened recordings."""
    path = session / "recordings" / name
    if footer:
        unblind(session.parents[2], "AB", "done")
    content, secret = path.read_bytes(), secret_of(path)
    chance = random.Random(f"{SEED} {name} {footer}")  # noqa: S311 - a fixed choice of damage
    changes = flipped(content, chance, footer=footer)
    for number in range(CASES * 20):
        path.write_bytes(next(changes))
        for reader in READERS:
            with contextlib.suppress(StudyError):
                reader(path, secret)
        if number % 20 == 0:
            findings = verify_study(session.parents[2])
            assert any(name in str(error) for error in findings.errors)
