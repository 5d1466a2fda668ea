"""What is found of studies that were changed or cut: commands and all that they say, as files that people review."""

from pathlib import Path

import pytest

from tests.golden import compare
from tests.platforms import needs_links
from tests.store.verification.played_studies import STARTS, player
from tests.transcripts import every, played

FILES = every(Path(__file__).parent / "transcripts", "blinding forgeries journals links proofs resumption tables")


@pytest.fixture(scope="module")
def made_studies(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return {name: make(tmp_path_factory.mktemp(name) / "study") for name, make in STARTS.items()}


@pytest.mark.slow
@pytest.mark.parametrize(
    "file", [pytest.param(file, marks=[needs_links] * (file.stem == "links"), id=file.stem) for file in FILES]
)
def test_verification_finds_the_recorded_changes(
    file: Path, made_studies: dict[str, Path], tmp_path: Path, pytestconfig: pytest.Config
) -> None:
    compare(file, played(file, player(made_studies, tmp_path)), pytestconfig)
