"""Sessions that meet a planned exclusion rule: proposals, decisions, and the results with and without the sessions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Final

import pandas as pd

from study_app.analysis.data.study_tables import Study, load_study
from study_app.analysis.evaluate import evaluate
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.levels.tracks import sessions_below_chance, tracks
from study_app.analysis.results import LevelsResult, Results
from study_app.analysis.wording import counted, number, p_equals, percent
from study_app.errors import AnalysisError
from study_app.number_text import capitalised
from study_app.protocol.model import RULES, ExclusionRule
from study_app.store.exclusions import Exclusion, describe_exclusion

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
    unmet = {exclusion.what[:2] for exclusion in unmet_exclusions(study)}
    whole = _exclude_sessions(whole, unmet) if unmet else whole
    return PlannedExclusions(
        proposals=proposed,
        included=evaluate(whole, recordings=False),
        left_out=evaluate(_exclude_sessions(whole, {proposal.what for proposal in proposed}), recordings=False),
    )


def proposals(study: Study, results: Results | None) -> tuple[Proposal, ...]:
    """Return the sessions that meet a rule or have answers below chance, each with the decision about it.

    Without ``results``, the rule on thresholds is not applied.
    """
    unmet = unmet_exclusions(study)
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
        if exclusion.rule_or_person in RULES and exclusion.trial is None and exclusion not in unmet
    )
    kept = {
        (*exclusion.what[:2], exclusion.rule_or_person): exclusion
        for exclusion in study.kept
        if exclusion.trial is None
    }
    decided = (
        replace(proposal, decision="kept", by=f"{kept[key].excluded_at}: {kept[key].reason}")
        if (key := (*proposal.what, proposal.rule)) in kept
        else proposal
        for proposal in _sessions_meeting_rules(study, () if results is None else results.levels)
    )
    return tuple(sorted((*excluded, *decided), key=lambda proposal: (*proposal.what, proposal.rule)))


def _sessions_meeting_rules(study: Study, levels: Iterable[LevelsResult]) -> Iterator[Proposal]:
    """Yield the analysed sessions that meet a rule, without a decision; ``levels`` has the study's thresholds."""
    planned = _planned_limits(study)
    for rule, rows in (
        ("below_chance", _sessions_below_chance(study)),
        ("threshold_beyond_levels", _thresholds_beyond_levels(study, levels)),
        ("constant_answers", _constant_answers(study, planned.get("constant_answers"))),
        ("fast_answers", _fast_answers(study, planned.get("fast_answers"))),
    ):
        if rule in planned or rule == "below_chance":
            for (participant, session), why in rows:
                yield Proposal(participant=str(participant), session=int(session), rule=rule, why=why)


def check_rule(study: Study, participant: str, session: int, rule: str) -> bool:
    """Return whether a session meets a rule by which it is to be excluded; False if the sealed key prevents the check.

    A session that does not exist or is excluded already is not checked, because `store.exclusions.exclude` rejects it.

    Raises
    ------
    AnalysisError
        The protocol does not plan the rule, or the session does not meet it.
    """
    planned = [*rule_conditions(study), *(["below_chance"] if study.levels else [])]
    if rule not in planned:
        known = f"planned rules: {', '.join(dict.fromkeys(planned))}" if planned else "it does not plan any rules"
        raise AnalysisError(
            f"the protocol does not plan the rule {rule!r} ({known}); to exclude the session for the reason that you "
            "give, omit --rule"
        )
    if rule in NEED_KEY and not study.revealed:
        return False
    rows = _rows_of_session(study, participant, session)
    if rows["excluded"].all():
        return True
    levels = level_results(study) if rule == "threshold_beyond_levels" else ()
    met = {(proposal.what, proposal.rule) for proposal in _sessions_meeting_rules(study, levels)}
    if ((participant, session), rule) not in met:
        raise AnalysisError(
            f"participant {participant}, session {session} does not meet the rule {rule}: "
            f"{_why_unmet(study, participant, session, rule)}; to exclude it for another reason, omit --rule"
        )
    return True


def unmet_exclusions(study: Study) -> dict[Exclusion, str]:
    """Return the exclusions by a planned rule that the session does not meet, with the reason why it does not.

    Exclusions by rules that cannot be applied yet are not included.
    """
    applied = {*_planned_limits(study), "below_chance"} - (set() if study.revealed else NEED_KEY)
    excluded = [
        exclusion
        for exclusion in study.exclusions
        if exclusion.rule_or_person in applied & RULES.keys() and exclusion.trial is None
    ]
    if not excluded:
        return {}
    whole = load_study(study.folder, planned=False)
    by_thresholds = any(exclusion.rule_or_person == "threshold_beyond_levels" for exclusion in excluded)
    met = {
        (*proposal.what, proposal.rule)
        for proposal in _sessions_meeting_rules(whole, level_results(whole) if by_thresholds else ())
    }
    return {
        exclusion: _why_unmet(whole, exclusion.participant, exclusion.session, exclusion.rule_or_person)
        for exclusion in excluded
        if (*exclusion.what[:2], exclusion.rule_or_person) not in met
    }


def unmet_exclusion_sentences(study: Study) -> Iterator[str]:
    """Yield a phrase on each exclusion by a planned rule that the session does not meet."""
    for exclusion, why in unmet_exclusions(study).items():
        yield (
            f"{describe_exclusion(exclusion)} was excluded under the rule {exclusion.rule_or_person}, but does not "
            f"meet it: {why}; recorded reason: {exclusion.reason}"
        )


def _why_unmet(study: Study, participant: str, session: int, rule: Any) -> str:
    """Return the value of a session that does not meet a rule, with the rule's limit, or the rule's condition."""
    limit = _planned_limits(study).get(rule)
    match rule:
        case "fast_answers":
            values = {what: f"its median response time is {number(s)} s" for what, s, _ in _median_times(study)}
            limit_text = f"the rule requires less than {limit:g} s"
        case "constant_answers":
            values = {
                what: f"{percent(most / n)} of its {n} answers to statements are identical"
                for what, most, n in _most_frequent_answers(study)
            }
            limit_text = f"the rule requires more than {limit:g} %"
        case _:
            values = {}
            limit_text = f"the rule requires that {RULES[rule]}"
    value = values.get((participant, session))
    if not _rows_of_session(study, participant, session)["counted"].any():
        return "it is not complete and therefore not analysed"
    return limit_text if value is None else f"{value}, and {limit_text}"


def _rows_of_session(study: Study, participant: str, session: int) -> pd.DataFrame:
    rows = study.participants
    return rows[(rows["participant"] == participant) & (rows["session"] == session)]


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
    unmet = Counter(exclusion.rule_or_person for exclusion in unmet_exclusions(study))
    return tuple(
        f"Planned rule: {condition}. {_met_text(met[rule], is_known=study.revealed or rule not in NEED_KEY)}"
        f"{_unmet_text(unmet[rule])}"
        for rule, condition in conditions.items()
    )


def _met_text(sessions: int, *, is_known: bool) -> str:
    if not is_known:
        return "The rule is applied after unblinding."
    return f"{capitalised(counted(sessions, 'session')) if sessions else 'No session'} met this rule."


def _unmet_text(sessions: int) -> str:
    if not sessions:
        return ""
    was, does = ("was", "does") if sessions == 1 else ("were", "do")
    return f" {capitalised(counted(sessions, 'session'))} {was} excluded under this rule but {does} not meet it."


_SessionReasons = Iterator[tuple[Any, str]]


def _sessions_below_chance(study: Study) -> _SessionReasons:
    if study.revealed and study.levels:
        for session in sessions_below_chance(tracks(replace(study, with_below_chance=True)), study.levels):
            yield (
                (session.participant, session.session),
                f"{session.right} of {session.n} answers in {session.block} are correct, which is fewer than expected "
                f"by chance ({p_equals(session.p)}); the answer keys may have been swapped",
            )


def _thresholds_beyond_levels(study: Study, levels: Iterable[LevelsResult]) -> _SessionReasons:
    sessions = study.participants[study.participants["counted"]]
    for block in levels:
        for row in block.statistics.get("thresholds", ()):
            if row.participant is not None and row.beyond is not None:
                for session in sessions.loc[sessions["participant"] == row.participant, "session"]:
                    yield (
                        (row.participant, session),
                        f"the threshold in {block.block} lies {row.beyond} the range of levels",
                    )


def _constant_answers(study: Study, limit: float | None) -> _SessionReasons:
    for session, most, n in _most_frequent_answers(study):
        if limit is not None and n > 1 and 100 * most > limit * n:
            yield session, f"{percent(most / n)} of the {n} answers to statements are identical"


def _most_frequent_answers(study: Study) -> Iterator[tuple[Any, int, int]]:
    """Yield each session with the frequency of its most frequent answer to statements, and its number of answers."""
    answers = study.responses[study.responses["counted"] & study.responses["response"].notna()]
    for session, rows in answers.groupby(SESSION):
        yield session, int(rows["response"].value_counts().max()), len(rows)


def _fast_answers(study: Study, limit: float | None) -> _SessionReasons:
    for session, median, n in _median_times(study):
        if limit is not None and median < limit:
            yield session, f"half of the {n} answers were given within {number(median)} s"


def _median_times(study: Study) -> Iterator[tuple[Any, float, int]]:
    """Yield each session with its median response time and its number of answers."""
    answers = study.answered[study.answered["counted"]]
    times = (answers["first_choice_s"] - answers["onset_s"]).astype("Float64")
    for session, session_times in times.dropna().groupby([answers[name] for name in SESSION]):
        yield session, float(session_times.median()), len(session_times)


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
