"""What each command prints, its exit code and its files, on a small study; and what is said of bad input.

The commands are the lines of the golden files that begin with ``$``; those with ``@`` change files in between.
"""

import shlex
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from study_app.cli import main
from study_app.session.simulated.answers_only import rehearse_answers
from tests.compiled import needs_servo
from tests.golden import CHANGING, compare, masked
from tests.platforms import needs_window_system
from tests.studies import made_up, once
from tests.transcripts import Files, every, value_of

GOLDEN = every(Path(__file__).parent / "golden", "data model outputs refusals sites study withdrawals")
LATER = {
    "model": [needs_window_system],
    "outputs": [pytest.mark.slow],
    "refusals": [pytest.mark.slow, needs_servo],
    "sites": [pytest.mark.slow],
    "withdrawals": [pytest.mark.slow],
}
LABS = ("sites", "withdrawals")
"""Golden files of commands on the studies of three labs."""
LONG = {"x5000": "x" * 5000, "9999": "9" * 6000}
"""Words that stand for long ones."""
FILES = {
    "bad.toml": "format = 2\n[study]\nname = 3\n",
    "liquids.toml": "format = 2\n[liquids.tar]\ndensity_kg_m3 = 1153\n",
    "half.toml": 'format = 2\n[liquids.tar]\ndensity_kg_m3 = 1153\n[study]\nname = "half"\n',
    "motion.csv": "t_s,x_m,y_m,z_m\n" + "".join(f"{k / 1000},{k / 5000},0,{k * k / 1e6}\n" for k in range(50)),
    "far.csv": "t_s,x_m,y_m,z_m\n0,0,0,0\n0.001,1e308,0,0\n0.002,-1e308,0,0\n",
    "fast.csv": "t_s,x_m,y_m,z_m,vx_mps,vy_mps,vz_mps\n0,0,0,0,0,0,0\n0.001,0,0,0,1e308,1e308,0\n",
    "zero.csv": "t_s,x_m,y_m,z_m\n0,0,0,0\n0.001,0,zero,0\n",
}


def make_labs(folder: Path) -> None:
    """Hold the same study in three labs, each with its own key."""
    for seed, site in enumerate("ABC", start=1):
        rehearse_answers("demo", participants=2, seed=seed, results=folder / site, features=made_up("demo"))


@pytest.fixture
def workspace(
    request: pytest.FixtureRequest,
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    monkeypatch: pytest.MonkeyPatch,
) -> Path:
    """A workspace with a study of two people, its copy, and files that are no protocols."""

    def make(folder: Path) -> None:
        rehearse_answers("demo", participants=2, seed=7, results=folder / "demo", features=made_up("demo"))

    for name in ("demo", "copied"):
        shutil.copytree(once(tmp_path_factory, "cli-demo", make) / "demo", tmp_path / "results" / name)
    for name, text in FILES.items():
        (tmp_path / name).write_text(text, encoding="utf-8", newline="\n")
    if request.node.callspec.id in LABS:
        shutil.copytree(once(tmp_path_factory, "cli-labs", make_labs), tmp_path / "labs")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    monkeypatch.setenv("COLUMNS", "100")
    return tmp_path


def without_repeats(lines: list[str]) -> Iterator[str]:
    """Yield commands, codes and files, and each distinct printed line with # for numbers."""
    lines_seen = set[str]()
    for line in lines:
        text = masked(line) if line.startswith(("| ", "! ")) else line
        if not line.startswith(("| ", "! ")) or text not in lines_seen:
            lines_seen.add(text)
            yield text


@pytest.mark.parametrize(
    "golden", [pytest.param(path, marks=LATER.get(path.stem, []), id=path.stem) for path in GOLDEN]
)
def test_commands(golden: Path, workspace: Path, capsys: Any, monkeypatch: Any, pytestconfig: pytest.Config) -> None:
    def files() -> set[str]:
        paths = (path.relative_to(workspace) for path in workspace.rglob("*") if path.is_file())
        return {str(path) for path in paths}

    @contextmanager
    def progress(_otherwise: Any = None) -> Iterator[Any]:
        yield lambda what, share=None: sys.stderr.write(f"… {what}{'' if share is None else f' {share:.2f}'}\n")

    for module in ("data", "model"):
        monkeypatch.setattr(f"study_app.cli.{module}.progress", progress)
    changed, lines, before = Files(workspace), list[str](), files()
    for line in (line for line in golden.read_text("utf-8").splitlines() if line.startswith(("$ ", "@ "))):
        if line.startswith("@ "):
            printed = value_of(line[2:], {name: getattr(changed, name) for name in dir(changed)})
            lines += [line, *(f"| {line}" for line in printed or ())]
            before = files()
            continue
        words = shlex.split(line[2:])
        for short, long in LONG.items():
            words = [word.replace(short, long) for word in words]
        monkeypatch.setattr("sys.argv", ["liquid-study", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        now = files()
        lines += [line, f"code {ended.value.code}", *(f"| {line}" for line in out.splitlines())]
        lines += [*(f"! {line}" for line in err.splitlines()), *(f"+ {line}" for line in sorted(now - before))]
        lines += [f"- {file}" for file in sorted(before - now)]
        before = now
    lines = [line.replace(str(workspace), "FOLDER").replace("python -m pytest.", "") for line in lines]
    compare(golden, without_repeats(lines), pytestconfig, mask=CHANGING)
