"""Progress is for terminals: elsewhere a command prints only what its callers read."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from study_app.cli import commands

PROGRAM = textwrap.dedent(
    """
    import sys
    from study_app.cli.options import progress
    with progress(*([print] if "plainly" in sys.argv else [])) as show:
        show("counting [1]")
        show("counting [2]", 0.5)
        print("warning", file=sys.stderr)
    print("result")
    """
)
ROOT = Path(__file__).parents[2]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "out"),
    [((), "result\n"), (("plainly",), "counting [1]\ncounting [2]\nresult\n")],
    ids=["nothing", "lines"],
)
def test_progress_is_not_printed_without_a_terminal(words: tuple[str, ...], out: str) -> None:
    process = subprocess.run(
        [sys.executable, "-c", PROGRAM, *words], capture_output=True, text=True, cwd=ROOT, check=True
    )
    assert (process.stdout, process.stderr) == (out, "warning\n")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="pseudo-terminals are POSIX's")
def test_a_terminal_shows_progress_and_standard_output_stays_clean() -> None:
    ours, theirs = os.openpty()
    try:
        process = subprocess.run(
            [sys.executable, "-c", PROGRAM],
            stdout=subprocess.PIPE,
            stderr=theirs,
            text=True,
            cwd=ROOT,
            check=True,
            env=os.environ | {"TERM": "xterm", "COLUMNS": "80"},
        )
        terminal_text = os.read(ours, 65536).decode()
    finally:
        os.close(ours)
        os.close(theirs)
    assert process.stdout == "result\n"
    assert "counting [2]" in terminal_text
    assert "warning" in terminal_text


def test_validation_prints_each_finished_part_and_its_progress_every_20_s(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now_s=0.0, perf_counter=lambda: clock.now_s)

    def validated(known, studies, seeds, _executor, progress, say):  # type: ignore[no-untyped-def]
        call = (known[0][1].name, studies, seeds)
        for clock.now_s, tell in ((1, progress), (3, progress), (5, say), (6, say), (20.9, progress), (21, progress)):
            tell(str(call))
        return []

    monkeypatch.setattr("study_app.cli.evidence.time", clock)
    monkeypatch.setattr("study_app.evidence.thresholds.validate_known_values", validated)
    words = ["validate", "viscosityjnd", "--studies", "11", "--seed", "3", "--seed", "5", "--workers", "1"]
    result = CliRunner().invoke(commands, words, catch_exceptions=False)
    assert result.stderr.splitlines() == [f"{at_s} s: ('viscosityjnd', 11, (3, 5))" for at_s in (1, 5, 6, 21)]
    assert result.stdout.startswith("11 studies for each protocol and seed (3, 5), in 21 s, ")


def test_validating_the_report_prints_the_studies_every_20_s_and_each_continued_rate(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = SimpleNamespace(now_s=0.0, perf_counter=lambda: clock.now_s)
    batches = (3, False), (21, True), (22, True), (40, False), (43, False)

    def measured(simulation, studies, _executor, *, seed, progress):  # type: ignore[no-untyped-def]
        for number, (clock.now_s, continued) in enumerate(batches, start=1):
            if continued:
                progress(f"{simulation}, {studies} studies, seed {seed}")
            yield 10 * number, ()

    monkeypatch.setattr("study_app.cli.evidence.time", clock)
    monkeypatch.setattr("study_app.session.simulated.rehearsal.condition_features", lambda _, *, seed: f"felt {seed}")
    monkeypatch.setattr(
        "study_app.analysis.planning.simulated_studies.plan", lambda of, study_text: f"{of.study.name} {study_text}"
    )
    monkeypatch.setattr("study_app.evidence.report_rates.measure_report_rates", measured)
    words = ["validate-report", "--studies", "17", "--seed", "3", "--workers", "1"]
    result = CliRunner().invoke(commands, words, catch_exceptions=False)
    continued = "rek2024 felt 3, 17 studies, seed 3"
    messages = [
        (0, "rehearsing every condition"),
        (21, continued),
        (21, "20 studies"),
        (22, continued),
        (43, "50 studies"),
    ]
    assert result.stderr.splitlines() == [f"{at_s} s: {text}" for at_s, text in messages]
    assert result.stdout.startswith("50 studies in 43 s\n")
    assert "no rate was computed" in result.stdout
