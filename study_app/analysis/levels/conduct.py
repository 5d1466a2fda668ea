"""The conduct of trials in blocks of levels: delivered levels, catch trials, and force held back."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import takewhile
from typing import Any, Final, NamedTuple, TypeAlias

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import LevelBlock
from study_app.analysis.data.measures import number_or_none
from study_app.analysis.levels.statistic import LevelStatistic, TableColumn, digits, interval_text, unit
from study_app.analysis.wording import counted, listed, number
from study_app.protocol.trials import OF_LINK
from study_app.protocol.warnings import WITHHELD_PERCENT

_TRIAL: Final = ["participant", "session", "trial"]
_Row: TypeAlias = dict[str, Any]
_MOST_LEVELS: Final = 8
"""The most rows at a standard; if there are more levels, neighbouring levels share a row."""


def _level_text(row: _Row) -> str:
    low, high = row["low"], row["high"]
    return digits(low) if low == high else interval_text(low, high)


class _LevelRange(NamedTuple):
    """The rows between two levels at a standard."""

    standard: float | None
    low: float
    high: float
    rows: pd.DataFrame


def _split_by_level(rows: pd.DataFrame) -> Iterator[_LevelRange]:
    """Yield the rows of each level or, if there are many, of `_MOST_LEVELS` ranges of neighbouring levels."""
    for standard, at_standard in rows[rows["level"].notna()].groupby("standard", dropna=False, sort=True):
        level = at_standard["level"].astype(float)
        levels = np.unique(level.to_numpy())
        for neighbours in np.array_split(levels, min(len(levels), _MOST_LEVELS)):
            neighbour_rows = at_standard[level.between(neighbours[0], neighbours[-1])]
            low, high = float(neighbours[0]), float(neighbours[-1])
            yield _LevelRange(number_or_none(standard), low=low, high=high, rows=neighbour_rows)


def _withheld_shares(block: LevelBlock, intervals: pd.DataFrame) -> Iterator[_Row]:
    """Yield the percentage of the force withheld by the safety layer at each level, if the stimulus varies the link."""
    if block.stimulus is None or block.stimulus.vary not in OF_LINK:
        return
    rows = intervals[(intervals["block"] == block.id) & (intervals["presented"] == "comparison")]
    for part in _split_by_level(rows[rows["withheld_share"].notna()]):
        percent = 100 * part.rows["withheld_share"].to_numpy(dtype=float)
        row = {"standard": part.standard, "low": part.low, "high": part.high, "n": len(percent)}
        yield {**row, "mean_percent": float(percent.mean()), "most_percent": float(percent.max())}


def _level_conduct(block: LevelBlock, opened: pd.DataFrame, intervals: pd.DataFrame) -> Iterator[_Row]:
    """Yield the delivery of the analysed trials at each standard; ``intervals`` are those of all attempts.

    ``reasons`` counts the intervals that violated each limit; errors are delivered minus requested levels.
    """
    if block.stimulus is None:
        return
    analysed = opened[(opened["block"] == block.id) & opened["analysed"]]
    presented = intervals[intervals["block"] == block.id].merge(analysed[_TRIAL], on=_TRIAL)
    for standard, rows in analysed.groupby("standard", dropna=False, sort=True):
        at_standard = presented.merge(rows[_TRIAL], on=_TRIAL)
        attempts = at_standard.drop_duplicates([*_TRIAL, "attempt"])
        last = at_standard[at_standard["counted"]]
        errors = (rows["level_delivered"] - rows["level"])[rows["level"] != 0].dropna().astype(float)
        reasons = Counter(word for words in at_standard["invalid_reasons"].dropna() for word in set(str(words).split()))
        yield {
            "standard": number_or_none(standard),
            "trials": len(rows),
            "repeated": len(attempts) - attempts[_TRIAL].drop_duplicates().shape[0],
            "reasons": dict(sorted(reasons.items())),
            "measured": len(errors),
            "error_mean": number_or_none(errors.mean()),
            "error_largest": number_or_none(errors.abs().max()),
            "pace_mps": number_or_none(last["pace_mps"].mean()),
            "apparent_mass_kg": number_or_none(last["apparent_mass_kg"].mean()),
        }


def _catch_answers(block: LevelBlock, opened: pd.DataFrame) -> Iterator[_Row]:
    """Yield the incorrect catch trials of each session; a proportion above ``most`` excludes the session."""
    if block.wrong_most is None:
        return
    caught = opened[(opened["block"] == block.id) & opened["catch"].fillna(False) & opened["right"].notna()]
    for _, rows in caught.groupby(["participant", "session"], sort=True):
        wrong = int((~rows["right"].astype(bool)).sum())
        person, session = str(rows["participant"].iloc[0]), int(rows["session"].iloc[0])
        yield {"participant": person, "session": session, "n": len(rows), "wrong": wrong, "most": block.wrong_most}


class Delivery(LevelStatistic[_Row]):
    """The delivery of the trials at each standard."""

    key = "conduct"
    place = 6
    title = "Delivered levels"

    compute = staticmethod(lambda block, opened, study, _found: _level_conduct(block, opened, study.intervals))

    def standard_column(self) -> TableColumn:
        if all(row["standard"] is None for row in self.rows):
            return None
        return f"Standard{unit(self.result)}", lambda row: digits(row["standard"], 4)

    def table_columns(self) -> Sequence[TableColumn]:
        decimals, level_unit = (4, "") if self.result.level_kind == "weber" else (3, unit(self.result))
        return (
            self.standard_column(),
            ("trials", lambda row: str(row["trials"])),
            ("repeated attempts", lambda row: str(row["repeated"])),
            ("measured", lambda row: str(row["measured"])),
            (f"mean level error{level_unit}", lambda row: number(row["error_mean"], decimals)),
            ("largest", lambda row: number(row["error_largest"], decimals)),
            ("RMS hand speed [m/s]", lambda row: number(row["pace_mps"], 3)),
            ("apparent mass [kg]", lambda row: number(row["apparent_mass_kg"], 3)),
        )

    def explanation(self) -> str:
        reasons = sum((Counter(row["reasons"]) for row in self.rows), Counter[str]())
        violations = [
            f"{name.rpartition('_')[0].replace('_', ' ') or name} in {counted(count, 'interval')}"
            for name, count in reasons.most_common()
        ]
        with_estimator = f", using the velocity estimator “{self.estimator}”" if self.estimator else ""
        limits = (
            f"Some intervals exceeded a limit: {listed(violations)}."
            if reasons
            else "All intervals were within the limits."
            if any(row["measured"] for row in self.rows)
            else "The delivered levels were not measured, so it is not known whether they were within the limits."
        )
        mass = (
            " Apparent mass is the coefficient m in a least-squares fit of F = −b v − m a to the force sent to the "
            f"device{with_estimator}."
        )
        mass = mass if any(row["apparent_mass_kg"] is not None for row in self.rows) else ""
        return (
            "Level error is the delivered level minus the requested level, computed from the recorded samples (for "
            f"delays, from the frames); fits use the delivered levels.{mass} {limits}"
        )


def _catch_rule(row: _Row) -> str:
    excludes = row["wrong"] / row["n"] > row["most"]
    return f"{'excluded: more than' if excludes else 'kept: at most'} {100 * row['most']:g} %"


class _CatchTrials(LevelStatistic[_Row]):
    """The answers to catch trials by session, including the sessions that are excluded because of them."""

    key = "catches"
    place = 7
    title = "Catch trials"

    compute = staticmethod(lambda block, opened, _study, _found: _catch_answers(block, opened))

    def table_columns(self) -> Sequence[TableColumn]:
        return (
            ("Participant", lambda row: row["participant"]),
            ("session", lambda row: str(row["session"])),
            ("n", lambda row: str(row["n"])),
            ("incorrect", lambda row: str(row["wrong"])),
            ("percentage", lambda row: f"{100 * row['wrong'] / row['n']:.0f} %"),
            ("rule", _catch_rule),
        )

    def explanation(self) -> str:
        return "Catch trials present the largest level; the threshold fit includes them."


class _WithheldForce(LevelStatistic[_Row]):
    """The force that the safety layer held back at each level, if the stimulus varies the link."""

    key = "withheld"
    place = 8
    since = 2
    title = "Force held back by the safety layer"

    compute = staticmethod(lambda block, _opened, study, _found: _withheld_shares(block, study.intervals))

    def table_columns(self) -> Sequence[TableColumn]:
        return (
            self.standard_column(),
            (f"Level{unit(self.result)}", _level_text),
            ("intervals", lambda row: str(row["n"])),
            ("mean", lambda row: f"{row['mean_percent']:.1f} %"),
            ("maximum", lambda row: f"{row['most_percent']:.1f} %"),
        )

    def explanation(self) -> str:
        return (
            f"{' '.join(self._unaffected_levels())} The table shows the proportion of the requested force that was "
            "held back by the limits, the passivity controller or the device in the comparisons, including repeated "
            "trials. A delayed force can return energy to the hand. The passivity controller limits this energy by "
            "holding back force, which makes the stimulus weaker than requested."
        )

    def _unaffected_levels(self) -> Iterator[str]:
        """Yield a sentence for each standard on the highest level up to which hardly any force was held back."""
        level_unit = f" {self.result.unit}" if self.result.unit else ""
        for standard in dict.fromkeys(row["standard"] for row in self.rows):
            rows = [row for row in self.rows if row["standard"] == standard]
            unaffected = list(takewhile(lambda row: row["most_percent"] <= WITHHELD_PERCENT, rows))
            at = "" if standard is None else f" at a standard of {standard:.4g}{level_unit}"
            yield (
                f"In comparisons of up to {unaffected[-1]['high']:.3g}{level_unit}{at}, the safety layer never held "
                f"back more than {WITHHELD_PERCENT:g} % of the force."
                if unaffected
                else f"In at least one comparison at the lowest level{at}, the safety layer held back more than "
                f"{WITHHELD_PERCENT:g} % of the force."
            )
