"""Commands on results, killed at any moment: no file is partial, and the next run ends as if undisturbed."""

import signal
from pathlib import Path
from typing import Any

import pytest

from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.faults.support import short
from tests.faults.support.command_killer import COMMANDS
from tests.faults.support.killer_runs import outcomes_of
from tests.platforms import needs_fork

pytestmark = [pytest.mark.nightly, pytest.mark.slow, needs_servo, needs_fork]


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    folder = tmp_path_factory.mktemp("commands")
    return outcomes_of("command_killer", short.write(folder), folder, 1)


def stable_files(files: dict[str, str]) -> dict[str, str]:
    """Return the files that are neither partly written nor contain times."""
    told_when = {"rebuilt.txt", "checksums.sha256", "reveals.jsonl"}
    return {
        path: held
        for path, held in files.items()
        if not Path(path).name.startswith(".") and Path(path).name not in told_when
    }


@pytest.mark.parametrize("command", COMMANDS)
def test_every_file_is_as_before_or_as_after_and_the_next_run_finishes_them(
    outcomes: list[dict[str, Any]], command: str
) -> None:
    whole, *killed = (outcome for outcome in outcomes if outcome["command"] == command)
    assert whole["code"] == 0
    assert whole["before"] != whole["left"]
    assert len(killed) == COMMANDS[command][0]
    assert any(outcome["code"] == -signal.SIGKILL for outcome in outcomes)  # some end before they are killed
    for outcome in killed:
        for name, held in stable_files(outcome["held"]).items():
            assert held in (outcome["before"].get(name), whole["left"][name]), (outcome["after_s"], name)
        assert outcome["again"] == 0, outcome["after_s"]
        assert stable_files(outcome["left"]) == stable_files(whole["left"])


@pytest.mark.parametrize("command", ["rebuild", "unblind"])
def test_the_study_is_sound_in_the_end(outcomes: list[dict[str, Any]], command: str) -> None:
    for outcome in outcomes:
        if outcome["command"] == command:
            findings = verify_study(Path(outcome["folder"]))
            assert findings.is_sound, (outcome["after_s"], findings.errors)
