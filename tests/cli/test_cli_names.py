"""One name for one thing in all commands; groups in the help; names of studies and sessions from the workspace."""

from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.cli.options import GROUPS
from study_app.protocol.load import load, source_bytes
from study_app.store.exclusions import exclusions
from study_app.store.sessions.begin import SessionStart, begin
from study_app.store.workstation import load as load_settings

pytestmark = pytest.mark.slow

IN_GROUPS = [name for names in GROUPS.values() for name in names.split()]
TAKE_A_STUDY = ("export", "plot", "report", "unblind", "exclude", "include", "verify")
TAKE_A_SESSION = ("resume", "rebuild", "reproduce", "replay")


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """P007 of demo, begun in the workspace; the program starts elsewhere."""
    folder = tmp_path / "workspace" / "results" / "demo"
    for person in ("P007", "P008"):
        begin(
            folder,
            load("demo"),
            source_bytes("demo"),
            SessionStart(
                person, seed=1, operator="AK", language="en", device={"name": "mouse"}, screens={}, simulated=False
            ),
        ).close()
    (tmp_path / "start").mkdir()
    monkeypatch.chdir(tmp_path / "start")
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path / "workspace"))
    return folder


def said(*words: str, code: int = 0) -> str:
    done = CliRunner().invoke(commands, words)
    assert done.exit_code == code, done.output
    return done.output


def options() -> dict[str, dict[str, click.Parameter]]:
    """Return every option and argument of every command by its name as it is written."""
    return {
        name: {word: one for one in command.params for word in (*one.opts, *one.secondary_opts)}
        for name, command in commands.commands.items()
    }


def test_help_lists_every_command_once_under_its_heading_with_its_whole_sentence() -> None:
    shown = said("--help")
    assert sorted(IN_GROUPS) == sorted(commands.commands)
    for heading, names in GROUPS.items():
        part = shown.split(f"\n{heading}:\n")[1].split("\n\n")[0]
        assert [line.split()[0] for line in part.splitlines() if not line.startswith("   ")] == names.split()
        assert "..." not in part, "a command's first sentence is cut off"


def test_every_command_writes_to_to_and_names_who_decides_by() -> None:
    written = {word for params in options().values() for word in params}
    assert not written & {"--out", "--output", "--operator", "--scene", "--name", "--folder"}
    for name in ("export", "plot", "report", "simulate", "identify", "figures", "power", "screenshots"):
        assert "--to" in options()[name], name
    for name in ("unblind", "exclude", "include", "run", "resume"):
        assert "--by" in options()[name], name


def test_every_command_of_a_study_or_session_takes_results() -> None:
    for name in (*TAKE_A_STUDY, *TAKE_A_SESSION, "run", "rehearse", "sessions"):
        assert "--results" in options()[name], name


def test_a_study_goes_by_path_name_and_option(study: Path) -> None:
    by_name = said("verify", "demo", code=0)
    assert said("verify", str(study)) == said("verify", "--results", str(study)) == by_name
    assert "2 sessions" in by_name
    assert "RESULTS, or --results DIR" in said("verify", code=2)
    assert "RESULTS, or --results DIR" in said("verify", "demo", "--results", str(study), code=2)


def test_a_session_goes_by_the_name_that_sessions_lists(study: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    listed = said("sessions")
    assert [line.split()[0] for line in listed.splitlines()] == ["demo/P007/1", "demo/P008/1"]
    assert "unfinished" in listed
    assert said("sessions", "demo") == listed
    for words in (("demo/P007/1",), ("demo/P007",), ("P007/1", "--results", str(study))):
        assert "nothing to do" in said("rebuild", *words)
    (elsewhere,) = [line.split()[0] for line in said("sessions", "--results", str(study)).splitlines()][:1]
    assert elsewhere == "demo/P007/1"
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(study.parents[2] / "other"))
    listed = said("sessions", "--results", str(study)).splitlines()
    assert "nothing to do" in said("rebuild", listed[0].split()[0])


def test_studies_lists_protocols_and_results(study: Path) -> None:
    (study.parents[1] / "protocols").mkdir()
    (study.parents[1] / "protocols" / "mine.toml").write_bytes(source_bytes("demo"))
    (study.parents[1] / "protocols" / "bad.toml").write_text("format = 1\n")
    shown = said("studies")
    assert "  mine  A first look\n" in shown
    assert "  bad  cannot be used: " in shown
    assert "  demo  2 sessions\n" in shown


def test_an_exclusion_is_made_listed_and_taken_back(study: Path) -> None:
    said("exclude", "demo", "--participant", "P007", "--by", "AK", "--reason", "asleep")
    assert "demo/P007/1" in said("sessions").splitlines()[0]
    assert said("sessions").splitlines()[0].endswith("excluded")
    shown = said("include", "demo", "--participant", "P007", "--by", "CD", "--reason", "awake")
    assert shown == "counts again: participant P007, session 1\n"
    assert exclusions(study) == ()
    assert "excluded" not in said("sessions")


def test_the_workspace_is_shown_and_changed(study: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert said("workspace").strip() == str(study.parents[1])
    monkeypatch.delenv("LIQUID_STUDY_WORKSPACE")
    assert said("workspace", str(tmp_path / "new")).strip() == str(tmp_path / "new")
    assert (tmp_path / "new" / "protocols").is_dir()
    assert load_settings().workspace == str(tmp_path / "new")
    assert said("workspace").strip() == str(tmp_path / "new")
