"""What each command prints, its exit code and its files, on a small study; and what is said of bad input."""

import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from study_app.cli import main
from study_app.session.simulated.answers_only import rehearse_answers
from tests.golden import CHANGING, compare
from tests.studies import made_up, once

GOLDEN = Path(__file__).parent / "golden"
COMMANDS = {
    "study": (
        "--version",
        "nothing",
        "check demo",
        "check nowhere",
        "check bad.toml",
        "check demo --liquid water",
        "check",
        "check liquids.toml",
        "check half.toml",
        "new own --no-window",
        "new own --no-window",
        "new My-Study! --no-window",
        "new other --no-window --template rate-realism",
        "new other2 --no-window --template none",
        "check own",
        "design demo --participants 4",
        "design demo --participants 4 --seed 2",
        "design demo --participants 0",
        "design demo",
        "power demo --participants 0",
        "studies",
        "workspace",
        "workspace elsewhere",
        "outlets",
        "outlets --markers on --triggers serial:COM1",
        "outlets --samples single-blind",
        "outlets",
        "outlets --triggers nowhere",
        "outlets --markers off --samples off --triggers off",
        "outlets --markers maybe",
    ),
    "data": (
        "sessions",
        "sessions demo",
        "sessions nowhere",
        "verify demo",
        "verify results/demo",
        "verify --results results/demo",
        "verify",
        "verify demo --results demo",
        "rebuild demo/P001/1",
        "rebuild demo/P009/1",
        "rebuild P001",
        "reproduce demo/P001/1",
        "reproduce demo/P001",
        "exclude demo --participant P001 --by AK --reason asleep",
        "exclude demo --participant P001 --by AK --reason again",
        "exclude demo --participant P002 --trial 1 --by AK --reason asleep",
        "exclude demo --participant P009 --by AK --reason asleep",
        "exclude demo --participant P001 --trial 99 --by AK --reason asleep",
        "exclude demo --participant P001",
        "sessions",
        "include demo --participant P001 --by CD --reason awake",
        "include demo --participant P001 --by CD --reason awake",
        "include demo --participant P002 --trial 1 --by CD --reason awake",
        "unblind demo --by AK --reason closed",
        "unblind demo --by AK --reason again",
        "unblind demo",
        "verify demo",
        "merge --to merged",
        "merge A=results/demo B=results/copied --to merged",
        "merge A=results/demo B=nowhere --to merged",
        "merge --site A=results/demo --to merged",
        "sessions merged",
        "withdraw demo --participant P002 --by AK --reason left",
        "withdraw demo --participant P002 --by AK --reason again",
        "withdraw demo --participant P009 --by AK --reason left",
        "sessions demo",
        "verify demo",
    ),
    "model": (
        "simulate",
        "simulate rek2024 --liquid honey --path circle --to circle.csv",
        "simulate rek2024 --liquid honey --path stop --to stop.csv --set liquid.density_kg_m3=900",
        "simulate rek2024 --liquid honey --path stop --to stop.csv --set liquid.density_kg_m3=x",
        "simulate rek2024 --liquid honey --path stop --to stop.csv --set nothing=1",
        "simulate rek2024 --liquid honey --path nowhere.csv --to stop.csv",
        "simulate rek2024 --liquid treacle --path stop --to stop.csv",
        "simulate rek2024 --liquid honey --path motion.csv --to moved.csv",
        "devices doctor --device hammer",
        "devices bench hammer",
        "devices calibrate --grams 5",
        "identify",
        "run demo",
        "run demo --participant P!",
        "run demo --participant P001 --device hammer",
        "resume nowhere",
        "rehearse demo --participants 0",
        "rehearse nowhere --participants 1",
        "replay nowhere",
        "validate-report --studies 0",
        "accuracy --nothing",
    ),
    "outputs": (
        "preregister demo",
        "preregister demo --to out",
        "report nowhere --to out",
        "export nowhere --to out",
        "plot nowhere --to out",
        "export demo --to tables",
        "export demo --to tables --parquet --wide",
        "export demo",
        "plot demo --to figures",
        "replay demo/P001/1",
        "scene rek2024 --liquid treacle",
    ),
}


@pytest.fixture
def workspace(tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace with a study of two people, its copy, and files that are no protocols."""

    def make(folder: Path) -> None:
        rehearse_answers("demo", participants=2, seed=7, results=folder / "demo", features=made_up("demo"))

    for name in ("demo", "copied"):
        shutil.copytree(once(tmp_path_factory, "cli-demo", make) / "demo", tmp_path / "results" / name)
    (tmp_path / "bad.toml").write_text("format = 1\n[study]\nname = 3\n")
    (tmp_path / "liquids.toml").write_text("format = 1\n[liquids.tar]\ndensity_kg_m3 = 1153\n")
    half = (tmp_path / "liquids.toml").read_text() + '[study]\nname = "half"\n'
    (tmp_path / "half.toml").write_text(half)
    rows = "\n".join(f"{k / 1000},{k / 5000},0,{k * k / 1e6}" for k in range(50))
    (tmp_path / "motion.csv").write_text(f"t_s,x_m,y_m,z_m\n{rows}\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


@pytest.mark.parametrize(
    "group", [pytest.param(name, marks=[pytest.mark.slow] if name == "outputs" else []) for name in COMMANDS]
)
def test_commands(group: str, workspace: Path, capsys: Any, monkeypatch: Any, pytestconfig: pytest.Config) -> None:
    def files() -> set[str]:
        found = (path.relative_to(workspace) for path in workspace.rglob("*") if path.is_file())
        return {str(path) for path in found}

    @contextmanager
    def progress(_otherwise: Any = None) -> Iterator[Any]:
        yield lambda what, share=None: sys.stderr.write(f"… {what}{'' if share is None else f' {share:.2f}'}\n")

    for module in ("data", "model"):
        monkeypatch.setattr(f"study_app.cli.{module}.progress", progress)
    lines, before = list[str](), files()
    for line in COMMANDS[group]:
        monkeypatch.setattr("sys.argv", ["liquid-study", *line.split()])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        now = files()
        lines += [f"$ {line}", f"code {ended.value.code}", *(f"| {one}" for one in out.splitlines())]
        lines += [*(f"! {one}" for one in err.splitlines()), *(f"+ {one}" for one in sorted(now - before))]
        lines += [f"- {one}" for one in sorted(before - now)]
        before = now
    lines = [line.replace(str(workspace), "FOLDER").replace("python -m pytest.", "") for line in lines]
    compare(GOLDEN / f"{group}.txt", lines, pytestconfig, mask=CHANGING)
