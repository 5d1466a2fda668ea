"""The command of the accuracy table: what it prints and refuses."""

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.cli.evidence.accuracy import motion_along
from study_app.errors import StudyError
from study_app.haptics.model.motion import Motion
from study_app.validation.accuracy.comparison import accuracy
from tests.validation.accuracy.scenes import TANK, compiled

pytestmark = pytest.mark.slow


def test_what_the_command_cannot_do_is_said_in_a_line():
    for words, said in (
        (["--liquid", "watr"], "there are water"),
        (["--liquid", "watr"], "or give FILE, which has it"),
        (["rek2024"], "rek2024: say which --liquid of"),
        (["--liquid", "water", "--path", "circl"], "did you mean 'circle'"),
    ):
        refused = CliRunner().invoke(commands, ["accuracy", *words])
        assert refused.exit_code != 0
        assert said in f"{refused.output}{refused.exception}"


@compiled
def test_a_motion_that_meets_no_force_is_refused():
    rest = Motion(np.arange(100) / 1000, np.zeros((100, 3)))
    with pytest.raises(StudyError, match="along a rest water exerts no force"):
        accuracy(TANK, None, rest, named="a rest")


def test_a_motion_file_of_another_rate_is_brought_to_the_scenes(tmp_path):
    rows = "\n".join(f"{k / 50},{k / 100},0,0" for k in range(21))
    (tmp_path / "slow.csv").write_text(f"t_s,x_m,y_m,z_m\n{rows}\n", encoding="utf-8")
    read = motion_along(str(tmp_path / "slow.csv"), TANK)
    assert read.t_s == pytest.approx(np.arange(401) / 1000)
    assert read.position_m[:, 0] == pytest.approx(read.t_s / 2)


@compiled
def test_the_command_prints_the_table_of_one_liquid(tmp_path):
    small = tmp_path / "small.toml"
    small.write_text("[liquids.gel]\ndensity_kg_m3 = 1000\n", encoding="utf-8")
    rows = "\n".join(f"{k / 1000},{k / 4000},0,0" for k in range(50))
    (tmp_path / "move.csv").write_text(f"t_s,x_m,y_m,z_m\n{rows}\n", encoding="utf-8")
    told = CliRunner().invoke(commands, ["accuracy", str(small), "--path", str(tmp_path / "move.csv")])
    assert told.exit_code == 0, told.output
    assert "gel has no viscosity" in told.output
    assert "central differences" in told.output
    assert "the motion is short: calls, of some µs, count in times of 5 ticks a batch" in told.output
    assert "| drag |" in told.output
