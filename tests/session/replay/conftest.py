"""What the tests of replay share."""

from pathlib import Path

import pytest

from study_app.session.simulated.rehearsal import rehearse
from tests.faults.support import short


@pytest.fixture(scope="session")
def rehearsed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("replay")
    rehearse(short.write(folder), participants=1, seed=1, results=folder / "results")
    return folder / "results"
