"""What ``exclusions.csv`` leaves out, marked in the rows it is about: they are kept, and do not count."""

from collections.abc import Iterator, Sequence

import pandas as pd

from study_app.errors import AnalysisError
from study_app.store.exclusions import Exclusion, named
from study_app.store.folders import StudyFolder


def with_excluded(table: pd.DataFrame, listed: Sequence[Exclusion]) -> pd.DataFrame:
    """Return the table with ``excluded`` and ``exclusion_reason`` added.

    Parameters
    ----------
    table : DataFrame
        ``participant`` and ``session`` of every row; where the rows are of trials, ``trial`` too.
    listed : sequence of Exclusion
        What is left out: a session with all its trials, or one trial with all its attempts.
    """
    if not listed:
        return table.assign(excluded=False, exclusion_reason=pd.Series(pd.NA, index=table.index, dtype="string"))
    trials = table["trial"] if "trial" in table.columns else [None] * len(table)
    found = [
        list(_about(listed, str(participant), int(session), None if pd.isna(trial) else trial))
        for participant, session, trial in zip(table["participant"], table["session"], trials, strict=True)
    ]
    reasons = ["; ".join(one.reason for one in of_row if one.reason) or None for of_row in found]
    return table.assign(
        excluded=pd.Series([bool(of_row) for of_row in found], index=table.index, dtype=bool),
        exclusion_reason=pd.Series(reasons, index=table.index, dtype="string"),
    )


def _about(listed: Sequence[Exclusion], participant: str, session: int, trial: int | None) -> Iterator[Exclusion]:
    """Yield what leaves out a row: its session's exclusion before its trial's."""
    for which in dict.fromkeys((None, trial)):
        yield from (one for one in listed if one.what == (participant, session, which))


def check_there(study: StudyFolder, trials: pd.DataFrame, listed: Sequence[Exclusion]) -> None:
    """Refuse a list that leaves out what is not there, such as a mistyped id: what was meant would count.

    Raises
    ------
    AnalysisError
        Names the first such row.
    """
    sessions = {(session.participant, session.number) for session in study.sessions()}
    presented = set(zip(trials["participant"], trials["session"], trials["trial"], strict=True))
    for one in listed:
        if (one.participant, one.session) not in sessions or (one.trial is not None and one.what not in presented):
            raise AnalysisError(
                f"{study.exclusions} excludes {named(one)}, which does not exist: correct or remove the row, so "
                "that the intended data are excluded"
            )
