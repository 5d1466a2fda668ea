"""The benchmark that other engines can enter: errors, delays and energies are those that theory or other code gives."""

import ast
import math
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from study_app.evidence.cfd import fits, stored_flows

score = fits.score
SCORE = Path(score.__file__)
NAME = "reversal-honey-207mmps"

STOKES = """
import json, math, sys
for line in sys.stdin:
    if line.startswith("{"):
        ball = json.loads(line)
        print("ready", flush=True)
    else:
        t_s, x_m, v_mps = map(float, line.split())
        print(-3 * math.pi * ball["viscosity_pa_s"] * ball["diameter_m"] * v_mps, flush=True)
"""


def stokes(setup):
    return lambda _t_s, _x_m, v_mps: -3 * math.pi * setup["viscosity_pa_s"] * setup["diameter_m"] * v_mps


def damper(damping_nspm, _setup):
    return lambda _t_s, _x_m, v_mps: -damping_nspm * v_mps


@pytest.fixture
def alone(tmp_path: Path) -> Path:
    """Return a folder with the downloaded scorer and one table."""
    (tmp_path / "held_out").mkdir()
    for name in ("score.py", "SHA256SUMS", f"held_out/{NAME}.csv"):
        shutil.copy(SCORE.parent / name, tmp_path / name)
    (tmp_path / "stokes.py").write_text(STOKES, encoding="utf-8", newline="\n")
    return tmp_path


@pytest.mark.slow
def test_a_program_over_a_pipe_and_a_function_get_the_same_score(alone: Path) -> None:
    (motion,) = score.motions(only=NAME)
    scores, let = score.measure(stokes, [motion])
    expected = score.row("", scores, let)
    words = [sys.executable, "-I", "score.py", sys.executable, "stokes.py"]
    process = subprocess.run(words, cwd=alone, capture_output=True, text=True, check=False, timeout=120)
    assert (process.returncode, process.stderr.splitlines()) == (0, [f"{NAME} ...", "released handles in honey ..."])
    cells = [cell.strip() for cell in process.stdout.splitlines()[-1].split("|")[2:-1]]
    assert cells[:3] + cells[4:] == expected[1:4] + expected[5:]
    assert f"| {NAME} | 2 | no | {scores[0].rms:.1%} | {scores[0].greatest:.1%} |" in process.stdout
    assert let[0].delay == 8


def test_the_scorer_needs_only_numpy() -> None:
    imports = [
        node for node in ast.walk(ast.parse(SCORE.read_text("utf-8"))) if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    named = {getattr(node, "module", None) or node.names[0].name for node in imports}
    assert {name.partition(".")[0] for name in named} - sys.stdlib_module_names == {"numpy"}


@pytest.mark.parametrize(("name", "held_out"), [(NAME, True), ("glycerin-600mmps", False)])
def test_a_law_alone_has_the_error_that_its_fit_reports(name: str, held_out: bool) -> None:
    (motion,) = [it for it in score.motions(only=name) if it.name == name]
    scored = score.score(partial(fits.Tick, "unsteady drag", sent=False), motion)
    (table,) = [
        it for it in (stored_flows.held_out() if held_out else stored_flows.load_tables()) if it.case.name == name
    ]
    judged = fits.evaluate_fit(fits.MODELS[-1], table, {})
    assert motion.fitted is not held_out
    assert scored.rms == pytest.approx(judged.share, rel=1e-6)
    assert scored.greatest == pytest.approx(judged.worst_n / np.abs(table.columns["force_n"]).max(), rel=1e-3)


@pytest.mark.parametrize(
    ("damping_nspm", "delay"),
    [
        # A handle of 50 g is stable while its damping · 1 ms / 50 g < 2 sin(π / (4 delay + 2)): up to 38 and 7 ticks.
        (2.0, 16),  # with 32, it still rings after 0.2 s
        (10.0, 4),
        (-1.0, -1),
    ],
)
def test_the_delay_borne_is_the_one_of_theory(damping_nspm: float, delay: int) -> None:
    release = score.releases(partial(damper, damping_nspm), score.motions(only=NAME)[0])
    assert release.delay == delay
    assert (release.given_j > 1e-3) == (damping_nspm < 0)


def test_a_non_finite_force_during_motion_counts_as_no_tolerated_delay() -> None:
    release = score.releases(
        lambda _setup: lambda t_s, _x_m, v_mps: math.nan if t_s == 0.1 else -v_mps, score.motions(only=NAME)[0]
    )
    assert (release.given_j, release.delay) == (math.inf, -1)


@pytest.mark.slow
def test_the_models_of_the_program_are_scored_with_times_as_multiples_of_the_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (motion,) = score.motions(only=NAME)
    monkeypatch.setattr(score, "motions", lambda: (motion,))
    monkeypatch.setattr(score, "LIQUIDS", ())  # no handles
    _, _, first, *others = fits.score_all().text.splitlines()
    assert (len(others), "| × 1.00 |" in first) == (5, True)
    sent, history, *_ = [float(line.split("×")[1].split("|")[0]) for line in others]
    assert 0.7 < sent < 1.4 < history < 10  # the safety layer is computed for each; sums of history take longest


@pytest.mark.slow
def test_the_safety_layer_tolerates_delays_that_the_law_alone_does_not() -> None:
    motion = score.motions(only=NAME)[0]
    alone, sent = (
        score.releases(partial(fits.Tick, "unsteady drag", sent=sent), motion, (0, 1, 2)) for sent in (False, True)
    )
    assert (alone.delay, sent.delay) == (-1, 2)
    assert sent.given_j < 2e-3
    assert alone.given_j > 1.0


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("print('yes')", "answered 'yes' to a new ball, not 'ready'"),
        ("input(); print('ready'); input(); print('much')", "answered 'much' to a tick, not a number"),
        ("input(); print('ready'); input(); print('nan')", "ended with code 0"),
        (
            STOKES.replace("v_mps)", "math.nan)").replace("* v_mps", "* math.nan"),
            "a force is missing or is not a finite number",
        ),
        ("import sys; sys.exit(7)", "ended with code 7"),
        ("import time; time.sleep(60)", "did not answer within 0.5 s"),
        ("import os, time; os.close(1); time.sleep(60)", "did not answer within 0.5 s"),
        (None, "cannot be started: "),
        ("changed", "is not the published table: its checksum is not in SHA256SUMS"),
        ("no motion", "does not contain a motion with 'water' in its name"),
    ],
)
def test_a_bad_engine_or_table_ends_in_one_line(
    alone: Path, program: str | None, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(score, "ANSWER_S", 0.5)
    monkeypatch.setattr(score, "__file__", str(alone / "score.py"))
    if program == "changed":
        with (alone / "held_out" / f"{NAME}.csv").open("a", encoding="utf-8", newline="\n") as file:
            file.write("99,0,0\n")
    words = ["/nowhere/engine"] if program is None else [sys.executable, "-c", program]
    assert score.main(["--only", "water" if program == "no motion" else NAME, *words]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("score: ")
    assert last.endswith(said) or said in last


def test_a_function_by_its_name(
    alone: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(score, "DELAYS", (0,))
    monkeypatch.syspath_prepend(alone)
    (alone / "own_engine.py").write_text(
        "def none(setup):\n    return lambda *tick: 0.0\n", encoding="utf-8", newline="\n"
    )
    assert score.main(["--function", "own_engine:none", "--only", NAME]) == 0
    assert "| 100.0% | 100.0% |" in capsys.readouterr().out
    assert score.main(["--function", "own_engine:nothing"]) == 2
