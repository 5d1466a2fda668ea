"""Tracks of blocks with a design: the last attempt at each trial, with what it presented, as one table."""

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
"""What one track is in the rows of `tracks`."""
_PRESENTATION: Final = ["participant", "session", "trial", "attempt"]
OF_INTERVALS: Final = ("force_mean_n", "mean_speed_mps")
"""What a trial's row repeats of each of its intervals."""
_DELIVERED: Final = tuple(f"{what}_{letter}" for what in ("value", "delay_error_ms") for letter in "CS")
"""Means over the intervals of a trial that presented the comparison, and over those that presented the standard."""
_TYPES: Final = {
    "track": "string",
    "comparison": "Float64",
    "comparison_interval": "Int64",
    "right": "boolean",
    "success": "boolean",
    "analysed": "boolean",
    "level_delivered": "Float64",
}
"""What follows from a trial's arrangement, level and answer."""
_UNKNOWN: Final = "?"
"""Stands for an interval whose contents are still sealed: its session is damaged, so `unblind` did not change it."""
_READ: Final = ("block", "code", "index", "counted", "arrangement", "standard", "level", "response", *_DELIVERED)


def answers_timed(study: Study) -> pd.DataFrame:
    """Return all answers after trials of levels, with ``response_s``: from the question to the first choice [s]."""
    rows = study.answered
    if not study.levels:
        return rows.iloc[:0].assign(response_s=pd.Series(dtype="Float64"))
    rows = rows[rows["block"].isin([block.id for block in study.levels]).fillna(False)]
    return rows.assign(response_s=(rows["first_choice_s"] - rows["onset_s"]).astype("Float64").round(6))


def tracks(study: Study) -> pd.DataFrame:
    """Return the last attempt at each trial of levels with its presented level; the key must be open.

    ``right`` tells whether the answer was correct, ``success`` whether it counts as a success of the psychometric
    function; ``analysed`` is false if the trial is excluded or presents the modulus of a magnitude estimation;
    ``reversal`` tells whether an up–down track reversed.
    """
    by_id = {block.id: block for block in study.levels}
    rows = study.trials[study.trials["block"].isin(list(by_id))]
    rows = rows.sort_values("attempt").drop_duplicates(_PRESENTATION[:-1], keep="last").sort_index()
    answers = answers_timed(study)[[*_PRESENTATION, "response", "value", "response_s"]]
    frame = rows.merge(_presentations(study.intervals), on=_PRESENTATION, how="left")
    frame = frame.merge(answers, on=_PRESENTATION, how="left")
    frame["slot"] = frame.groupby(TRACK).cumcount() + 1
    track_rows = [_track_row(by_id[row["block"]], row) for row in frame[list(_READ)].to_dict("records")]
    frame = frame.drop(columns=list(_DELIVERED))
    frame = frame.join(pd.DataFrame(track_rows, index=frame.index, columns=list(_TYPES)).astype(_TYPES))
    frame = frame.assign(reversal=_reversals(frame, by_id))
    if study.with_below_chance:
        return frame
    decided = {exclusion.what[:2] for exclusion in study.kept if exclusion.rule_or_person == "below_chance"}
    for one in below_chance(frame, study.levels):
        if (one.participant, one.session) not in decided:
            own = (frame["participant"] == one.participant) & (frame["session"] == one.session)
            frame["analysed"] &= ~(own & (frame["block"] == one.block)).astype("boolean")
    return frame


@dataclass(frozen=True, slots=True, kw_only=True)
class BelowChance:
    """A session's answers in a block with fewer correct answers than by chance; ``p`` is one-sided."""

    participant: str
    session: int
    block: str
    right: int
    n: int
    p: float


def below_chance(frame: pd.DataFrame, blocks: Iterable[LevelBlock]) -> Iterator[BelowChance]:
    """Yield the sessions with answers below chance (binomial p below `BELOW_CHANCE_P`).

    Only designs with a guess rate have a chance level: in others a bias reduces the share of correct answers.
    """
    by_id = {block.id: block for block in blocks}
    answered = frame[frame["analysed"].fillna(False) & frame["right"].notna()]
    of_blocks: Iterable[tuple[Any, pd.DataFrame]] = answered.groupby(["participant", "session", "block"])
    for (who, session, block), rows in of_blocks:
        if (chance := by_id[block].design.guess_rate) is None:
            continue
        right, n = int(rows["right"].sum()), len(rows)
        p = float(bdtr(right, n, chance))
        if p < BELOW_CHANCE_P:
            yield BelowChance(participant=str(who), session=int(session), block=str(block), right=right, n=n, p=p)


def setting_of(block: LevelBlock, track: str) -> TrackSetting | None:
    """Return the setting for which a track ("8/1") chose its levels; None for a comparison of conditions."""
    number = track.rpartition("/")[2]
    return None if block.stimulus is None else TrackSetting(block.stimulus, block.design, int(number))


def answers_of(rows: pd.DataFrame) -> list[Answer]:
    """Return the answers of one track as its method received them, including excluded ones."""
    heard = _heard(rows)
    return list(zip(heard["level"].astype(float), heard["success"].astype(bool), strict=True))


def _heard(rows: pd.DataFrame) -> pd.DataFrame:
    """Return, in order, the rows whose answers changed their track: no catch trials or standards alone."""
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
        at, places = block.method.reversals(setting, answers_of(rows)), _heard(rows).index
        reversal[places] = False
        reversal[places[list(at)]] = True
    return reversal


def _track_row(block: LevelBlock, row: Mapping[Any, Any]) -> dict[str, Any]:
    track = next(setting.condition for setting in block.settings if setting.code == row["code"])
    found: dict[str, Any] = {**dict.fromkeys(_TYPES, pd.NA), "track": track}
    modulus = block.design.first is not None and int(row["index"]) == 1
    found["analysed"] = bool(row["counted"]) and not modulus
    letters = row["arrangement"]
    if not pd.isna(letters) and _UNKNOWN in letters:
        found["analysed"] = False
        return found
    if pd.isna(letters) or len(letters) < block.design.intervals:  # the trial ended before its last interval
        return found
    if letters.count("C") == 1 and block.design.intervals > 1:
        found["comparison_interval"] = letters.index("C") + 1
    if block.stimulus is not None and not pd.isna(row["level"]):
        standard = None if pd.isna(row["standard"]) else float(row["standard"])
        found["comparison"] = block.stimulus.comparison(standard, float(row["level"]))
        found["level_delivered"] = _level_delivered(block.stimulus, standard, found["comparison"], row)
    if not pd.isna(row["response"]):
        arrangement, answer = block.design.arrangement_of(letters), str(row["response"])
        correct, success = block.design.is_correct(arrangement, answer), block.design.success(arrangement, answer)
        if block.has_correct_answer and correct is not None:
            found["right"] = correct
        found["success"] = pd.NA if success is None else success
    return found


def _level_delivered(stimulus: Stimulus, standard: float | None, comparison: float, row: Mapping[Any, Any]) -> Any:
    """Return the delivered level of the comparison; missing if it was not measured, or not presented.

    For a delay it is the requested one plus the difference in lateness between the frames of comparison and standard.
    """
    value, of_standard, error_ms, of_standard_ms = (row[name] for name in _DELIVERED)
    if stimulus.vary == DELAY:
        if pd.isna(error_ms):
            return pd.NA
        late_ms = float(error_ms) - (0.0 if pd.isna(of_standard_ms) else float(of_standard_ms))
        return stimulus.level_between(standard, comparison + late_ms)
    if pd.isna(value):
        return pd.NA
    if stimulus.vary == FORCE_DELAY and standard is not None and not pd.isna(of_standard):
        return stimulus.level_between(standard, standard + float(value) - float(of_standard))
    return stimulus.level_between(standard if pd.isna(of_standard) else float(of_standard), float(value))


def _presentations(intervals: pd.DataFrame) -> pd.DataFrame:
    """Return one row per presentation: standard, level, arrangement, and force and speed of each interval."""
    ordered = intervals.sort_values([*_PRESENTATION, "interval"])
    letters = ordered["presented"].map({"comparison": "C", "standard": "S"}).fillna(_UNKNOWN)
    frame = ordered.groupby(_PRESENTATION, sort=False)[["standard", "level", "catch", "setting"]].first()
    presented: dict[Any, str] = {}
    for which, letter in zip(zip(*(ordered[name] for name in _PRESENTATION), strict=True), letters, strict=True):
        presented[which] = presented.get(which, "") + letter
    frame["arrangement"] = pd.Series(presented, dtype="string").reindex(frame.index)
    for name, what in (("value_delivered", "value"), ("delay_error_mean_ms", "delay_error_ms")):
        means = ordered.assign(letter=letters).groupby([*_PRESENTATION, "letter"])[name].mean().unstack("letter")
        for letter in "CS":
            frame[f"{what}_{letter}"] = means.get(letter, pd.NA)
    for name in OF_INTERVALS:
        wide = ordered.pivot(index=_PRESENTATION, columns="interval", values=name)
        frame = frame.join(wide.rename(columns={number: f"{name}_{number}" for number in wide.columns}))
    return frame.reset_index()
