"""``new`` and ``edit`` open the study designer; what cannot be opened is refused before any window."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from study_app import app
from study_app.authoring.writer.refused import Refused
from study_app.cli import commands
from study_app.errors import ProtocolError, StudyError


class Visit:
    """What the study designer is asked for."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, ...]] = []

    def begin_study(self, source: str, name: str) -> None:
        self.asked.append(("begin", source, name))

    def open_designer(self, source: str) -> None:
        self.asked.append(("open", source))


@pytest.fixture
def visit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Visit:
    made = Visit()

    def home(*, then: Any) -> int:
        then(SimpleNamespace(lab_and_designer=made))
        return 0

    monkeypatch.setattr(app, "home", home)
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    return made


def test_new_begins_a_study_in_the_designer_and_writes_nothing(visit: Visit, tmp_path: Path) -> None:
    assert CliRunner().invoke(commands, ["new", "mine", "--template", "rate-realism"]).exit_code == 0
    assert visit.asked == [("begin", "template:rate-realism", "mine")]
    assert not (tmp_path / "protocols").exists()


def test_edit_opens_a_study_by_name_or_file(visit: Visit, tmp_path: Path) -> None:
    file = tmp_path / "other.toml"
    file.write_text("format = 1\n")
    for words in ("demo", str(file)):
        assert CliRunner().invoke(commands, ["edit", words]).exit_code == 0
    assert visit.asked == [("open", "demo"), ("open", str(file))]


@pytest.mark.parametrize(
    ("words", "error"),
    [(("edit", "nowhere"), ProtocolError), (("new", "My study"), Refused), (("new", "rek2024"), Refused)],
)
def test_what_cannot_be_is_refused_before_a_window_opens(
    visit: Visit, words: tuple[str, ...], error: type[StudyError]
) -> None:
    assert isinstance(CliRunner().invoke(commands, words).exception, error)
    assert visit.asked == []
