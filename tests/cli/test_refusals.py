"""What commands refuse in one line, without a window or a file; `new`, `edit` and `outlets`."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from study_app import app
from study_app.cli import commands
from study_app.errors import StudyError
from study_app.evidence import accuracy
from study_app.evidence.table import Evidence
from study_app.protocol.load import load_scenes


class Visit:
    """The requests to the study designer."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, ...]] = []

    def begin_new_study(self, source: str, name: str) -> None:
        self.asked.append(("begin", source, name))

    def open_designer(self, source: str) -> None:
        self.asked.append(("open", source))


@pytest.fixture
def visit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Visit:
    made = Visit()

    def home(*, then: Any) -> int:
        then(made)
        return 0

    monkeypatch.setattr(app, "run_home_window", home)
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    return made


def test_new_opens_the_designer_without_writing_a_file(visit: Visit, tmp_path: Path) -> None:
    assert CliRunner().invoke(commands, ["new", "mine", "--template", "rate-realism"]).exit_code == 0
    assert visit.asked == [("begin", "template:rate-realism", "mine")]
    assert not (tmp_path / "protocols").exists()


def test_edit_opens_a_study_by_name_or_file(visit: Visit, tmp_path: Path) -> None:
    file = tmp_path / "other.toml"
    file.write_text("format = 2\n", encoding="utf-8", newline="\n")
    for words in ("demo", str(file)):
        assert CliRunner().invoke(commands, ["edit", words]).exit_code == 0
    assert visit.asked == [("open", "demo"), ("open", str(file))]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("edit", "nowhere"), "nowhere"),
        (("new", "My study"), "is not a valid short name"),
        (("new", "rek2024"), "rek2024"),
    ],
)
def test_impossible_commands_are_refused_before_a_window_opens(visit: Visit, words: tuple[str, ...], said: str) -> None:
    result = CliRunner().invoke(commands, words).exception
    assert isinstance(result, StudyError)
    assert said in str(result)
    assert visit.asked == []


def test_a_survey_of_liquids_is_written_into_a_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    names = list(load_scenes("slime"))
    compared = [SimpleNamespace(liquid=name) for name in names if name not in ("slime", "ketchup")]
    monkeypatch.setattr(accuracy, "survey_scenes", lambda _scenes, _show: compared)
    monkeypatch.setattr(accuracy, "survey_evidence", lambda surveys: Evidence("", {"survey.md": surveys[0].liquid}))
    result = CliRunner().invoke(commands, ["accuracy", "slime", "--liquids", "--to", str(tmp_path)])
    assert (result.exit_code, (tmp_path / "survey.md").read_text("utf-8")) == (0, compared[0].liquid), result.output
    assert result.stdout.strip() == str(tmp_path / "survey.md")
    omitted = ", ".join(name for name in names if name in ("slime", "ketchup"))
    assert f"not compared, because references need a constant viscosity: {omitted}\n" in result.stderr
