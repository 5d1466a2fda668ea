"""The thesis' study rehearsed on the scripted hand and on another device, for tests that compare the two."""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet
import pytest

from study_app.devices import scripted
from study_app.devices.simulated.hand_commands import HandOrders
from study_app.session.simulated import rehearsal
from study_app.store.blinded.unblinding import unblind
from study_app.store.folders import StudyFolder

STUDY = "rek2024"
POSITION = [f"position_{axis}_m" for axis in "xyz"]
MAY_DIFFER = {
    "device",
    "answered_at",
    "trial_started_at",
    "session_started_at",
    "session_ended_at",
    # what encoders of another count, or a position of another tick, say of the same motion
    "response",
    "path_length_m",
    "mean_speed_mps",
    "force_mean_n",
    "withheld_share",
    "loop_delay_ticks",
    "force_peak_n",
    "limiter_slope",
    "limiter_energy",
    "limiter_norm",
    "limiter_slew",
}
"""Columns of trials and responses that need not be equal on two devices."""


def tie_hand(patch: pytest.MonkeyPatch) -> None:
    """Let no force move the simulated hand off its path at the handle."""
    patch.setattr(scripted, "STIFFNESS_NPM", 1e6)
    patch.setattr(scripted, "DAMPING_NSPM", 2e3)


def rehearse_on_both(
    factory: pytest.TempPathFactory, device: str, *, exact: bool = True, follow: Any = HandOrders.follow
) -> list[StudyFolder]:
    """Return the study on the scripted hand and on a device, unblinded: one seed, a tied hand.

    Parameters
    ----------
    exact : the scripted hand's encoders are exact: its recordings hold the path itself
    follow : how the hand takes a path, in place of ``HandOrders.follow``
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIQUID_STUDY_CONFIG", str(factory.mktemp("settings")))
        tie_hand(patch)
        patch.setattr(HandOrders, "follow", follow)
        if exact:
            patch.setitem(scripted.ScriptedDevice.__init__.__kwdefaults__, "quantum_m", 0.0)
        folders = []
        for name in ("scripted", device):
            folder = factory.mktemp("results") / name
            rehearsal.rehearse(STUDY, participants=1, seed=3, device=name, results=folder)
            unblind(folder, "AB", "to compare what was measured")
            folders.append(StudyFolder(folder))
    return folders


def rows_of(file: Path) -> list[dict[str, str]]:
    with file.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def table(folder: StudyFolder, name: str) -> list[dict[str, str]]:
    """Return the rows of a table of the study's only session."""
    return rows_of(folder.sessions()[0].table(STUDY, name))


def recordings_of(folders: list[StudyFolder]) -> Iterator[tuple[Any, Any]]:
    """Yield both recordings of each of the twelve trials, as data frames."""
    rows = table(folders[0], "trials")
    assert len(rows) == 12
    for row in rows:
        files = (folder.sessions()[0].path / row["recording"] for folder in folders)
        one, other = (pyarrow.parquet.read_table(file).to_pandas() for file in files)
        yield one, other


def assert_every_trial_is_valid_and_simulated(folder: StudyFolder) -> None:
    trials = table(folder, "trials")
    assert {(row["valid"], row["simulated"], row["outcome"]) for row in trials} == {("true", "true", "complete")}


def assert_mean_forces_agree(folders: list[StudyFolder]) -> None:
    """Trial by trial within 5 % or 0.05 N."""
    for row, other in zip(*(table(folder, "trials") for folder in folders), strict=True):
        force_n = float(row["force_mean_n"])
        assert float(other["force_mean_n"]) == pytest.approx(force_n, abs=max(0.05 * force_n, 0.05))
