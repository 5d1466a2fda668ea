"""A file that another program appends to is read line by line, each once."""

from pathlib import Path

import numpy as np
import pytest

from study_app.errors import StudyError
from study_app.lab.estimation.sources import GrowingCsv, Rows, joined
from tests.lab.estimation.measured import COLUMNS, WATER, begun, lines, measured, stirring


def append(path: Path, text: str) -> None:
    with path.open("a", encoding="utf-8") as file:
        file.write(text)


def test_lines_come_once_and_only_whole(tmp_path: Path) -> None:
    rows = measured(WATER, *stirring(0.5))
    path, text = begun(tmp_path / "robot.csv"), "".join(lines(rows))
    source = GrowingCsv(path)
    assert len(source.poll()) == 0
    found = []
    for first in range(0, len(text), 997):  # in the middle of lines and numbers
        append(path, text[first : first + 997])
        found.append(source.poll())
    assert len(source.poll()) == 0
    for name in Rows.__slots__:
        assert np.array_equal(np.concatenate([getattr(it, name) for it in found]), getattr(rows, name)), name


def test_velocities_follow_from_positions(tmp_path: Path) -> None:
    rows = measured(WATER, *stirring(1.0))
    path = begun(tmp_path / "robot.csv", f"{COLUMNS}\n")
    source = GrowingCsv(path)
    append(path, "".join(lines(rows, velocities=False)))
    found = joined(*(source.poll() for _ in range(4)))  # a long file comes in pieces
    assert len(found) == len(rows) - 24  # 12 to both sides
    true = np.interp(found.t_s, rows.t_s, rows.velocity_mps[:, 0])
    assert np.abs(found.velocity_mps[:, 0] - true).max() < 2e-4


@pytest.mark.parametrize(
    ("line", "what"),
    [
        ("0.1,0,0,0,1\n", "line 3: has 5 fields"),
        ("0,1,0,0,0,0,0,0,0,0,0\n", "line 3: has 11 fields, more than the 10 of the header"),
        ('0.1,0,0,0,0,0,0,0,0,"0,5"\n', "line 3: '0,5' is not a finite number; write a decimal point"),
        ("0.1,0,0,0,0,0,0,0,0,1_0\n", "line 3: '1_0' is not a finite number"),
        ("0.1,0,0,0,much,0,0,0,0,0\n", "line 3: 'much' is not a finite number"),
        ("0.1,0,0,0,nan,0,0,0,0,0\n", "line 3: 'nan' is not a finite number"),
        ("0.1,0,0,0,0,0,0,0,0,0\n0.1,0,0,0,0,0,0,0,0,0\n", "line 4: t_s must increase"),
        ("\x80\n", "not UTF-8 text in line 3"),
    ],
)
def test_a_line_that_cannot_be_used_is_named(tmp_path: Path, line: str, what: str) -> None:
    path = begun(tmp_path / "robot.csv")
    with path.open("ab") as file:
        file.write(line.encode("latin-1"))
    with pytest.raises(StudyError, match=what):
        GrowingCsv(path).poll()


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(StudyError, match="No such file"):
        GrowingCsv(tmp_path / "none.csv")
    with pytest.raises(StudyError, match="has no column fx_n, fy_n, fz_n"):
        GrowingCsv(begun(tmp_path / "motion.csv", "t_s,x_m,y_m,z_m\n")).poll()
    path = begun(tmp_path / "robot.csv")
    source = GrowingCsv(path)
    append(path, "".join(lines(measured(WATER, *stirring(0.1)))))
    source.poll()
    begun(path)
    with pytest.raises(StudyError, match="became shorter"):
        source.poll()


def test_columns_may_be_separated_by_semicolons(tmp_path: Path) -> None:
    rows = measured(WATER, *stirring(0.1))
    path = begun(tmp_path / "robot.csv")
    path.write_text(f"\ufeff{path.read_text()}{''.join(lines(rows))}".replace(",", ";"), encoding="utf-8")
    source = GrowingCsv(path)
    assert np.array_equal(joined(source.poll(), source.poll()).force_n, rows.force_n)
