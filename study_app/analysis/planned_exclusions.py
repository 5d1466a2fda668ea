"""Sessions that meet a planned exclusion rule: proposals, decisions, and the results with and without the sessions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import pandas as pd

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.levels.tracks import sessions_below_chance, tracks
from study_app.analysis.results import Results
from study_app.analysis.wording import counted, number, p_equals, percent
from study_app.number_text import capitalised
from study_app.protocol.model import RULES, ExclusionRule
from study_app.store.exclusions import Exclusion

NEED_KEY: Final = {"below_chance", "threshold_beyond_levels"}
"""The rules that cannot be applied while the key is sealed."""
_TABLES: Final = ("responses", "trials", "participants", "answered", "intervals")
SESSION: Final = ["participant", "session"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Proposal:
    """A session that meets a rule, the reason, and a person's decision; ``by`` is "" before the decision."""

    participant: str
    session: int
    rule: str
    why: str
    decision: str = "undecided"
    by: str = ""

    @property
    def what(self) -> tuple[str, int]:
        """Participant and session."""
        return self.participant, self.session


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedExclusions:
    """The sessions that meet a rule, and the results with and without all of them."""

    proposals: tuple[Proposal, ...]
    included: Results
    left_out: Results


def planned_exclusions(study: Study, results: Results) -> PlannedExclusions | None:
    """Return the sessions that meet a rule and the conclusions with and without them; None if no session does."""
    proposed = proposals(study, results)
    if not proposed:
        return None
    excluded = any(proposal.decision == "excluded" for proposal in proposed)
    whole = replace(load_study(study.folder, planned=False) if excluded else study, with_below_chance=True)
    return PlannedExclusions(
        proposals=proposed,
        included=evaluate(whole, recordings=False),
        left_out=evaluate(_exclude_sessions(whole, {proposal.what for proposal in proposed}), recordings=False),
    )


def proposals(study: Study, results: Results | None) -> tuple[Proposal, ...]:
    """Return the sessions that meet a rule or have answers below chance, each with the decision about it.

    Without ``results``, the rule on thresholds is not applied.
    """
    planned = _planned_limits(study)
    excluded = (
        Proposal(
            participant=exclusion.participant,
            session=exclusion.session,
            rule=exclusion.rule_or_person,
            why=exclusion.reason,
            decision="excluded",
            by=exclusion.excluded_at,
        )
        for exclusion in study.exclusions
        if exclusion.rule_or_person in RULES and exclusion.trial is None
    )
    kept = {
        (*exclusion.what[:2], exclusion.rule_or_person): exclusion
        for exclusion in study.kept
        if exclusion.trial is None
    }
    met = (
        Proposal(participant=str(who), session=int(session), rule=rule, why=why)
        for rule, rows in (
            ("below_chance", _sessions_below_chance(study)),
            ("threshold_beyond_levels", _thresholds_beyond_levels(study, results)),
            ("constant_answers", _constant_answers(study, planned.get("constant_answers"))),
            ("fast_answers", _fast_answers(study, planned.get("fast_answers"))),
        )
        if rule in planned or rule == "below_chance"
        for (who, session), why in rows
    )
    decided = (
        replace(proposal, decision="kept", by=f"{kept[key].excluded_at}: {kept[key].reason}")
        if (key := (*proposal.what, proposal.rule)) in kept
        else proposal
        for proposal in met
    )
    return tuple(sorted((*excluded, *decided), key=lambda proposal: (*proposal.what, proposal.rule)))


def _planned_limits(study: Study) -> dict[Any, float | None]:
    """Return the planned rules with their limits, None for a rule without one."""
    return {rule["rule"]: rule.get("limit") for rule in (study.protocol.get("analysis") or {}).get("exclusions", ())}


def rule_conditions(study: Study) -> dict[str, str]:
    """Return the condition of each planned rule as text."""
    rules = (ExclusionRule(rule=rule, limit=limit) for rule, limit in _planned_limits(study).items())
    return {rule.rule: rule.words for rule in rules}


def rule_sentences(study: Study, results: Results | None) -> tuple[str, ...]:
    """Return a sentence on each planned rule and the number of sessions that met it, as in `proposals`."""
    conditions = rule_conditions(study)
    met = Counter(proposal.rule for proposal in proposals(study, results)) if conditions else Counter()
    return tuple(
        f"Planned rule: {condition}. {_met_words(met[rule], is_known=study.revealed or rule not in NEED_KEY)}"
        for rule, condition in conditions.items()
    )


def _met_words(sessions: int, *, is_known: bool) -> str:
    if not is_known:
        return "The rule is applied after unblinding."
    return f"{capitalised(counted(sessions, 'session')) if sessions else 'No session'} met this rule."


_SessionReasons = Iterator[tuple[Any, str]]


def _sessions_below_chance(study: Study) -> _SessionReasons:
    if study.revealed and study.levels:
        for session in sessions_below_chance(tracks(replace(study, with_below_chance=True)), study.levels):
            yield (
                (session.participant, session.session),
                f"{session.right} of {session.n} answers in {session.block} are correct, which is fewer than expected "
                f"by chance ({p_equals(session.p)}); the answer keys may have been swapped",
            )


def _thresholds_beyond_levels(study: Study, results: Results | None) -> _SessionReasons:
    sessions = study.participants[study.participants["counted"]]
    for block in () if results is None else results.levels:
        for row in block.statistics.get("thresholds", ()):
            if row.participant is not None and row.beyond is not None:
                for session in sessions.loc[sessions["participant"] == row.participant, "session"]:
                    yield (
                        (row.participant, session),
                        f"the threshold in {block.block} lies {row.beyond} the range of levels",
                    )


def _constant_answers(study: Study, limit: float | None) -> _SessionReasons:
    answers = study.responses[study.responses["counted"] & study.responses["response"].notna()]
    for session, rows in answers.groupby(SESSION):
        most = int(rows["response"].value_counts().max())
        if limit is not None and len(rows) > 1 and 100 * most > limit * len(rows):
            yield session, f"{percent(most / len(rows))} of the {len(rows)} answers to statements are identical"


def _fast_answers(study: Study, limit: float | None) -> _SessionReasons:
    answers = study.answered[study.answered["counted"]]
    times = (answers["first_choice_s"] - answers["onset_s"]).astype("Float64")
    for session, session_times in times.dropna().groupby([answers[name] for name in SESSION]):
        median = float(session_times.median())
        if limit is not None and median < limit:
            yield session, f"half of the {len(session_times)} answers were given within {number(median)} s"


def undecided(study: Study, results: Results | None) -> tuple[Exclusion, ...]:
    """Return the proposed exclusions that await a decision; their time is empty."""
    return tuple(
        Exclusion(
            participant=proposal.participant,
            session=proposal.session,
            trial=None,
            rule_or_person=proposal.rule,
            reason=proposal.why,
            excluded_at="",
        )
        for proposal in proposals(study, results)
        if proposal.decision == "undecided"
    )


def _exclude_sessions(study: Study, sessions: Collection[tuple[str, int]]) -> Study:
    """Return the study as if these sessions were excluded."""

    def without_sessions(table: pd.DataFrame) -> pd.DataFrame:
        if "counted" not in table:
            return table
        of_rows = zip(table["participant"].astype(str), table["session"].astype(int), strict=True)
        is_kept = pd.Series([what not in sessions for what in of_rows], index=table.index, dtype=bool)
        return table.assign(counted=table["counted"] & is_kept)

    tables: dict[str, Any] = {name: without_sessions(getattr(study, name)) for name in _TABLES}
    return replace(study, **tables)
