"""What each event of a session commands: whole sequences, as files that people review."""

from pathlib import Path

import pytest

from tests.golden import compare
from tests.session.transitions.transcribed import FOLDER, play
from tests.transcripts import played


@pytest.mark.parametrize("file", sorted(FOLDER.glob("*.txt")), ids=lambda file: file.stem)
def test_events_command_what_they_did(file: Path, pytestconfig: pytest.Config) -> None:
    compare(file, played(file, play), pytestconfig)
