"""The commands: what they print, and the one line and exit code a user gets for bad input."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands, main
from study_app.protocol.source.files import source_bytes
from study_app.session import replay
from study_app.store.workstation import MachineSettings, save_settings
from tests.compiled import needs_servo

pytestmark = pytest.mark.slow

RELEASED = Path(__file__).parents[1] / "store" / "releases" / "0.2" / "demo"
Finished = subprocess.CompletedProcess[str]
Run = Callable[..., Finished]


@pytest.fixture
def liquid_study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Return a function that runs a command in this process and an empty folder: a start takes half a second."""
    monkeypatch.chdir(tmp_path)

    def run(*words: str) -> Finished:
        monkeypatch.setattr("sys.argv", ["liquid-study", *words])
        with pytest.raises(SystemExit) as ended:
            main()
        assert isinstance(ended.value.code, int)
        return Finished(words, ended.value.code, *capsys.readouterr())

    return run


def test_help_loads_neither_qt_nor_the_compiler_nor_multiprocessing(tmp_path: Path) -> None:
    program = (
        "import sys; sys.argv=['liquid-study','--help']\n"
        "from study_app.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "avoided = {'PySide6', 'numba', 'pandas', 'matplotlib', 'numpy', 'pydantic', 'multiprocessing'}\n"
        "print(sorted(avoided & set(sys.modules)))"
    )
    finished = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert finished.stdout.splitlines()[-1] == "[]"


def test_a_command_computes_in_one_thread_unless_the_user_says_otherwise(
    liquid_study: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    liquid_study("--version")
    assert [os.environ[name] for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")] == ["1", "3"]


@pytest.mark.parametrize(("device", "warned"), [("mouse", 1), ("falcon", 0), ("", 0)])
def test_check_warns_if_the_configured_device_does_not_produce_force(
    liquid_study: Run, device: str, warned: int
) -> None:
    if device:
        save_settings(MachineSettings(device=device))
    assert liquid_study("check", "forcedelay").stdout.count("Mouse does not produce force") == warned


def test_check_notes_how_many_texts_are_still_to_translate(tmp_path: Path, liquid_study: Run) -> None:
    source = source_bytes("rek2024").decode()
    assert liquid_study("check", "rek2024").stdout.count("Note:") == 0
    (tmp_path / "own.toml").write_text(
        source.replace('nl = "Welkom"', 'nl = "Welcome"'), encoding="utf-8", newline="\n"
    )
    noted = liquid_study("check", "own.toml")
    assert noted.returncode == 0
    note = "study.languages: 1 text is still in English and must be translated into Dutch: pages.consent.title"
    assert noted.stdout.endswith(f"\nNote: {note}.\n")


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs a pseudo-terminal")
def test_a_character_missing_from_the_console_encoding_does_not_stop_a_command(tmp_path: Path) -> None:
    text = source_bytes("demo").decode().replace('title = "A first look"', 'title = "Łódź"', 1)
    (tmp_path / "lodz.toml").write_text(text, encoding="utf-8", newline="\n")
    process = subprocess.run(
        [sys.executable, "-m", "study_app", "check", "lodz.toml"],
        cwd=tmp_path,
        capture_output=True,
        check=False,
        env={**os.environ, "PYTHONIOENCODING": "cp1252"},
    )
    assert (process.returncode, process.stderr) == (0, b"")
    assert process.stdout.startswith("Łódź (demo, version ".encode()), "a pipe is UTF-8, also where the system's is not"
    reader, terminal = os.openpty()
    command = [sys.executable, "-m", "study_app", "check", "lodz.toml"]
    subprocess.run(command, cwd=tmp_path, stdout=terminal, check=True, env={**os.environ, "PYTHONIOENCODING": "cp1252"})
    assert os.read(reader, 100).startswith(b"\\u0141\xf3d\\u017a (demo, version ")


def test_a_replay_without_comparisons_does_not_claim_equality(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is printed of a replay's findings, and the exit code."""

    def replayed(count: int, **told: Any) -> tuple[int, str]:
        some = {"recordings": count, "seconds": count, "lasted_s": 10.0 * count, "computed_s": 0.1 * count}
        none: dict[str, Any] = {"took_s": 1.5, "differences": (), "missing": (), "uncompared": ()}
        replay_result = replay.Replayed(**(some | none | told))
        monkeypatch.setattr(replay, "replay", lambda _: replay_result)
        result = CliRunner().invoke(commands, ["replay", "ses-01"])
        return result.exit_code, result.output

    nothing = "no forces could be compared, so the session has not been verified\n"
    assert replayed(0) == (3, f"no recordings were stored for this session\n{nothing}")
    assert replayed(0, uncompared=("trial 1 is lost",)) == (3, f"trial 1 is lost\n{nothing}")
    same = "1 recording, 10.0 s, recomputed at 100 times real-time speed (1.5 s in all): "
    assert replayed(1) == (0, f"{same}all compared forces are equal\n")
    assert replayed(1, seconds=0, uncompared=("a gap",)) == (3, f"a gap\n{same}{nothing}")
    same = same.replace("1 recording, 10.0", "2 recordings, 20.0")
    assert replayed(2, uncompared=("a gap",)) == (0, f"a gap\n{same}all compared forces are equal\n")
    assert replayed(2, missing=("a file",)) == (3, f"a file\n{same}all compared forces are equal\n")
    differ = f"trial 1 differs\ntrial 2 has a gap\n{same}forces differ\n"
    assert replayed(2, differences=("trial 1 differs",), uncompared=("trial 2 has a gap",)) == (3, differ)


def test_interrupting_a_command_ends_it_with_130(liquid_study: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(**_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(commands.commands["check"], "callback", interrupted)
    finished = liquid_study("check", "demo")
    assert (finished.returncode, finished.stdout, finished.stderr.strip()) == (130, "", "")


def said(*words: str, code: int = 0) -> str:
    result = CliRunner().invoke(commands, words)
    assert result.exit_code == code, result.output
    return result.output


def test_help_lists_every_command_once_under_its_heading_with_its_whole_sentence() -> None:
    parts = dict(re.findall(r"\n(\w+):\n((?:  .+\n)+)", said("--help")))
    assert [*parts] == ["Options", "Study", "Data", "Model", "Evidence", "Devices", "Help"]
    listed = "".join(part for heading, part in parts.items() if heading != "Options")
    assert sorted(re.findall(r"^  (\S+)", listed, re.MULTILINE)) == sorted(commands.commands)
    assert "..." not in listed, "a command's first sentence is cut off"


@pytest.fixture
def released(tmp_path: Path, liquid_study: Run) -> Path:
    """Results of version 0.2, upgraded."""
    study = shutil.copytree(RELEASED, tmp_path / "demo")
    assert liquid_study("upgrade", str(study)).returncode == 0
    return study


def test_a_second_upgrade_reports_nothing_to_upgrade(tmp_path: Path, liquid_study: Run) -> None:
    study = shutil.copytree(RELEASED, tmp_path / "demo")
    first, second = (liquid_study("upgrade", str(study)) for _ in range(2))
    files = [Path(line) for line in first.stdout.splitlines()]
    assert files
    assert all(file.is_file() and file.is_relative_to(study) for file in files)
    assert (second.returncode, second.stdout) == (0, f"{study}: nothing to upgrade\n")


@pytest.mark.parametrize(("command", "only_moving"), [("run", False), ("rehearse", True)])
def test_the_help_of_a_command_lists_the_devices_that_it_accepts(
    liquid_study: Run, command: str, only_moving: bool
) -> None:
    help_text = " ".join(liquid_study(command, "--help").stdout.split())
    (device_names,) = re.findall(r"--device NAME (.*?); see liquid-study devices\.", help_text)
    assert ("scripted" in device_names, "falcon:SERIAL" in device_names) == (True, not only_moving)


def test_verify_prints_advice_on_sharing_last(liquid_study: Run, released: Path) -> None:
    description_file = released / "dataset_description.json"
    description = json.loads(description_file.read_text(encoding="utf-8"))
    description["variableMeasured"][0]["description"] = "The participant, in the words of an earlier version."
    description_file.write_text(json.dumps(description), encoding="utf-8", newline="\n")
    unfinished, shared, verdict = liquid_study("verify", str(released)).stdout.splitlines()
    assert unfinished.startswith("warning: ")
    assert shared.startswith("before sharing: dataset_description.json: ")
    assert verdict == "2 sessions: sound"


def test_names_from_elsewhere_do_not_control_the_terminal(liquid_study: Run, released: Path) -> None:
    (released / "data/sub-P001/ses-01/\u202egnp.exe").touch()
    output = liquid_study("verify", str(released)).stdout + liquid_study("verify", "no\u202estudy").stderr
    assert output.count("\\u202e") == 2
    assert "\u202e" not in output


@needs_servo
def test_a_blinded_report_states_once_how_to_unblind_and_which_limits_were_broken(
    tmp_path: Path, liquid_study: Run
) -> None:
    source = source_bytes("demo").decode()
    assert "frame_gap_ms = 250" in source
    (tmp_path / "own.toml").write_text(
        source.replace("frame_gap_ms = 250", "frame_gap_ms = 2"), encoding="utf-8", newline="\n"
    )
    liquid_study("rehearse", "own.toml", "--no-recordings", "--results", "results")
    liquid_study("report", "results", "--to", "report")
    page = (tmp_path / "report" / "report.html").read_text(encoding="utf-8")
    assert re.search(r"4 of 4 trials exceeded a limit: [^.]*the trial at most 2 ms \(four trials\)", page)
    assert page.count("liquid-study unblind RESULTS --by NAME --reason TEXT") == 1


@pytest.mark.parametrize("output", ["None", "open('/dev/full', 'w')"], ids=["no output", "a full disk"])
def test_a_program_ended_by_a_signal_ends_at_once_without_an_output(output: str) -> None:
    program = f"""
import sys
import PySide6.QtCore
from study_app import app, cli
sys.argv = ["liquid-study"]
app.run_home_window = lambda: print("ended") or 130
sys.stdout = {output}
cli.main()
"""
    finished = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (finished.returncode, finished.stderr) == (130, "")
