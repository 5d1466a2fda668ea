"""Groups and sites of participants: how many count in each, and the answers to each statement by group or site.

Without groups or sites, and until the study is unblinded, there is nothing.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

import pandas as pd

from study_app.analysis.tables.study_tables import Study

By: TypeAlias = Literal["group", "site"]


@dataclass(frozen=True, slots=True)
class GroupMean:
    """Answers of one group, or site, to one statement on one setting; each participant's mean counts once.

    ``mean`` is in points of the scale; ``sd``, between participants, is None for one participant.
    """

    block: str
    item: str
    code: str
    group: str
    n: int
    mean: float
    sd: float | None


def group_counts(study: Study, by: By = "group") -> dict[str, int]:
    """Return how many participants that count each group, or site, has, by name."""
    counts = _members(study, by)[by].value_counts()
    return {str(group): int(counts[group]) for group in sorted(counts.index)}


def group_means(study: Study, by: By = "group") -> Iterator[GroupMean]:
    """Yield the answers to each statement of each block, by group or site, in the order of the blocks."""
    members = _members(study, by)
    if members.empty:
        return
    rows = study.responses[study.responses["counted"]].merge(members, on="participant")
    rows = rows.assign(response=rows["response"].astype("Float64")).dropna(subset=["response"])
    for block in study.blocks:
        own = rows[rows["block"] == block.id]
        for item in block.items:
            for code in block.codes:
                here = own[(own["item"] == item.id) & (own["code"] == code)]
                for group, answers in here.groupby(by):
                    means = answers.groupby("participant")["response"].mean().astype(float)
                    sd = float(means.std()) if len(means) > 1 else None
                    yield GroupMean(block.id, item.id, code, str(group), len(means), float(means.mean()), sd)


def _members(study: Study, by: By) -> pd.DataFrame:
    """Return participant and group, or site, of everybody who counts."""
    if by == "site":
        people = study.people if study.sites and study.revealed else ()
        return pd.DataFrame({"participant": people, "site": [study.site_of(one) for one in people]}, dtype="string")
    if "group" not in study.trials or not study.revealed:
        return pd.DataFrame(columns=["participant", "group"])
    rows = study.trials[study.trials["counted"] & study.trials["group"].notna()]
    return rows[["participant", "group"]].drop_duplicates()
