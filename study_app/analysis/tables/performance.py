"""How participants moved and what force they felt, by setting: measures of whole trials, and of single reaches.

Measures of trials stand in the trials' tables; those of reaches come out of the recordings, where they were kept. The
first reach of a trial begins wherever the hand was and is left out.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.measures import Array, quartiles
from study_app.analysis.tables.reaches import Reach, Targets, reaches, targets_of
from study_app.analysis.tables.study_tables import Study
from study_app.errors import StoreError
from study_app.haptics.model.layout import LIMITER_NAMES
from study_app.store.recordings import read_samples
from study_app.store.sites.merged import session_in

OF_TRIALS: Final = ("duration_s", "path_m", "force_mean_n", "force_peak_n", "at_limit_percent")
OF_REACHES: Final = ("movement_time_s", "path_mm", "overshoot_mm", "submovements")
DEFINITIONS: Final = {
    "duration_s": "from the trial's beginning to its end",
    "path_m": "length of the hand's path in the trial",
    "force_mean_n": "mean force on the hand in the trial",
    "force_peak_n": "largest force on the hand in the trial",
    "at_limit_percent": "share of the trial's ticks in which the force was cut to the force limit",
}

GLITCH: Final = 1 << LIMITER_NAMES.index("glitch")


@dataclass(frozen=True, slots=True)
class Moved:
    """One measure under one setting: over ``n`` participants, each of whom counts by his or her median."""

    block: str
    code: str
    measure: str
    n: int
    median: float | None
    q1: float | None
    q3: float | None


@dataclass(frozen=True, slots=True)
class Reached:
    """The reaches of one counted trial, the first left out."""

    participant: str
    session: int
    trial: int
    block: str
    code: str
    valid: bool | None
    found: tuple[Reach, ...]


@dataclass(frozen=True, slots=True)
class Performance:
    """All measures. ``reaching`` are the blocks whose task is one of reaching: only there are there reaches.

    ``trials`` of reaching count, of which ``recorded`` have a recording that was read.

    ``unread`` says of the others why, a line each kind. Of ``judged`` trials it is known whether they kept to the
    protocol's limits of timing; ``invalid`` ones did not, and are in the measures all the same.
    """

    moved: tuple[Moved, ...]
    reaching: tuple[str, ...]
    reached: tuple[Reached, ...]
    trials: int
    recorded: int
    judged: int
    invalid: int
    unread: tuple[str, ...]

    def recorded_in(self, block: str) -> bool:
        """Return whether there is any reach of a block."""
        return any(trial.block == block for trial in self.reached)

    def by_participant(self, people: Sequence[str], block: Block, measure: str) -> Array:
        """Return the medians of a measure of reaches (participants, settings), NaN where there is none."""
        values = np.full((len(people), len(block.codes)), np.nan)
        found: dict[tuple[int, int], list[float]] = {}
        for trial in self.reached:
            if trial.block == block.id:
                place = people.index(trial.participant), block.codes.index(trial.code)
                found.setdefault(place, []).extend(getattr(reach, measure) for reach in trial.found)
        for place, numbers in found.items():
            if numbers:
                values[place] = np.median(numbers)
        return values


def performance(study: Study, each: Callable[[int, int], object] = lambda _done, _of: None) -> Performance:
    """Measure the trials that count; ``each`` receives how many recordings of how many were read.

    Raises
    ------
    Exception
        What ``each`` raises ends it.
    """
    rows = study.trials[study.trials["counted"]]
    tasks = {block.id: _targets(study.protocol, block) for block in study.blocks}
    where = tuple(name for name, targets in tasks.items() if targets is not None)
    reaching = rows[rows["block"].isin(where)]
    found: list[Reached] = []
    unread: dict[str, int] = {}
    for number, row in enumerate(reaching.to_dict("records")):
        each(number, len(reaching))
        targets = tasks[str(row["block"])]
        one = _why_not(study.folder, row) if targets is None else _reached(study.folder, row, targets)
        if isinstance(one, str):
            unread[one] = unread.get(one, 0) + 1
        else:
            found.append(one)
    moved = [*_of_trials(study, rows)]
    whole = Performance((), where, tuple(found), 0, 0, 0, 0, ())
    for block in study.blocks:
        if block.id in where and found:
            for measure in OF_REACHES:
                moved += _summarised(block, measure, whole.by_participant(study.people, block, measure))
    return Performance(
        moved=tuple(moved),
        reaching=where,
        reached=tuple(found),
        trials=len(reaching),
        recorded=len(found),
        judged=int(rows["valid"].notna().sum()),
        invalid=int((~rows["valid"].fillna(value=True)).sum()),
        unread=tuple(f"{count} × {reason}" for reason, count in unread.items()),
    )


def _targets(protocol: Mapping[str, Any], block: Block) -> Targets | None:
    """Return the targets of a block's task, None where it has none."""
    named = protocol.get("blocks", {}).get(block.id, {}).get("task")
    task = protocol.get("tasks", {}).get(named, {})
    return targets_of(task) if task.get("kind") == "reach" else None


def _reached(folder: Path, row: Mapping[Any, Any], targets: Targets) -> Reached | str:
    """Return the reaches of a trial, or why they are not known."""
    if reason := _why_not(folder, row):
        return reason
    try:
        samples = read_samples(_file(folder, row))
    except StoreError:
        return "recording is damaged (liquid-study verify says which)"
    if len(samples):
        samples = samples[(samples["scene"] == samples["scene"][-1]) & (samples["limiters"] & GLITCH == 0)]
    if len(samples):
        end_ns = samples["time_ns"][0] + round(float(row["duration_s"]) * 1e9)
        samples = samples[samples["time_ns"] <= end_ns]
    return Reached(
        participant=str(row["participant"]),
        session=int(row["session"]),
        trial=int(row["trial"]),
        block=str(row["block"]),
        code=str(row["code"]),
        valid=None if pd.isna(row["valid"]) else bool(row["valid"]),
        found=reaches(samples["time_ns"], samples["position_m"], targets)[1:],
    )


def _why_not(folder: Path, row: Mapping[Any, Any]) -> str:
    if pd.isna(row["recording"]):
        return "no recording was kept"
    if pd.isna(row["duration_s"]):
        return "the trial has no duration"
    return "" if _file(folder, row).is_file() else "recording is not in the folder"


def _file(folder: Path, row: Mapping[Any, Any]) -> Path:
    return session_in(folder, str(row["participant"]), int(row["session"])).path / str(row["recording"])


def _of_trials(study: Study, rows: pd.DataFrame) -> list[Moved]:
    table = pd.DataFrame(
        {
            "participant": rows["participant"],
            "block": rows["block"],
            "code": rows["code"],
            "duration_s": rows["duration_s"],
            "path_m": rows["path_length_m"],
            "force_mean_n": rows["force_mean_n"],
            "force_peak_n": rows["force_peak_n"],
            "at_limit_percent": 100 * rows["limiter_norm"].astype("Float64") / rows["ticks"].replace(0, pd.NA),
        }
    )
    medians = table.groupby(["block", "code", "participant"])[list(OF_TRIALS)].median().reset_index()
    found = []
    for block in study.blocks:
        here = medians[(medians["block"] == block.id) & medians["code"].isin(block.codes)]
        for measure in OF_TRIALS:
            wide = here.pivot_table(index="participant", columns="code", values=measure, dropna=False)
            values = wide.reindex(columns=list(block.codes)).to_numpy(dtype=float, na_value=np.nan)
            found += _summarised(block, measure, values)
    return found


def _summarised(block: Block, measure: str, values: Array) -> list[Moved]:
    """Return a measure's quartiles over participants (participants, settings) for each setting."""
    found = []
    for code, column in zip(block.codes, values.T, strict=True):
        n = int((~np.isnan(column)).sum())
        q1, median, q3 = quartiles(column) if n else (None, None, None)
        found.append(Moved(block.id, code, measure, n, median, q1, q3))
    return found
