"""What commands refuse in one line, without a window or a file; `new`, `edit` and `outlets`."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest
from click.testing import CliRunner

from study_app import app
from study_app.cli import commands, main
from study_app.cli.devices import _ask_operator
from study_app.designer.document.toml_text import Refused
from study_app.errors import OutletError, ProtocolError, StudyError
from study_app.evidence.accuracy import survey
from study_app.evidence.table import Evidence
from study_app.store.workstation import DEFAULTS, load
from tests.compiled import needs_servo


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
        then(made)
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


@pytest.mark.parametrize("port", ["COM3", "usb:1", "serial:", "lsl", "", "serial:/dev/\x00"])
def test_a_port_that_is_none_is_refused_in_a_line(port: str) -> None:
    with pytest.raises(
        OutletError, match="use one like parallel:/dev/parport0 or serial:/dev/ttyUSB0, or off"
    ) as found:
        CliRunner().invoke(commands, ["outlets", "--triggers", port], catch_exceptions=False)
    assert isinstance(found.value, StudyError)
    assert load() == DEFAULTS


FAR = "t_s,x_m,y_m,z_m\n0,0,0,0\n0.001,1e308,0,0\n0.002,-1e308,0,0\n"
FAST = "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n0,0,0,0,0,0,0\n0.001,0,0,0,1e308,1e308,0\n"
SIMULATE = ("simulate", "rek2024", "--liquid", "water")
CURRENT = 'current={kind="uniform", velocity_mps=[1e308, 0, 0]}'
SAMPLE = str(Path(__file__).parents[2] / "results" / "sample-rek2024")
LONG = tuple(
    (*command, "--to", "far.csv")
    for command in (("power", "demo"), ("stability",), ("validate",), ("validate-report",))
)
"""Commands that would find out minutes later."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("rehears",), "No such command 'rehears'. Did you mean 'rehearse'?"),
        (("check", "rek2042"), "rek2024"),
        (("run", "demo", "--participant", "P-1"), "only letters A-Z"),
        (("run", "demo", "--participant", "P001", "--device", "falkon"), "falkon"),
        (("run", "demo", "--participant", "P001", "--language", "xx"), "demo is written in en; choose"),
        ((*SIMULATE, "--path", "circle", "--to", "o.csv", "--set", "densitee_kg_m3=1"), "density_kg_m3"),
        ((*SIMULATE, "--path", "zero.csv", "--to", "o.csv"), "zero"),
        (("accuracy", "--liquid", "nothing"), "there are water, honey, light_oil"),
        (("devices", "calibrate", "--device", "mouse", "--scale"), "only a Falcon has motors"),
        (("devices", "calibrate", "--device", "falcon-emulated", "--scale"), "use a weight with --grams"),
        ((*SIMULATE, "--path", "circle", "--to", ""), "--to': is empty"),
        ((*SIMULATE, "--path", "circle", "--to", "o.csv", "--set", CURRENT), "velocity_mps: must be less than"),
        ((*SIMULATE, "--path", "circle", "--to", "o.csv", "--set", f"alpha={'9' * 6000}"), "alpha"),
        (("export", SAMPLE, "--to", ""), "--to': is empty"),
        (("rehearse", "demo", "--results", ""), "--results': is empty"),
        (("run", "demo", "--participant", "P001", "--results", ""), "--results': is empty"),
        (("validate-report", "--to", ""), "--to': is empty"),
        (("check", "x" * 5000), f"{'x' * 200}…: the file name is too long"),
        (("verify", "x" * 5000), "…: the file name is too long"),
        (("merge", f"A={'x' * 5000}", "--to", "m"), "… cannot be read (File name too long)"),
        (("rehearse", "demo", "--results", "r", "--seed", "9" * 5000), "… is not a valid integer"),
        *((words, "far.csv (it is a file, not a folder)") for words in LONG),
        pytest.param((*SIMULATE, "--path", "far.csv", "--to", "o.csv"), "must be finite", marks=needs_servo),
        pytest.param((*SIMULATE, "--path", "fast.csv", "--to", "o.csv"), "must be finite", marks=needs_servo),
    ],
)
def test_bad_input_is_one_short_line_and_nothing_is_written(
    words: tuple[str, ...],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "far.csv").write_text(FAR, encoding="utf-8")
    (tmp_path / "fast.csv").write_text(FAST, encoding="utf-8")
    (tmp_path / "zero.csv").write_text("t_s,x_m,y_m,z_m\n0,0,0,0\n0.001,0,zero,0\n", encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["liquid-study", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    *heading, line = capsys.readouterr().err.splitlines()
    assert [head.rpartition(": ")[2] for head in heading] in ([], ["1 problem"]), "of a file its name, then the problem"
    assert said in line
    assert len(line) < 600
    assert sorted(path.name for path in tmp_path.iterdir()) == ["far.csv", "fast.csv", "zero.csv"]


def test_a_survey_of_liquids_is_written_into_a_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(survey, "survey", lambda _scenes, _show: ("compared",))
    monkeypatch.setattr(survey, "evidence", lambda found: Evidence("", {"survey.md": found[0]}))
    done = CliRunner().invoke(commands, ["accuracy", "--liquids", "--to", str(tmp_path)])
    assert (done.exit_code, (tmp_path / "survey.md").read_text()) == (0, "compared"), done.output
    assert done.stdout.strip() == str(tmp_path / "survey.md")


def test_at_the_bench_enter_alone_answers_only_the_question_to_let_go() -> None:
    asked: Any = SimpleNamespace(ask=lambda kind, _words: kind)
    assert [_ask_operator(asked)(kind, "") for kind in ("let-go", "hang")] == ["let-go", "reading"]


@pytest.mark.parametrize(
    ("command", "words", "taken"),
    [
        ("run", ("--by=AK", "--by", "AK"), ("--operator=AK", "--operator", "AK")),
        ("run", ("--operator", "AK, not --by=BM", "--site=x"), ("--operator", "AK, not --by=BM", "--site=x")),
        ("merge", ("--site", "A=x", "--site=Delft=x", "B=a --site=b"), ("A=x", "Delft=x", "B=a --site=b")),
        ("exclude", ("--by=AK", "--reason", "--by=BM"), ("--by=AK", "--reason", "--by=BM")),
    ],
)
def test_former_options_are_renamed_and_texts_that_contain_them_are_not(
    command: str, words: tuple[str, ...], taken: tuple[str, ...]
) -> None:
    assert commands.resolve_command(click.Context(commands), [command, *words])[2] == [*taken]


@pytest.mark.parametrize(
    ("command", "said"), [("validate", "--help)"), ("verify", "verify rek2024)"), ("sessions", "sessions rek2024)")]
)
def test_an_example_names_what_a_command_takes(
    command: str, said: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["liquid-study", command, "--nothing"])
    with pytest.raises(SystemExit):
        main()
    assert capsys.readouterr().err.endswith(f"{said}\n")


@pytest.mark.parametrize("command", ["run", "resume"])
def test_the_former_name_of_the_operator_is_taken_with_a_notice(command: str) -> None:
    told = CliRunner().invoke(commands, [command, "nowhere", "--by=AK"])
    assert "--by is --operator now" in told.output
    assert "No such option" not in told.output
    assert "No such option" in CliRunner().invoke(commands, ["verify", "nowhere", "--by=AK"]).output
