"""The tests of one block's answers: which apply, in which families, and why others are not there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeVar

import numpy as np
import pandas as pd

from study_app.analysis.designs.verdicts import FDR, alone, in_family, judged
from study_app.analysis.findings.block_results import BlockFound
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.not_tested import NotTested
from study_app.analysis.findings.section_failures import Failure, Failures
from study_app.analysis.statistics.friedman import DRAWN_UP_TO, friedman
from study_app.analysis.statistics.global_permutation import global_permutation
from study_app.analysis.statistics.multiple_comparisons import false_discovery
from study_app.analysis.statistics.ordinal import ordinal
from study_app.analysis.statistics.outcome import DRAWS, FEW, Outcome, draws_for, told
from study_app.analysis.statistics.paired import paired
from study_app.analysis.statistics.skillings_mack import skillings_mack
from study_app.analysis.tables.compared_blocks import Block
from study_app.analysis.tables.measures import Array, medians, presentations
from study_app.analysis.tables.planned_analysis import Decided
from study_app.analysis.tables.study import Study

T = TypeVar("T")
U = TypeVar("U")

SEALED: Final = "after unblinding: the key is sealed, and this needs to know which setting is which"
OMNIBUS: Final = "test of settings"
OVER_ALL: Final = "test over all statements"
MEASURES: Final = "measures of settings"
COUNTS: Final = "counts of answers"
NUMBERS: Final = "numbers of sessions"
SESSIONS: Final = "comparison of sessions"
AGAIN: Final = "the same asked with other assumptions"

MANY: Final = DRAWN_UP_TO
"""Above so many participants p of single statements is approximated, and no mixed model is fitted."""

FEWER_DRAWS: Final = 1999
"""So many rearrangements are drawn for the test over all statements above ``MANY``, which has no approximation."""


@dataclass(frozen=True)
class Asked:
    """A block's answers as arrays, settings in their order; NaN where one is missing.

    ``values`` (participants, settings) are the medians of ``single`` answers (participants, settings, presentations);
    ``sessions`` of the same shape are the sessions in which these were given. ``verdicts_only``: leave out what decides
    no verdict, for thousands of simulated studies.
    """

    block: Block
    decided: Decided
    people: tuple[str, ...]
    values: Mapping[str, Array]
    seed: int
    each: Callable[[str], object]
    failures: Failures
    single: Mapping[str, Array]
    sessions: Mapping[str, Array]
    planning: bool = True
    verdicts_only: bool = False

    @property
    def n(self) -> int:
        """How many participants answered anything."""
        return len(self.people)

    @property
    def k(self) -> int:
        """How many settings there are; conditions of one delay are one."""
        return len(set(self.block.columns.values()))

    def attempt(self, what: str, compute: Callable[[], T], empty: U) -> tuple[T | U, tuple[NotTested, ...]]:
        """Return what ``compute`` finds; where it fails ``empty``, and that ``what`` is not there and why."""
        found = self.failures.attempt(what, compute, block=self.block.id)
        return (empty, (NotTested(what, found.why),)) if isinstance(found, Failure) else (found, ())

    @property
    def intervals(self) -> int | None:
        """The seed of bootstrap intervals; None: leave them out."""
        return None if self.verdicts_only else self.seed

    @property
    def draws(self) -> int:
        """How many rearrangements are drawn for one statement where not all can be gone through.

        So many that their number never decides whether something can be shown.
        """
        return draws_for(self.decided.alpha, DRAWS, len(self.block.items))

    @property
    def draws_over_all(self) -> int:
        """How many are drawn for the one test over all statements."""
        return draws_for(self.decided.alpha, DRAWS if self.n <= MANY else FEWER_DRAWS)


def asked(
    study: Study, block: Block, seed: int, each: Callable[[str], object], failures: Failures, *, planning: bool = True
) -> Asked:
    """Collect a block's answers; ``each`` is told every statement that is begun."""
    answers = study.answers(block)
    people = tuple(sorted(map(str, answers["participant"].unique())))
    by_item = dict(iter(answers.groupby("item", sort=False)))
    empty = answers.iloc[:0]
    given = {
        item.id: presentations(by_item.get(item.id, empty), people, block.columns, item.id) for item in block.items
    }
    single = {item: answers_ for item, (answers_, _) in given.items()}
    sessions = {item: numbers for item, (_, numbers) in given.items()}
    return of_tables(
        block, study.decided, people, single, sessions, seed=seed, each=each, failures=failures, planning=planning
    )


def of_tables(
    block: Block,
    decided: Decided,
    people: tuple[str, ...],
    single: Mapping[str, Array],
    sessions: Mapping[str, Array] | None = None,
    *,
    seed: int = 1,
    each: Callable[[str], object] = str,
    failures: Failures | None = None,
    planning: bool = True,
    verdicts_only: bool = False,
) -> Asked:
    """Return a block's answers from tables of single answers (participants, settings, presentations) of each item.

    Without ``sessions``, arrays of the same shape, all answers are of one session.
    """
    return Asked(
        block,
        decided,
        people,
        {item: medians(answers) for item, answers in single.items()},
        seed,
        each,
        Failures() if failures is None else failures,
        single,
        {item: np.ones_like(answers) for item, answers in single.items()} if sessions is None else sessions,
        planning,
        verdicts_only,
    )


def head(study: Study | None, answers: Asked) -> dict[str, Any]:
    """Return what every block's finding says: settings, statements, counts; without a study no measures."""
    block = answers.block
    measures, no_measures = answers.attempt(MEASURES, lambda: _measures(study, block), ())
    counts, no_counts = answers.attempt(COUNTS, lambda: presented(answers.single.values()), (0, 0))
    numbers, no_numbers = answers.attempt(NUMBERS, lambda: session_numbers(answers.sessions.values()), ())
    (by_session, absent), failed = answers.attempt(SESSIONS, lambda: compared_sessions(answers, numbers), ((), ()))
    return {
        "id": block.id,
        "title": block.title,
        "kind": block.kind,
        "revealed": block.revealed,
        "n": answers.n,
        "settings": block.settings,
        "names": tuple(block.name(setting) for setting in block.settings),
        "items": block.items,
        "labels": block.labels,
        "measures": measures,
        "presentations": counts,
        "replicated_ms": _replicated(block),
        "sessions": numbers,
        "by_session": by_session,
        "absent": (*no_measures, *no_counts, *no_numbers, *absent, *failed),
    }


def _measures(study: Study | None, block: Block) -> tuple[dict[str, Any], ...]:
    return tuple(
        {str(name): None if pd.isna(value) else value for name, value in row.items()}
        for row in ([] if study is None else study.aggregate(block).to_dict("records"))
    )


def presented(single: Iterable[Array]) -> tuple[int, int]:
    """Return the fewest and the most single answers that a participant gave to one statement on one setting."""
    counts = np.concatenate([(~np.isnan(values)).sum(axis=2).ravel() for values in single] or [np.zeros(0)])
    given = counts[counts > 0]
    return (int(given.min()), int(given.max())) if len(given) else (0, 0)


def session_numbers(sessions: Iterable[Array]) -> tuple[int, ...]:
    """Return the numbers of the sessions in which answers were given."""
    return tuple(sorted({int(one) for numbers in sessions for one in np.unique(numbers[~np.isnan(numbers)])}))


def _replicated(block: Block) -> tuple[float, ...]:
    """Return the delays that were presented under more than one condition."""
    if block.kind != "delays" or not block.revealed:
        return ()
    columns = list(block.columns.values())
    return tuple(delay for place, delay in enumerate(block.delays_ms) if columns.count(place) > 1)


def compared_sessions(answers: Asked, numbers: Sequence[int]) -> tuple[tuple[Tested, ...], tuple[NotTested, ...]]:
    """Test in every statement whether sessions are answered alike, by the participants who came to all of them.

    A participant's answers in a session are their median over the settings that he or she answered in all sessions.
    """
    if len(numbers) < 2:
        return (), ()
    outcomes = {}
    for item in answers.block.items:
        answers.each(f"{item.short}, sessions")
        each = np.stack(
            [
                medians(np.where(answers.sessions[item.id] == number, answers.single[item.id], np.nan))[:, :, None]
                for number in numbers
            ],
            axis=2,
        )[..., 0]
        common = np.asarray(~np.isnan(each).any(axis=2))
        levels = medians(np.where(common[..., None], each, np.nan).transpose(0, 2, 1))
        outcomes[item.id] = (
            paired(levels[:, 0], levels[:, 1], alpha=answers.decided.alpha)
            if len(numbers) == 2
            else friedman(levels, draws=answers.draws, seed=answers.seed)
        )
    ps = in_family(
        outcomes, answers.decided.alpha, f"{answers.block.id}: sessions", false_discovery, FDR, primary=False
    )
    if all(one.outcome.n == 0 for one in ps):
        return (), (NotTested(SESSIONS, f"nobody answered the same setting in all of sessions {numbers}"),)
    return ps, ()


def sealed(study: Study, answers: Asked) -> BlockFound:
    """Return what may be known before the key is opened: counts, and whether settings differ at all, by code."""
    waiting = ["comparison of two settings", "test over all statements", "test of recognition"]
    if answers.block.kind == "delays":
        waiting = ["test of a trend (Page)", "lowest delay that shows", "test of equivalence", "detection threshold"]
    (omnibus, absent), failed = answers.attempt(OMNIBUS, lambda: compared(answers), ((), ()))
    told = head(study, answers)
    absent = (*told.pop("absent"), *absent, *failed, *(NotTested(what, SEALED) for what in waiting))
    return BlockFound(**told, omnibus=omnibus, absent=absent)


def compared(answers: Asked) -> tuple[tuple[Tested, ...], tuple[NotTested, ...]]:
    """Test in every statement whether the settings are answered alike."""
    if answers.k < 2:
        return (), (NotTested("test of settings", "the block has one setting: there is nothing to compare it with"),)
    return judged(
        _each(answers, lambda values: _omnibus(values, answers)),
        answers.decided,
        f"{answers.block.id}: settings differ",
    ), ()


def _omnibus(values: Array, answers: Asked) -> Outcome:
    if answers.k == 2:
        return paired(values[:, 0], values[:, 1], alpha=answers.decided.alpha)
    return friedman(values, draws=answers.draws, seed=answers.seed)


def over_all(answers: Asked, draws: int | None = None) -> Outcome | None:
    """Test once over all statements whether the settings are answered alike; ``draws`` of them if not as usual."""
    if answers.k < 2 or (answers.verdicts_only and draws is None):
        return None
    answers.each("all statements")
    return global_permutation(
        np.array(list(answers.values.values())), draws=draws or answers.draws_over_all, seed=answers.seed
    )


def asked_again(
    answers: Asked, columns: Array | None, what: str
) -> tuple[tuple[Tested, ...], tuple[Tested, ...], tuple[NotTested, ...]]:
    """Return the same questions under other assumptions: the mixed model, and with missing answers; and what is not.

    ``columns`` (settings, columns) are what the mixed model tests, ``what`` names it.
    """
    if answers.verdicts_only:
        return (), (), ()
    absent = []
    mixed: tuple[Tested, ...] = ()
    reason = _no_model(answers)
    if reason:
        absent.append(NotTested(f"mixed model of {what}", reason))
    else:
        models = {}
        for item in answers.block.items:
            answers.each(item.short)
            models[item.id] = ordinal(answers.single[item.id], columns, sessions=answers.sessions[item.id])
        mixed = tuple(
            alone(model, item, answers.decided, f"{answers.block.id}: mixed model") for item, model in models.items()
        )
    gaps = {item: values for item, values in answers.values.items() if np.isnan(values).any()}
    incomplete: tuple[Tested, ...] = ()
    if gaps and answers.k >= 3:
        incomplete = tuple(
            alone(
                skillings_mack(values, draws=answers.draws, seed=answers.seed),
                item,
                answers.decided,
                f"{answers.block.id}: with missing answers",
            )
            for item, values in gaps.items()
        )
    elif gaps:
        absent.append(NotTested("test with incomplete participants", "it needs three settings"))
    return mixed, incomplete, tuple(absent)


def _no_model(answers: Asked) -> str:
    if answers.k < 2:
        return "there is one setting"
    if answers.n < FEW:
        return f"with {told(answers.n)}, below {FEW}, its estimates and errors would not hold"
    if answers.n > MANY:
        return f"it is left out above {MANY} participants, where it takes minutes"
    return ""


def _each(answers: Asked, test: Callable[[Array], Outcome]) -> dict[str, Outcome]:
    found = {}
    for item in answers.block.items:
        answers.each(item.short)
        found[item.id] = test(answers.values[item.id])
    return found
