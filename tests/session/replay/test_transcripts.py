"""What replay and reproduction say of sessions that were changed: as files that people review."""

import re
from functools import cache
from pathlib import Path

import pytest

from tests.compiled import needs_servo
from tests.golden import compare
from tests.session.replay.played_sessions import STARTS, player
from tests.studies import once
from tests.transcripts import every, played

pytestmark = [needs_servo, pytest.mark.slow]

FILES = every(Path(__file__).parent / "transcripts", "changes levels")
SECRET = re.compile(r"\b(thin|thick|prompt|late|200|1400|0\.[1248](?!\.\d))\b")


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_replays_report_the_recorded_findings(
    file: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config
) -> None:
    @cache
    def made(start: str) -> Path:
        return once(tmp_path_factory, f"replayed-{start}", STARTS[start])

    lines = played(file, player(made, tmp_path))
    compare(file, lines, pytestconfig)
    assert not [line for line in lines if line.startswith("> ") and SECRET.search(line)], (
        "no sentence tells a condition"
    )
