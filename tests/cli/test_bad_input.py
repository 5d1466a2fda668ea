"""Input that no command can use: one line, exit code 2, and nothing written."""

from pathlib import Path

import pytest

from study_app.cli import main
from tests.compiled import needs_servo

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
        ((*SIMULATE, "--path", "circle", "--to", ""), "--to': is empty"),
        ((*SIMULATE, "--path", "circle", "--to", "o.csv", "--set", CURRENT), "velocity_mps: must be less than"),
        ((*SIMULATE, "--path", "circle", "--to", "o.csv", "--set", f"alpha={'9' * 6000}"), "alpha"),
        (("export", SAMPLE, "--to", ""), "--to': is empty"),
        (("rehearse", "demo", "--results", ""), "--results': is empty"),
        (("run", "demo", "--participant", "P001", "--results", ""), "--results': is empty"),
        (("validate-report", "--to", ""), "--to': is empty"),
        (("check", "x" * 5000), f"{'x' * 200}…: the file name is too long"),
        (("verify", "x" * 5000), "…: the file name is too long"),
        (("merge", "--site", f"A={'x' * 5000}", "--to", "m"), "… cannot be read (File name too long)"),
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
    monkeypatch.setattr("sys.argv", ["liquid-study", *words])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert len(line) < 600
    assert sorted(path.name for path in tmp_path.iterdir()) == ["far.csv", "fast.csv"]
