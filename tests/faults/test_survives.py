"""A session in real windows on one small screen survives its device, a panel and its recorder."""

import csv
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from study_app.session.replay import replay
from study_app.store.files.folders import StudyFolder
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.end_to_end.real_windows import COMPILED_S, needs_display, virtual_display

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [pytest.mark.slow, needs_servo, needs_display, pytest.mark.xvfb, pytest.mark.timeout(300)]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """Return the report on the session, and its study's folder."""
    folder = tmp_path_factory.mktemp("survives")
    with virtual_display("-screen", "0", "1366x768x24") as display:
        here = {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb", "LIQUID_STUDY_CONFIG": str(folder / "settings")}
        ran = subprocess.run(
            [sys.executable, "-m", "tests.faults.support.survivor", str(folder)],
            cwd=ROOT,
            env=os.environ | here,
            capture_output=True,
            text=True,
            check=False,
            timeout=COMPILED_S,
        )
    assert ran.returncode == 0, ran.stderr
    report = json.loads(ran.stdout)
    assert (report["errors"], report["code"], report["step"]) == ([], 0, "go_on"), ran.stderr
    return report, folder / "results"


def rows(results: Path) -> list[dict[str, str]]:
    (table,) = results.glob("data/sub-P001/ses-01/*_description-trials_data.csv")
    with table.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_an_unplugged_device_is_reconnected_and_its_trial_presented_again(session: tuple[dict[str, Any], Path]) -> None:
    report, results = session
    assert not report["lost"]["force"]
    assert "it is no longer there" in report["lost"]["banner"]
    assert "Plug in the device" in report["lost"]["advice"]
    assert report["lost"]["banner_in_window"]
    assert "device" not in report["lost"]["page"]
    assert "no Falcon is connected" in report["still unplugged"]
    assert not report["button while connecting"]
    assert (report["reconnected"]["force"], report["reconnected"]["held"]) == (False, "force")
    assert not report["resumed by the participant"]
    assert report["force in the next attempt"]
    first, *again = [row for row in rows(results) if row["trial"] == "1"]
    assert (first["outcome"], again[-1]["outcome"]) == ("interrupted", "complete")
    assert int(again[-1]["attempt"]) == 1 + len(again)
    assert first["notes"].startswith("the device failed and was reconnected")
    assert again[0]["notes"].startswith("presented again: the device failed and was reconnected")


def test_failed_panels_are_reported_and_the_session_continues(session: tuple[dict[str, Any], Path]) -> None:
    report, results = session
    assert sorted(said.partition("no such ")[2] for said in report["panels"]) == [
        "colour. The session continues.",
        "curve. The session continues.",
    ]
    assert report["force with failed panels"]
    assert not report["trouble with failed panels"]
    last = [row for row in rows(results) if row["trial"] == "1"][-1]
    assert "part of the operator's window stopped working: ValueError: no such curve" in last["notes"]
    assert "no such colour" in last["notes"]


def test_a_failed_recorder_is_reported_at_once_and_records_the_next_trial(session: tuple[dict[str, Any], Path]) -> None:
    report, results = session
    assert report["page at the loss"] == "TaskPage"
    assert report["recording"].endswith("lost: its thread ended (Ended: pulled).")
    assert any("recorder" in notice for notice in report["notices"])
    assert report["force without a recording"]
    lost, after = [row for row in rows(results) if row["trial"] != "1"][:3], rows(results)[-1]
    (gone,) = [row for row in lost if row["recording_lost"] != "n/a"]
    assert (gone["recording"], gone["recording_lost"]) == ("n/a", "its thread ended (Ended: pulled)")
    assert (after["recording"], after["recording_lost"]) == ("recordings/trial-004.parquet", "n/a")


def test_its_results_are_sound_and_its_forces_are_reproduced(session: tuple[dict[str, Any], Path]) -> None:
    _, results = session
    assert verify_study(results).errors == ()
    (folder,) = StudyFolder(results).sessions()
    again = replay(folder.path)
    assert again.recordings >= 1  # those after a gap, which a stall of the computer leaves, cannot be compared
    assert (again.differences, again.missing) == ((), ())
