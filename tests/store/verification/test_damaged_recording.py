"""Damaged recordings: single bits, with a fixed seed. Whatever reads one says that it is damaged, or reads numbers."""

import contextlib
import os
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from study_app.errors import StudyError
from study_app.store import recording_files
from study_app.store.verification.verify_study import verify
from tests.store.conftest import Make, Start

pytestmark = pytest.mark.slow

SEED = int(os.environ.get("LIQUID_STUDY_DAMAGE_SEED", "5"))
CASES = int(os.environ.get("LIQUID_STUDY_DAMAGE_CASES", "5"))
TOLD = {"block": "b", "phase": "main", "part": 1, "index": 1, "of": 1, "code": "L1"}


@pytest.fixture
def session(start: Start, samples_of: Make, summary: dict[str, Any]) -> Path:
    """Return the folder of a session with one recorded trial, which ended."""
    store = start(recordings=True)
    assert store.recorder is not None
    store.append("trial_started", trial=1, attempt=1, **TOLD)
    store.recorder.start(1, 1, 1000.0)
    store.recorder.append(samples_of(40))
    for shown in range(9):
        store.recorder.frame(16 * shown + 9, 16 * shown)
    store.recorder.stop()
    store.append("trial_ended", trial=1, attempt=1, outcome="complete", **summary)
    store.finish("completed")
    return store.folder.path


def flipped(content: bytes, chance: random.Random, *, footer: bool) -> Iterator[bytes]:
    """Yield the file with one bit changed, again and again: in its footer, or anywhere."""
    size = 8 + int.from_bytes(content[-8:-4], "little") if footer else len(content)
    while True:
        at = len(content) - 1 - chance.randrange(size)
        yield content[:at] + bytes([content[at] ^ 1 << chance.randrange(8)]) + content[at + 1 :]


READERS = (
    recording_files.read_samples,
    recording_files.read_frames,
    recording_files.read_checks,
    recording_files.read_facts,
)


@pytest.mark.parametrize("footer", [False, True], ids=["anywhere", "footer"])
@pytest.mark.parametrize("name", ["trial-001.parquet", "trial-001_frames.parquet"])
def test_a_changed_bit_of_a_recording_is_an_error_and_never_a_traceback(session: Path, name: str, footer: bool) -> None:
    path = session / "recordings" / name
    content = path.read_bytes()
    chance = random.Random(f"{SEED} {name} {footer}")  # noqa: S311 - a fixed choice of damage
    changes = flipped(content, chance, footer=footer)
    for number in range(CASES * 20):
        path.write_bytes(next(changes))
        for read in READERS:
            with contextlib.suppress(StudyError):
                read(path)
        if number % 20 == 0:
            findings = verify(session.parents[2])
            assert any(name in str(error) for error in findings.errors)
