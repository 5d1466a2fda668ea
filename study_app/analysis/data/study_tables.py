"""A study as tables: every session of a results folder, pooled over sites, and its groups of participants.

Each site has its own key, so the code L1 stands for different conditions at different sites. Until all keys are open,
codes are SITE-CODE and each site has its own settings; afterwards the ID of a condition is its code, and all sites have
the same settings.

The tables contain everything that was recorded. The column ``counted`` marks the rows that enter measures and figures:
main trials of completed sessions that are not excluded and, if a trial was repeated, only its last attempt. Sessions
with too many missing trials are excluded unless a person included them again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, Literal, TypeAlias, TypeVar

import numpy as np
import pandas as pd

from study_app.analysis.data import measures
from study_app.analysis.data.blocks import (
    NO_QUESTIONS,
    NOTHING_DECIDED,
    OF_SESSION,
    START,
    Block,
    Decided,
    Kind,
    LevelBlock,
    OtherQuestions,
    OwnDynamics,
    PlacedQuestion,
    PlacedScore,
    QuestionPlace,
    Setting,
    contrasts_of,
    read_decided,
    settings_from_key,
)
from study_app.analysis.data.session_files import (
    Session,
    check_exclusions_exist,
    estimators_of,
    mark_excluded,
    mean_dynamics,
    read_sessions,
    read_tables,
)
from study_app.errors import AnalysisError, StoreError
from study_app.protocol.model import RULES, Contrast
from study_app.protocol.participants import EACH_GROUP
from study_app.protocol.questions import STATEMENT
from study_app.store.blinded import Key, revealed_key
from study_app.store.exclusions import MISSING_RULE, Exclusion, exclusions, reversals
from study_app.store.files import INTERVALS, SEALED, SessionFolder, StudyFolder
from study_app.store.integrity import is_never_begun
from study_app.store.journals.journal_events import INCOMPLETE, REACHED_END
from study_app.store.merged import DASH, Merged, read_merged
from study_app.store.sessions import Place
from study_app.store.tables import has_intervals, refuse_earlier_columns
from study_app.store.unblinding import has_opened_keys, late_exclusions
from study_app.store.verification import Discrepancy, session_discrepancies
from study_app.store.withdrawals import Tombstone, tombstones

Settings: TypeAlias = Mapping[tuple[str, str], Setting]
_AnyBlock = TypeVar("_AnyBlock", Block, LevelBlock)


def _with_merged_code(site: str, setting: Setting) -> Setting:
    """Return a site's setting with its code in the merged study."""
    code = f"{site}{DASH}{setting.code}" if setting.condition is None else setting.condition
    return replace(setting, code=code)


def _unique_settings(settings_by_site: Mapping[str, Iterable[Setting]]) -> tuple[Setting, ...]:
    """Return the settings of all sites without duplicates, in order of first occurrence."""
    return tuple(
        dict.fromkeys(
            _with_merged_code(site, setting) for site, settings in settings_by_site.items() for setting in settings
        )
    )


def _pooled_blocks(sites: Mapping[str, Sequence[_AnyBlock]]) -> tuple[_AnyBlock, ...]:
    """Return the blocks, which are common to all sites, with the settings of all sites."""
    first = next(iter(sites.values()))
    return tuple(
        replace(block, settings=_unique_settings({site: blocks[place].settings for site, blocks in sites.items()}))
        for place, block in enumerate(first)
    )


def _pooled_questions(sites: Mapping[str, OtherQuestions]) -> OtherQuestions:
    """Return the other questions, which are common to all sites, with the settings of all sites."""

    def where(wheres: Mapping[str, QuestionPlace]) -> QuestionPlace:
        settings = _unique_settings({site: where.settings for site, where in wheres.items()})
        return replace(next(iter(wheres.values())), settings=settings)

    def questions(asked: Mapping[str, Sequence[PlacedQuestion]]) -> tuple[PlacedQuestion, ...]:
        return tuple(
            replace(question, where=where({site: of_site[place].where for site, of_site in asked.items()}))
            for place, question in enumerate(next(iter(asked.values())))
        )

    scores: tuple[PlacedScore, ...] = tuple(
        replace(
            score,
            where=where({site: asked.scores[place].where for site, asked in sites.items()}),
            questions=questions({site: asked.scores[place].questions for site, asked in sites.items()}),
        )
        for place, score in enumerate(next(iter(sites.values())).scores)
    )
    return OtherQuestions(questions({site: asked.questions for site, asked in sites.items()}), scores)


def _add_site(site: str, settings: Settings, table: pd.DataFrame) -> pd.DataFrame:
    """Return a table of a site with the site in the participant IDs and the merged study's codes."""
    if "participant" not in table:
        return table
    table = table.assign(participant=f"{site}{DASH}" + table["participant"])
    if "code" not in table:
        return table
    codes = [
        None if pd.isna(code) else _with_merged_code(site, settings.get((block, code), Setting(code=code))).code
        for block, code in zip(table["block"], table["code"], strict=True)
    ]
    return table.assign(code=pd.array(codes, dtype="string"))


def _pooled_dynamics(sites: Iterable[OwnDynamics | None], sessions: int) -> OwnDynamics | None:
    measured = [site for site in sites if site is not None]
    if not measured:
        return None
    weights = [dynamics.sessions for dynamics in measured]
    damping_nspm, friction_n, mass_kg = (
        float(np.average([getattr(dynamics, name) for dynamics in measured], weights=weights))
        for name in ("damping_nspm", "friction_n", "mass_kg")
    )
    return OwnDynamics(
        damping_nspm=damping_nspm, friction_n=friction_n, mass_kg=mass_kg, sessions=sum(weights), of=sessions
    )


_TRIAL: Final = ["participant", "session", "trial"]
DAMAGED: Final = "damaged"
"""The status of a session whose receipt is missing or does not describe it."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """All sessions of one study.

    ``responses`` and ``trials`` have the columns of ``store.files.columns``, with ``session_status``, ``excluded``,
    ``exclusion_reason`` and ``counted`` added; ``participants`` has one row per session, with the last three and its
    `MissingTrials`. ``blocks`` are the main blocks with statements, ``unrated_blocks`` those with neither statements
    nor a design, and ``trial_blocks`` both; ``settings`` maps every (block, code) to its condition, and is empty while
    the key is sealed; ``exclusions`` are all exclusions, ``late`` those that a person decided or reversed after the key
    was opened; ``kept`` are sessions that a person decided to keep; ``doubts`` are
    files that differ from their recorded state but are used. ``decided`` is the protocol's analysis plan, ``protocol``
    the first session's, from its receipt. ``levels`` are the blocks with a design, ``intervals`` the intervals of their
    trials; ``others`` are the questions outside blocks of statements; ``answered`` has the recorded answers to all
    questions, of which ``responses`` are those to statements; ``own_dynamics`` are the device's, if receipts record a
    measurement; ``estimator`` is the velocity estimator, "device" if the device measured the velocity, None if receipts
    do not record it. ``withdrawn`` are the participants who withdrew and whose data were erased. ``contrasts``
    are the study's hypotheses and ``liquids`` its liquids' tables, once the key is open. ``sites`` are the names of the
    sites of a merged study, whose participants are SITE-ID. ``with_below_chance`` includes answers below chance even
    though no person has decided about them. ``split`` is the only group that it contains, `EACH_GROUP` if its figures
    compare the groups, or "".
    """

    folder: Path
    name: str
    title: str
    version: str
    blocks: tuple[Block, ...]
    settings: Mapping[tuple[str, str], Setting]
    responses: pd.DataFrame
    trials: pd.DataFrame
    participants: pd.DataFrame
    exclusions: tuple[Exclusion, ...]
    late: tuple[Exclusion, ...] = ()
    kept: tuple[Exclusion, ...] = ()
    doubts: tuple[Discrepancy, ...] = ()
    decided: Decided = NOTHING_DECIDED
    others: OtherQuestions = NO_QUESTIONS
    answered: pd.DataFrame = field(default_factory=pd.DataFrame)
    levels: tuple[LevelBlock, ...] = ()
    intervals: pd.DataFrame = field(default_factory=pd.DataFrame)
    protocol: Mapping[str, Any] = field(default_factory=dict)
    own_dynamics: OwnDynamics | None = None
    estimator: str | None = None
    withdrawn: tuple[Tombstone, ...] = ()
    sites: tuple[str, ...] = ()
    contrasts: tuple[Contrast, ...] = ()
    with_below_chance: bool = False
    liquids: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    split: str = ""
    unrated_blocks: tuple[Block, ...] = ()
    _aggregates: dict[tuple[str, ...], pd.DataFrame] = field(
        init=False, default_factory=dict, repr=False, compare=False
    )
    """Cached measures by block and items: computing them takes 0.02 s, and a report needs each table eight times."""

    @property
    def people(self) -> tuple[str, ...]:
        """The participants of included sessions, in order of their IDs."""
        return tuple(sorted(self.participants.loc[self.participants["counted"], "participant"].unique()))

    def site_of(self, participant: str) -> str:
        """Return the site of a participant of a merged study, otherwise ""."""
        return participant.partition(DASH)[0] if self.sites else ""

    @property
    def n(self) -> int:
        """The number of participants in the analysis."""
        return len(self.people)

    @property
    def left_out(self) -> int:
        """The number of sessions that were not completed."""
        left_out = ~self.participants["counted"] & ~self.participants["excluded"]
        return int((left_out & (self.participants["status"] != DAMAGED)).sum())

    @property
    def damaged_sessions(self) -> int:
        """The number of sessions without a valid receipt that are not excluded for another reason."""
        return int(((self.participants["status"] == DAMAGED) & ~self.participants["excluded"]).sum())

    @property
    def excluded_sessions(self) -> pd.DataFrame:
        """The rows of ``participants`` for excluded sessions, completed or not."""
        return self.participants[self.participants["excluded"]]

    @property
    def trial_blocks(self) -> tuple[Block, ...]:
        """The main blocks without a design: those with statements, then the others."""
        return (*self.blocks, *self.unrated_blocks)

    @property
    def versions(self) -> tuple[str, ...]:
        """The protocol versions of the included sessions; without any, that of the first session."""
        counted = self.participants.loc[self.participants["counted"], "protocol_version"]
        return tuple(sorted(set(map(str, counted)))) or (self.version,)

    @property
    def contents(self) -> int:
        """The number of different study files that the included sessions used."""
        return int(self.participants.loc[self.participants["counted"], "protocol_hash"].nunique())

    @property
    def programs(self) -> tuple[str, ...]:
        """The program versions of the included sessions."""
        counted = self.participants.loc[self.participants["counted"], "version"]
        return tuple(sorted(set(map(str, counted.dropna()))))

    @property
    def simulated(self) -> bool:
        """Whether any participant was simulated."""
        return bool(self.participants["simulated"].any())

    @property
    def pilot(self) -> bool:
        """Whether these are pilot sessions."""
        return bool(self.participants["pilot"].any())

    @property
    def revealed(self) -> bool:
        """Whether the key was opened, so that settings have names."""
        return bool(self.settings)

    @property
    def own_codes(self) -> bool:
        """Whether codes differ between participants, as is the case while the key is sealed."""
        return not self.revealed and self.protocol.get("study", {}).get("codes") == "participant"

    @property
    def has_unmatched_sites(self) -> bool:
        """Whether the codes of different sites cannot be matched, because the key is sealed."""
        return bool(self.sites) and not self.revealed

    def setting_count(self, block: Block | QuestionPlace) -> int:
        """Return the number of different settings of a block: conditions with the same delay count as one.

        As long as the sites' codes cannot be matched, each setting has one code per site.
        """
        if isinstance(block, Block):
            return len(set(block.columns.values())) // self._codes_per_setting
        return len(block.settings) // self._codes_per_setting

    @property
    def _codes_per_setting(self) -> int:
        return len(self.sites) if self.has_unmatched_sites else 1

    def tell_doubts(self, warn: Callable[[str], object] | None) -> None:
        """Call ``warn`` once for each file that differs from its recorded state."""
        if warn is None:
            return
        for doubt in self.doubts:
            warn(f"warning: {doubt}{'; the file is still used' * doubt.used}")

    def blocks_of(self, kind: Kind) -> tuple[Block, ...]:
        """Return the blocks that compare liquids, delays or views."""
        return tuple(block for block in self.blocks if block.kind == kind)

    def answers(self, block: Block) -> pd.DataFrame:
        """Return the valid rows of ``responses`` for one block."""
        return self.responses[self.responses["counted"] & (self.responses["block"] == block.id)]

    def answers_to(self, asked: PlacedQuestion) -> pd.DataFrame:
        """Return the valid rows of ``answered`` for a question outside blocks of statements."""
        rows = self.rows_of(asked)
        return rows[rows["counted"]]

    def hidden_from(self, asked: PlacedQuestion) -> set[str]:
        """Return the participants to whom a question with a display condition was never shown."""
        return set() if asked.question.show_if is None else {*self.people} - {*self.answers_to(asked)["participant"]}

    def rows_of(self, asked: PlacedQuestion) -> pd.DataFrame:
        """Return all rows of ``answered`` for a question outside blocks of statements."""
        rows = self.rows_in(asked.where)
        return rows[rows["item"] == asked.id]

    def rows_in(self, where: QuestionPlace) -> pd.DataFrame:
        """Return all rows of ``answered`` for the questions of a form or after the trials of a block."""
        place = self.answered["form" if where.is_form else "block"] == where.id
        rows = self.answered[place.fillna(False)]
        if not (where.is_form and where.settings):
            return rows
        codes = rows["after_block"].fillna(START)
        if where.by_session:
            codes = codes + OF_SESSION + rows["session"].astype("string")
        return rows.assign(code=codes)

    def presented(self, block: Block) -> dict[str, int]:
        """Return how often each setting of a block was presented in valid trials."""
        rows = self.trials[self.trials["counted"] & (self.trials["block"] == block.id)]
        return {code: int((rows["code"] == code).sum()) for code in block.codes}

    def excluded_trials(self, block: Block) -> pd.DataFrame:
        """Return the individually excluded trials of a block: last attempts in included sessions."""
        rows = self.trials[self.trials["excluded"] & (self.trials["block"] == block.id)]
        included = self.participants.loc[self.participants["counted"], ["participant", "session"]]
        return (
            rows.sort_values("attempt")
            .drop_duplicates(_TRIAL, keep="last")
            .merge(included, on=["participant", "session"])
        )

    def aggregate(self, block: Block) -> pd.DataFrame:
        """Return the measures of a block (see ``measures.aggregate``)."""
        items = [item.id for item in block.items]
        if (key := (block.id, *items)) not in self._aggregates:
            excluded = Counter(map(str, self.excluded_trials(block)["code"]))
            measured = measures.aggregate(self.answers(block), self.presented(block), block.codes, items, excluded)
            self._aggregates[key] = measured
        return self._aggregates[key]


def load_study(folder: Path, *, planned: bool = True) -> Study:
    """Read the results of a study; with ``planned`` False, ignore exclusions by planned rules.

    A merged study (see `store.merged`) is sealed until the key of every site is open.

    Raises
    ------
    AnalysisError
        The folder holds no sessions, a file in it is missing, damaged or of another study, or an excluded session or
        trial does not exist; the message names the place and the remedy.
    StoreError
        The key was opened, and is now missing or changed; ``exclusions.csv`` cannot be read; or the folder of a site
        is missing.

    Examples
    --------
    >>> study = load_study(Path("results/sample-rek2024"))
    >>> study.n, len(study.trials)
    (12, 144)
    >>> study.responses.loc[:1, ["participant", "code", "item", "response"]]
      participant code          item  response
    0        P001   L2  feels_liquid         6
    1        P001   L2     immersive         5
    """
    merged = read_merged(Path(folder))
    study = _load(Path(folder), planned=planned) if merged is None else _load_sites(merged, planned=planned)
    return replace(study, decided=study.decided.at(study.n))


def _load_sites(merged: Merged, *, planned: bool) -> Study:
    folders = {name: StudyFolder(merged.folder(name)) for name in merged.names}
    if missing := [site.path for site in folders.values() if not site.path.is_dir()]:
        raise StoreError(f"{missing[0]} is missing, but {merged.manifest.name} lists it: restore it from a backup")
    opened = has_opened_keys(merged.path)
    load_site = partial(_load, sealed=not opened, planned=planned)
    sites = {name: load_site(site.path) for name, site in folders.items() if site.sessions()}
    if not sites:
        raise AnalysisError(
            f"{merged.path} does not contain any sessions, because all participants at its sites withdrew"
        )
    return pool_sites(
        merged.path, sites, [tombstone for site in folders.values() for tombstone in tombstones(site).values()]
    )


def pool_sites(folder: Path, sites: Mapping[str, Study], withdrawn: Sequence[Tombstone]) -> Study:
    """Return a merged study from the studies of its sites by name; either all or none are unblinded."""
    studies = list(sites.values())
    estimators = [study.estimator.split(" or ") for study in studies if study.estimator is not None]

    def table(name: str) -> pd.DataFrame:
        tables = [_add_site(site, study.settings, getattr(study, name)) for site, study in sites.items()]
        return pd.concat(tables, ignore_index=True)

    def rows(name: str) -> tuple[Exclusion, ...]:
        named = ((f"{site}{DASH}", row) for site, study in sites.items() for row in getattr(study, name))
        return tuple(replace(row, participant=f"{prefix}{row.participant}") for prefix, row in named)

    return replace(
        studies[0],
        folder=folder,
        sites=tuple(sites),
        blocks=_pooled_blocks({site: study.blocks for site, study in sites.items()}),
        unrated_blocks=_pooled_blocks({site: study.unrated_blocks for site, study in sites.items()}),
        levels=_pooled_blocks({site: study.levels for site, study in sites.items()}),
        others=_pooled_questions({site: study.others for site, study in sites.items()}),
        settings={
            (block, merged.code): merged
            for site, study in sites.items()
            for (block, _), setting in study.settings.items()
            for merged in [_with_merged_code(site, setting)]
        },
        responses=table("responses"),
        trials=table("trials"),
        participants=table("participants"),
        answered=table("answered"),
        intervals=table("intervals"),
        exclusions=rows("exclusions"),
        late=rows("late"),
        kept=rows("kept"),
        doubts=tuple(doubt for study in studies for doubt in study.doubts),
        decided=replace(studies[0].decided, changed=any(study.decided.changed for study in studies)),
        own_dynamics=_pooled_dynamics(
            (study.own_dynamics for study in studies), sum(len(study.participants) for study in studies)
        ),
        estimator=" or ".join(dict.fromkeys(part for parts in estimators for part in parts)) or None,
        withdrawn=tuple(withdrawn),
    )


def _load(folder: Path, *, sealed: bool = False, planned: bool = True) -> Study:
    """Read the results in a folder that is not merged; with ``sealed``, ignore an opened key."""
    place = StudyFolder(folder)
    sessions = [session for session in place.sessions() if not is_never_begun(session.path)]
    if not sessions:
        raise AnalysisError(_no_sessions_message(place.path))
    refuse_earlier_columns(place)
    key = None if sealed else _read_key(place, sessions)
    listed = tuple(row for row in exclusions(place.path) if planned or row.rule_or_person not in RULES)
    records, damaged = read_sessions(sessions, key)
    listed += tuple(_find_missing_exclusions(place, records, listed))
    for session in records[1:]:
        _check_poolable(records[0], session)
    responses, trials = read_tables(records, "responses"), read_tables(records, "trials")
    if key is None:  # tables of earlier versions have these columns
        trials = _drop_columns(trials, SEALED)
    unread = {(session.participant, session.number) for session in damaged}
    check_exclusions_exist(place, trials, [row for row in listed if (row.participant, row.session) not in unread])
    after_trials = responses[responses["trial"].notna()]
    attempts = pd.concat([after_trials, trials])[[*_TRIAL, "attempt"]]
    last_attempts = attempts.groupby(_TRIAL)["attempt"].max().rename("last_attempt")
    counted = _add_counted(mark_excluded(after_trials, listed), last_attempts)
    form_answers = mark_excluded(responses[responses["trial"].isna()], listed)
    is_counted = form_answers["session_status"].isin(REACHED_END) & ~form_answers["excluded"]
    form_answers = form_answers.assign(counted=is_counted.astype(bool))
    answered = pd.concat([counted, form_answers]).sort_index() if len(form_answers) else counted
    participants = mark_excluded(_participants(records, damaged), listed)
    return Study(
        folder=place.path,
        name=records[0].study,
        title=records[0].title,
        version=records[0].version,
        blocks=records[0].blocks,
        unrated_blocks=records[0].unrated_blocks,
        settings={} if key is None else settings_from_key(key),
        responses=_statement_answers(counted),
        answered=answered,
        levels=records[0].levels,
        intervals=_read_intervals(records, listed, last_attempts, opened=key is not None),
        trials=_add_counted(mark_excluded(trials, listed), last_attempts),
        participants=participants.assign(counted=participants["status"].isin(REACHED_END) & ~participants["excluded"]),
        exclusions=listed,
        late=late_exclusions(place.path, listed),
        kept=reversals(place.path),
        doubts=(
            *(
                doubt
                for record in records
                for doubt in session_discrepancies(Place(place, record.folder, record.study))
            ),
            *map(_receipt_discrepancy, damaged),
        ),
        others=records[0].others,
        decided=read_decided([session.protocol.get("analysis") for session in records]),
        contrasts=() if key is None else contrasts_of(key),
        liquids={} if key is None else key.tables["liquids"],
        protocol=records[0].protocol,
        own_dynamics=mean_dynamics(records),
        estimator=estimators_of(records),
        withdrawn=tuple(tombstones(place).values()),
    )


def _participants(records: Sequence[Session], damaged: Sequence[SessionFolder]) -> pd.DataFrame:
    """Return a row for each session; of ``damaged`` sessions it contains only what their folders and others tell."""
    visits = [dict(session.visit) for session in records]
    shared = {name: visits[0][name] for name in ("simulated", "pilot")}
    unknown = dict.fromkeys(visits[0], None)
    visits += [
        unknown | shared | {"participant": folder.participant, "session": folder.number, "status": DAMAGED}
        for folder in damaged
    ]
    table = pd.DataFrame(visits)
    return table.assign(seed=pd.Series([visit["seed"] for visit in visits], dtype=object)) if damaged else table


def _receipt_discrepancy(session: SessionFolder) -> Discrepancy:
    what = "is missing or damaged, so the session is not included in the analysis"
    return Discrepancy(session.receipt, what, "restore it from a backup", used=False)


def _find_missing_exclusions(
    place: StudyFolder, records: Sequence[Session], listed: Sequence[Exclusion]
) -> Iterator[Exclusion]:
    """Yield the exclusions of incomplete sessions that the program did not write before it ended."""
    decided = {exclusion.what for exclusion in (*listed, *reversals(place.path))}
    for record in records:
        session = (record.folder.participant, record.folder.number, None)
        if record.visit["status"] == INCOMPLETE and session not in decided:
            yield Exclusion(
                participant=record.folder.participant,
                session=record.folder.number,
                trial=None,
                rule_or_person=MISSING_RULE,
                reason=str(record.visit["missing"]),
                excluded_at=str(record.visit["ended_at"]),
            )


def _read_intervals(
    records: Sequence[Session], listed: Sequence[Exclusion], last_attempts: pd.Series[int], *, opened: bool
) -> pd.DataFrame:
    """Return the intervals of all sessions; an empty table for a study without designs."""
    if not has_intervals(records[0].protocol):
        return pd.DataFrame()
    table = read_tables(records, "intervals")
    table = table if opened else _drop_columns(table, {column.name for column in INTERVALS if column.sealed})
    return _add_counted(mark_excluded(table, listed), last_attempts)


def _drop_columns(table: pd.DataFrame, columns: AbstractSet[str]) -> pd.DataFrame:
    return table.assign(**{name: table[name].mask(table[name].notna()) for name in columns & {*table.columns}})


def _read_key(place: StudyFolder, sessions: Sequence[SessionFolder]) -> Key | None:
    """Return the opened key, or None; raise AnalysisError if it fails because a session belongs to another study."""
    try:
        return revealed_key(place.path)
    except StoreError:
        (first, *others), _ = read_sessions(sessions, None)
        for other in others:
            if other.study != first.study:
                raise AnalysisError(_other_study_message(other, first)) from None
        raise


def _no_sessions_message(path: Path) -> str:
    if not path.is_dir():
        return (
            f"{path} is not a folder: specify a study folder, such as results/rek2024, or one of the names that "
            "liquid-study studies lists"
        )
    study_folders = sorted(
        folder.name for folder in path.iterdir() if folder.is_dir() and StudyFolder(folder).sessions()
    )
    if study_folders:
        return (
            f"{path} is not a study folder, but it contains study folders ({', '.join(study_folders)}): specify "
            f"one, such as {path / study_folders[0]}"
        )
    return (
        f"{path} does not contain any sessions (data/sub-…/ses-…): specify the folder of a study that has at least one "
        "session, such as results/rek2024"
    )


def _other_study_message(other: Session, first: Session) -> str:
    return (
        f"{other.folder.path} belongs to the study {other.study!r}, but {first.folder.path} belongs to "
        f"{first.study!r}: keep each study in a separate folder"
    )


def _check_poolable(first: Session, other: Session) -> None:
    """Raise AnalysisError if two sessions have different studies, keys or questions, so that they cannot be pooled."""
    if other.study != first.study:
        raise AnalysisError(_other_study_message(other, first))
    if other.visit["key_hash"] != first.visit["key_hash"]:
        raise AnalysisError(
            f"{other.folder.path} and {first.folder.path} used different sealed keys, so the same code may stand for "
            "different conditions: keep them in separate folders"
        )
    if other.questionnaire != first.questionnaire:
        raise AnalysisError(
            f"{other.folder.path} (version {other.version}) and {first.folder.path} (version {first.version}) used "
            "different statements: keep the versions of a study in separate folders"
        )


def _add_counted(table: pd.DataFrame, last_attempts: pd.Series[int]) -> pd.DataFrame:
    """Add ``counted``: the last attempt at each main trial of completed sessions, unless excluded."""
    joined = table.join(last_attempts, on=_TRIAL)
    counted = (
        (joined["phase"] == "main")
        & joined["session_status"].isin(REACHED_END)
        & (joined["attempt"] == joined["last_attempt"])
        & ~joined["excluded"]
    )
    return table.assign(counted=counted.astype(bool))


def _statement_answers(table: pd.DataFrame) -> pd.DataFrame:
    """Return the answers to statements as scale points."""
    statements = table[table["kind"] == STATEMENT]
    return statements.assign(response=statements["value"].astype("Int64"))


By: TypeAlias = Literal["group", "site"]


def group_members(study: Study) -> dict[str, str]:
    """Return the group of every included participant; empty without groups.

    Randomised groups are unknown while the key is sealed.
    """
    members = _group_rows(study, "group")
    return dict(zip(map(str, members["participant"]), map(str, members["group"]), strict=True))


def split_study(study: Study, split: str) -> Study:
    """Return a study whose figures compare the groups (`EACH_GROUP`), or that contains only one group."""
    if split == EACH_GROUP:
        return replace(study, split=split)
    people = {person for person, group in group_members(study).items() if group == split}
    tables = {name: getattr(study, name) for name in ("responses", "trials", "participants", "answered", "intervals")}
    split_tables = {
        name: table[table["participant"].isin(people)] for name, table in tables.items() if "participant" in table
    }
    return replace(study, split=split, **split_tables)


def groups_shown(study: Study) -> list[tuple[str, Study]]:
    """Return the groups that a figure compares, with their studies; otherwise the study itself, without a name."""
    if study.split != EACH_GROUP:
        return [("", study)]
    return [(group, split_study(study, group)) for group in sorted({*group_members(study).values()})]


def group_assignment(study: Study) -> str | None:
    """Return how participants were assigned to groups, "randomised" or "pre-existing"; None without groups."""
    if not study.protocol.get("groups"):
        return None
    return str(study.protocol["study"].get("group_assignment", "randomised"))


def group_counts(study: Study, by: By = "group") -> dict[str, int]:
    """Return the number of included participants in each group, or at each site."""
    counts = _group_rows(study, by)[by].value_counts()
    return {str(group): int(counts[group]) for group in sorted(counts.index)}


def group_means(study: Study, by: By = "group") -> list[Any]:
    """Return rows of the answers to each statement, by group or site, in the order of blocks, items and settings.

    They have ``block``, ``item``, ``code``, ``group``, the number ``n`` of participants, and the ``mean`` and ``sd``
    over participants' means in scale points, NaN for the SD of one participant.
    """
    members = _group_rows(study, by)
    if members.empty:
        return []
    rows = study.responses[study.responses["counted"] & study.responses["response"].notna()].merge(
        members, on="participant"
    )
    rows = rows.assign(response=rows["response"].astype(float))
    columns = ["block", "item", "code", by]
    statistics = (
        rows.groupby([*columns, "participant"])["response"].mean().groupby(columns).agg(["size", "mean", "std"])
    )
    frame = statistics.reset_index().set_axis(["block", "item", "code", "group", "n", "mean", "sd"], axis="columns")
    order = [(block.id, item.id, code) for block in study.blocks for item in block.items for code in block.codes]
    places = [order.index(cell) for cell in zip(frame["block"], frame["item"], frame["code"], strict=True)]
    frame = frame.assign(place=places).sort_values(["place", "group"])
    return list(frame.itertuples(index=False))


def _group_rows(study: Study, by: By) -> pd.DataFrame:
    """Return all included participants with their group or site."""
    if by == "site":
        people = study.people if study.sites and study.revealed else ()
        return pd.DataFrame(
            {"participant": people, "site": [study.site_of(person) for person in people]}, dtype="string"
        )
    rows = study.participants[study.participants["counted"] & study.participants["group"].notna()]
    if len(rows):  # pre-existing groups, from the receipts
        return rows[["participant", "group"]].drop_duplicates()
    if "group" not in study.trials or not study.revealed:
        return pd.DataFrame(columns=["participant", "group"])
    rows = study.trials[study.trials["counted"] & study.trials["group"].notna()]
    return rows[["participant", "group"]].drop_duplicates()
