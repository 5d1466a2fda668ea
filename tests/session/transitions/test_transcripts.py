"""What each event of a session commands: whole sequences, as files that people review."""

import pytest

from tests.session.transitions.transcribed import FOLDER, Transcript, regenerate, transcripts

FILES = sorted(FOLDER.glob("*.txt"))


@pytest.fixture(scope="module", autouse=True)
def _written_anew(pytestconfig: pytest.Config) -> None:
    if pytestconfig.getoption("regenerate"):
        for file in FILES:
            regenerate(file)


@pytest.mark.parametrize(
    "transcript", [pytest.param(one, id=f"{file.stem}: {one.name}") for file in FILES for one in transcripts(file)]
)
def test_events_command_what_they_did(transcript: Transcript) -> None:
    assert tuple(transcript.played()) == transcript.lines
