"""Tracks of blocks with a design: one table of the last attempt at each trial with its stimuli and answer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

import pandas as pd
from scipy.special import bdtr

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.data.study_tables import Study
from study_app.protocol.model import BELOW_CHANCE_P
from study_app.protocol.trials import DELAY, FORCE_DELAY, Answer, Stimulus, TrackSetting

TRACK: Final = ["participant", "session", "block", "code"]
"""The columns of `tracks` that identify a track."""
_PRESENTATION: Final = ["participant", "session", "trial", "attempt"]
OF_INTERVALS: Final = ("force_mean_n", "mean_speed_mps")
"""The columns of intervals that a trial's row contains for each of its intervals."""
_DELIVERED: Final = tuple(f"{name}_{letter}" for name in ("value", "delay_error_ms") for letter in "CS")
"""Means over the intervals of a trial that present the comparison (C) and over those that present the standard (S)."""
_TYPES: Final = {
    "track": "string",
    "comparison": "Float64",
    "comparison_interval": "Int64",
    "right": "boolean",
    "success": "boolean",
    "analysed": "boolean",
    "level_delivered": "Float64",
}
"""The columns that follow from a trial's arrangement, level and answer, with their types."""
_UNKNOWN: Final = "?"
"""Stands for an interval whose contents are still sealed: its session is damaged, so `unblind` did not change it."""
_READ_COLUMNS: Final = (
    "block",
    "code",
    "index",
    "counted",
    "arrangement",
    "standard",
    "level",
    "response",
    *_DELIVERED,
)


def timed_answers(study: Study) -> pd.DataFrame:
    """Return all answers after trials of levels, with ``response_s``: from the question to the first choice [s]."""
    rows = study.answered
    if not study.levels:
        return rows.iloc[:0].assign(response_s=pd.Series(dtype="Float64"))
    rows = rows[rows["block"].isin([block.id for block in study.levels]).fillna(False)]
    return rows.assign(response_s=(rows["first_choice_s"] - rows["onset_s"]).astype("Float64").round(6))


def tracks(study: Study) -> pd.DataFrame:
    """Return the last attempt at each trial of levels with its presented level; the key must be open.

    ``right`` is whether the answer was correct, ``success`` whether it counts as a success of the psychometric
    function; ``analysed`` is false if the trial is excluded or presents the modulus of a magnitude estimation;
    ``reversal`` is whether an up–down track reversed.
    """
    by_id = {block.id: block for block in study.levels}
    rows = study.trials[study.trials["block"].isin(list(by_id))]
    rows = rows.sort_values("attempt").drop_duplicates(_PRESENTATION[:-1], keep="last").sort_index()
    answers = timed_answers(study)[[*_PRESENTATION, "response", "value", "response_s"]]
    frame = rows.merge(_presentations(study.intervals), on=_PRESENTATION, how="left")
    frame = frame.merge(answers, on=_PRESENTATION, how="left")
    frame["slot"] = frame.groupby(TRACK).cumcount() + 1
    track_rows = [_track_row(by_id[row["block"]], row) for row in frame[list(_READ_COLUMNS)].to_dict("records")]
    frame = frame.drop(columns=list(_DELIVERED))
    frame = frame.join(pd.DataFrame(track_rows, index=frame.index, columns=list(_TYPES)).astype(_TYPES))
    frame = frame.assign(reversal=_reversals(frame, by_id))
    if study.with_below_chance:
        return frame
    decided = {exclusion.what[:2] for exclusion in study.kept if exclusion.rule_or_person == "below_chance"}
    for low in sessions_below_chance(frame, study.levels):
        if (low.participant, low.session) not in decided:
            in_session = (frame["participant"] == low.participant) & (frame["session"] == low.session)
            frame["analysed"] &= ~(in_session & (frame["block"] == low.block)).astype("boolean")
    return frame


@dataclass(frozen=True, slots=True, kw_only=True)
class BelowChance:
    """A session with fewer correct answers in a block than expected by chance; ``p`` is one-sided."""

    participant: str
    session: int
    block: str
    right: int
    n: int
    p: float


def sessions_below_chance(frame: pd.DataFrame, blocks: Iterable[LevelBlock]) -> Iterator[BelowChance]:
    """Yield the sessions with answers below chance (binomial p below `BELOW_CHANCE_P`).

    Designs without a guess rate have no chance level, because a bias reduces the proportion of correct answers.
    """
    by_id = {block.id: block for block in blocks}
    answered = frame[frame["analysed"].fillna(False) & frame["right"].notna()]
    groups: Iterable[tuple[Any, pd.DataFrame]] = answered.groupby(["participant", "session", "block"])
    for (participant, session, block), rows in groups:
        if (chance := by_id[block].design.guess_rate) is None:
            continue
        right, n = int(rows["right"].sum()), len(rows)
        p = float(bdtr(right, n, chance))
        if p < BELOW_CHANCE_P:
            yield BelowChance(
                participant=str(participant), session=int(session), block=str(block), right=right, n=n, p=p
            )


def setting_of(block: LevelBlock, track: str) -> TrackSetting | None:
    """Return the setting of the method that chose the levels of a track ("8/1"); None if conditions are compared."""
    number = track.rpartition("/")[2]
    return None if block.stimulus is None else TrackSetting(block.stimulus, block.design, int(number))


def answers_of(rows: pd.DataFrame) -> list[Answer]:
    """Return the answers of one track as its method received them, including excluded ones."""
    received = _rows_of_method(rows)
    return list(zip(received["level"].astype(float), received["success"].astype(bool), strict=True))


def _rows_of_method(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows with answers that the track's method received, in order: no catch trials or standards alone."""
    compared = rows["success"].notna() & rows["level"].notna() & rows["arrangement"].str.contains("C").fillna(False)
    return rows[compared & ~rows["catch"].fillna(False).astype(bool)].sort_values("trial")


def _reversals(frame: pd.DataFrame, blocks: Mapping[str, LevelBlock]) -> pd.Series[Any]:
    """Return whether each trial reversed its track; missing if the method has no steps."""
    reversal = pd.Series(pd.NA, index=frame.index, dtype="boolean")
    for _, rows in frame.groupby(TRACK, sort=False):
        block = blocks[rows["block"].iloc[0]]
        setting = setting_of(block, rows["track"].iloc[0])
        if setting is None or block.method is None or block.method.target_percent is None:
            continue
        reversed_at, indices = block.method.reversals(setting, answers_of(rows)), _rows_of_method(rows).index
        reversal[indices] = False
        reversal[indices[list(reversed_at)]] = True
    return reversal


def _track_row(block: LevelBlock, row: Mapping[Any, Any]) -> dict[str, Any]:
    track = next(setting.condition for setting in block.settings if setting.code == row["code"])
    values: dict[str, Any] = {**dict.fromkeys(_TYPES, pd.NA), "track": track}
    modulus = block.design.first is not None and int(row["index"]) == 1
    values["analysed"] = bool(row["counted"]) and not modulus
    letters = row["arrangement"]
    if not pd.isna(letters) and _UNKNOWN in letters:
        values["analysed"] = False
        return values
    if pd.isna(letters) or len(letters) < block.design.intervals:  # the trial ended before its last interval
        return values
    if letters.count("C") == 1 and block.design.intervals > 1:
        values["comparison_interval"] = letters.index("C") + 1
    if block.stimulus is not None and not pd.isna(row["level"]):
        standard = None if pd.isna(row["standard"]) else float(row["standard"])
        values["comparison"] = block.stimulus.comparison(standard, float(row["level"]))
        values["level_delivered"] = _level_delivered(block.stimulus, standard, values["comparison"], row)
    if not pd.isna(row["response"]):
        arrangement, answer = block.design.arrangement_of(letters), str(row["response"])
        correct, success = block.design.is_correct(arrangement, answer), block.design.success(arrangement, answer)
        if block.has_correct_answer and correct is not None:
            values["right"] = correct
        values["success"] = pd.NA if success is None else success
    return values


def _level_delivered(stimulus: Stimulus, standard: float | None, comparison: float, row: Mapping[Any, Any]) -> Any:
    """Return the delivered level of the comparison; missing if it was not measured, or not presented.

    For a delay, it is the requested delay plus the difference between the errors of the comparison and the standard.
    """
    delivered, delivered_standard, error_ms, standard_error_ms = (row[name] for name in _DELIVERED)
    if stimulus.vary == DELAY:
        if pd.isna(error_ms):
            return pd.NA
        difference_ms = float(error_ms) - (0.0 if pd.isna(standard_error_ms) else float(standard_error_ms))
        return stimulus.level_between(standard, comparison + difference_ms)
    if pd.isna(delivered):
        return pd.NA
    if stimulus.vary == FORCE_DELAY and standard is not None and not pd.isna(delivered_standard):
        return stimulus.level_between(standard, standard + float(delivered) - float(delivered_standard))
    return stimulus.level_between(
        standard if pd.isna(delivered_standard) else float(delivered_standard), float(delivered)
    )


def _presentations(intervals: pd.DataFrame) -> pd.DataFrame:
    """Return one row per presentation: standard, level, arrangement, and force and speed of each interval."""
    ordered = intervals.sort_values([*_PRESENTATION, "interval"])
    letters = ordered["presented"].map({"comparison": "C", "standard": "S"}).fillna(_UNKNOWN)
    frame = ordered.groupby(_PRESENTATION, sort=False)[["standard", "level", "catch", "setting"]].first()
    presented: dict[Any, str] = {}
    for presentation, letter in zip(zip(*(ordered[name] for name in _PRESENTATION), strict=True), letters, strict=True):
        presented[presentation] = presented.get(presentation, "") + letter
    frame["arrangement"] = pd.Series(presented, dtype="string").reindex(frame.index)
    for name, prefix in (("value_delivered", "value"), ("delay_error_mean_ms", "delay_error_ms")):
        means = ordered.assign(letter=letters).groupby([*_PRESENTATION, "letter"])[name].mean().unstack("letter")
        for letter in "CS":
            frame[f"{prefix}_{letter}"] = means.get(letter, pd.NA)
    for name in OF_INTERVALS:
        by_interval = ordered.pivot(index=_PRESENTATION, columns="interval", values=name)
        frame = frame.join(by_interval.rename(columns={number: f"{name}_{number}" for number in by_interval.columns}))
    return frame.reset_index()
