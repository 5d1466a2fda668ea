"""How a block of levels was conducted: what was delivered, what was repeated and why, and answers to catch trials."""

from collections import Counter
from collections.abc import Iterator

import pandas as pd

from study_app.analysis.results.level_results import CatchAnswers, LevelConduct
from study_app.analysis.tables.level_blocks import LevelBlock
from study_app.analysis.tables.measures import number_or_none

TRIAL = ["participant", "session", "trial"]


def level_conduct(block: LevelBlock, opened: pd.DataFrame, intervals: pd.DataFrame) -> Iterator[LevelConduct]:
    """Yield the conduct of a block at each standard; ``intervals`` are those of all attempts, of the same sessions."""
    if block.stimulus is None:
        return
    own = opened[(opened["block"] == block.id) & opened["analysed"]]
    presented = intervals[intervals["block"] == block.id].merge(own[TRIAL], on=TRIAL)
    for standard, rows in own.groupby("standard", dropna=False, sort=True):
        here = presented.merge(rows[TRIAL], on=TRIAL)
        attempts = here.drop_duplicates([*TRIAL, "attempt"])
        last = here[here["counted"]]
        errors = (rows["level_delivered"] - rows["level"])[rows["level"] != 0].dropna().astype(float)
        reasons = Counter(word for words in here["invalid_reasons"].dropna() for word in set(str(words).split()))
        yield LevelConduct(
            standard=number_or_none(standard),
            trials=len(rows),
            repeated=len(attempts) - attempts[TRIAL].drop_duplicates().shape[0],
            reasons=dict(sorted(reasons.items())),
            measured=len(errors),
            error_mean=number_or_none(errors.mean()),
            error_largest=number_or_none(errors.abs().max()),
            pace_mps=number_or_none(last["pace_mps"].mean()),
            apparent_mass_kg=number_or_none(last["apparent_mass_kg"].mean()),
        )


def catch_answers(block: LevelBlock, opened: pd.DataFrame) -> Iterator[CatchAnswers]:
    """Yield the answers to catch trials of each session, also where they exclude it."""
    if block.wrong_most is None:
        return
    caught = opened[(opened["block"] == block.id) & opened["catch"].fillna(False) & opened["right"].notna()]
    for _, rows in caught.groupby(["participant", "session"], sort=True):
        wrong = int((~rows["right"].astype(bool)).sum())
        person, session = str(rows["participant"].iloc[0]), int(rows["session"].iloc[0])
        yield CatchAnswers(person, session, len(rows), wrong, block.wrong_most)
