"""The zip for whoever helps says what failed and where, and nothing of a study."""

import json
import logging
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app import cli
from study_app.errors import DeviceLost, StoreError, StudyError
from study_app.program_log import DEVICE_FAILED, last_error, log_file, read_log, start_log
from study_app.store import workstation
from study_app.store.support import write_support_archive
from study_app.store.workstation import DeviceBench, MachineSettings
from study_app.workspace import WORKSPACE_VARIABLE

ID, ANSWER, DENSITY, NONCE, INITIALS = "P9047", "responded6of7", "1013.7", "c0ffee5eed", "ZQX"
CAMERA = "rtsp://camerist:se@cr/3t@192.168.0.77/live?key=se@cr"
PLANTED = (ID, ANSWER, DENSITY, NONCE, INITIALS, "sub-", "tester-home", "camerist", "se@cr", "192.168.0.77")
log = logging.getLogger("study_app.tests.support")


@pytest.fixture
def logged() -> Iterator[logging.Logger]:
    """The program's logger, written to the file of this test's user folder, and as it was afterwards."""
    logger = logging.getLogger("study_app")
    before, level = list(logger.handlers), logger.level
    logger.handlers.clear()  # a command that another test ran keeps its log there
    start_log()
    yield logger
    for handler in logger.handlers:
        handler.close()
    logger.handlers[:] = before
    logger.setLevel(level)


def members(path: Path) -> dict[str, str]:
    with zipfile.ZipFile(path) as packed:
        return {name: packed.read(name).decode() for name in packed.namelist()}


def fails() -> None:
    density = float(DENSITY)
    raise ValueError(f"{ID} gave {ANSWER} in a liquid of {density} kg/m³ under {NONCE}")


def plant(caplog: pytest.LogCaptureFixture) -> None:
    """Log messages of a failing session that contain ids, answers, values and folders."""
    try:
        fails()
    except ValueError as error:
        log.exception("the session failed: %s", error)  # noqa: TRY401 - as the program does
        log.exception("the panel %r failed: %d times", ID, 6)
    log.warning("the session waits: %s", StoreError(f"/home/tester-home/results/data/sub-{ID}/journal.jsonl: no space"))
    log.warning("%(answer)s of %(who)s", {"answer": ANSWER, "who": ID})
    log.warning(StudyError(f"{ID} has {DENSITY}"))  # an object in place of words
    caplog.clear()


def test_the_support_file_contains_no_study_data(
    logged: logging.Logger, tmp_path: Path, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(WORKSPACE_VARIABLE)
    results = tmp_path / "tester-home" / "results"
    session = results / "rek2024" / "data" / f"sub-{ID}" / "ses-01"
    session.mkdir(parents=True)
    (results / "rek2024" / "blinding").mkdir()
    (results / "rek2024" / "blinding" / "key.sealed").write_text(NONCE, encoding="utf-8", newline="\n")
    (session / "journal.jsonl").write_text(
        f'{{"participant": "{ID}", "value": "{ANSWER}"}}\n', encoding="utf-8", newline="\n"
    )
    for number in (2, 3, 4, 5):
        path = session.with_name(f"ses-0{number}") / "crash.txt"
        path.parent.mkdir()
        path.write_text(f'  File "/x/study_app/a.py", line {number} in b\n', encoding="utf-8", newline="\n")
        os.utime(path, (1000 * number, 1000 * number))
    (session / "crash.txt").write_text(
        "Fatal Python error: Segmentation fault\n\nCurrent thread 0x00007f (most recent call first):\n"
        f'  File "/opt/tester-home/study_app/app/session/bridge.py", line 12 in start\n{ID} {DENSITY}\n',
        encoding="utf-8",
        newline="\n",
    )
    axes = (1.0, 1.0, 1.0)
    measured = dict.fromkeys(("mass_kg", "damping_nspm", "friction_n", "delay_ms", "stable_nspm"), axes)
    bench = DeviceBench(name="falcon", measured="2026-11-01", report="/x/tester-home/bench.md", **measured)
    workstation.save_settings(
        MachineSettings(
            workspace=str(results.parent),
            operator=INITIALS,
            firmware="/x/tester-home/falcon.bin",
            recent=("/x/tester-home/own.toml",),
            camera=CAMERA,
            benches=(bench,),
            proofs="/x/tester-home/proofs",
            stamps="https://camerist:se@cr/3t@stamps.example.org",
            stamp_root="/x/tester-home/root.pem",
        )
    )
    plant(caplog)
    monkeypatch.setenv("HOME", str(results.parent))
    monkeypatch.setenv("USERPROFILE", str(results.parent))
    write_support_archive(tmp_path / "help.zip", f"1  FOUND  no reply, see {results / 'bench.md'}\n")
    content = members(tmp_path / "help.zip")
    everything = "\n".join((*content, *content.values()))
    assert [word for word in PLANTED if word in everything] == []
    assert set(content) == {
        *("README.txt", "versions.json", "settings.json", "log.txt", "last-error.txt", "diagnosis.txt"),
        *(f"crash-{number}.txt" for number in (1, 2, 3)),
    }
    assert "tests/store/test_support.py" not in everything  # outside the package: the file's name alone
    assert "the session failed: ValueError" in content["log.txt"]
    assert "the panel … failed: … times" in content["last-error.txt"]
    assert "test_support.py:" in content["last-error.txt"]
    assert "in fails" in content["last-error.txt"]
    assert content["diagnosis.txt"] == f"1  FOUND  no reply, see {Path('~/results/bench.md')}\n"
    assert '"study_app/app/session/bridge.py"' in content["crash-1.txt"]
    older = [content[f"crash-{number}.txt"] for number in (2, 3)]
    assert older == [f'  File "study_app/a.py", line {number} in b' for number in (5, 4)]
    settings = json.loads(content["settings.json"])
    names = ("operator", "workspace", "firmware", "recent", "camera", "proofs", "stamps", "stamp_root")
    assert ({settings[name] for name in names}, settings["device"], "problem" in settings) == ({True}, "mouse", False)
    assert settings["benches"][0]["mass_kg"] == list(axes)
    assert json.loads(content["versions.json"]).keys() >= {"liquid-study", "python", "system", "numba", "pyusb"}


def test_the_support_file_contains_the_full_device_failure_as_the_last_error(
    logged: logging.Logger, caplog: pytest.LogCaptureFixture
) -> None:
    log.error("a bug")
    log.info(DEVICE_FAILED, DeviceLost("the device 'falcon' stopped responding"))
    log.info("the device was reconnected")
    caplog.clear()
    assert last_error(read_log()).endswith("the device failed: the device 'falcon' stopped responding")


@pytest.mark.slow
def test_the_log_is_kept_within_bounds_and_one_that_cannot_be_written_disturbs_nobody(
    logged: logging.Logger, capfd: pytest.CaptureFixture[str]
) -> None:
    for _ in range(12_000):
        log.info("the same words, again and again, until the file is as large as it may be")
    files = sorted(log_file().parent.glob("log.txt*"))
    assert [path.name for path in files] == ["log.txt", "log.txt.1", "log.txt.2"]
    assert sum(path.stat().st_size for path in files) < 800_000
    for path in files:
        path.unlink()
    log_file().mkdir()
    for handler in logged.handlers:
        handler.close()
    log.info("nowhere to go")
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.slow
def test_the_doctor_writes_one(tmp_path: Path) -> None:
    pytest.importorskip("numba")
    words = ["devices", "doctor", "--device", "falcon-emulated", "--fault", "unplugged", "--to"]
    result = CliRunner().invoke(cli.commands, [*words, str(tmp_path / "a.zip")])
    assert result.exit_code == 3, result.output
    assert f"Written: {tmp_path / 'a.zip'}" in result.output
    assert "FAULT" in members(tmp_path / "a.zip")["diagnosis.txt"]
