"""The command reads a growing file, prints an estimate per second, and says by its exit code whether it holds."""

import re
from pathlib import Path

from click.testing import CliRunner

from study_app.cli import commands
from study_app.errors import StudyError
from tests.lab.estimation.measured import WATER, begun, lines, measured, planted, stirring

FILE = ("estimate", "rek2024", "--liquid", "water", "--idle", "0.1")


def said(*words: str, code: int = 0) -> str:
    result = CliRunner().invoke(commands, list(words))
    assert result.exit_code == code, result.output
    return result.output


def test_it_prints_values_with_intervals_and_the_computing_time(tmp_path: Path) -> None:
    rows = measured(planted(drag=0.42, length=1700, scaling=1700), *stirring(6.0))
    path = begun(tmp_path / "robot.csv")
    path.write_text(path.read_text("utf-8") + "".join(lines(rows)), "utf-8")
    out = said(*FILE, "--measured", str(path))
    assert re.search(r"6\.0 s  drag_coefficient 0\.4[12]?\d* \(0\.4\d+ … 0\.42\d*\); residual 0\.05", out)
    assert re.search(r"6000 rows, [\d.]+ µs of computing per row", out)


def test_it_ends_with_3_where_the_motion_shows_nothing(tmp_path: Path) -> None:
    t_s, places = stirring(2.0)
    path = begun(tmp_path / "robot.csv")
    path.write_text(path.read_text("utf-8") + "".join(lines(measured(WATER, t_s, 0.05 * places))), "utf-8")
    assert "does not identify the drag coefficient" in said(*FILE, "--measured", str(path), code=3)


def test_it_wants_one_source(tmp_path: Path) -> None:
    for words in ((), ("--measured", "a.csv", "--lsl", "robot")):
        result = CliRunner().invoke(commands, [*FILE, *words])
        assert isinstance(result.exception, StudyError)
        assert "name either a file" in str(result.exception)
    empty = CliRunner().invoke(commands, [*FILE, "--measured", str(begun(tmp_path / "robot.csv"))])
    assert "nothing came for 1 s" in str(empty.exception)
