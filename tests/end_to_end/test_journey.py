"""The journey of an answer: given, cut off and resumed, exported, excluded, withdrawn; found where it belongs.

The expected tables are made from the choices that reach the state machine, with pandas, and from no file.
"""

import random
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import pandas as pd
import pyreadstat
import pytest

from study_app.analysis.export_study import export
from study_app.protocol.model import Protocol
from study_app.protocol.orders.schedule import Schedule, build_schedule
from study_app.protocol.questions import NumberView, TextView
from study_app.session.pages import DesignPage, QuestionnairePage
from study_app.session.resume import REHEARSED_SCREENS, resume_at
from study_app.session.simulated.answers_only import DEVICE, Answering, SimulatedTime
from study_app.session.simulated.observers import Choice
from study_app.session.simulated.rehearsal import ConditionFeatures
from study_app.session.transitions.events import Chosen, Event, Submitted
from study_app.session.transitions.table import initial_state
from study_app.store.blinded.allocation import session_protocol
from study_app.store.exclusions import exclude, exclusions, include
from study_app.store.files.folders import StudyFolder
from study_app.store.journals import journal
from study_app.store.journals.journal import SessionClock
from study_app.store.session_progress.progress import progress_of
from study_app.store.sessions.open_session import SessionStore
from study_app.store.sessions.recovery import reopen_store
from study_app.store.unblinding import unblind_folder
from study_app.store.withdrawals import withdraw
from tests.end_to_end.drawn_studies import drawn
from tests.end_to_end.test_any_accepted_study import CutOff, CutOffError
from tests.studies import begun, made_up

PEOPLE = ("P001", "P002", "P003")


class Question(NamedTuple):
    """A question about a trial, or of a form, which may be repeated."""

    participant: str
    trial: int | None
    form: str | None
    time: int
    item: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """The last answer to a question, and the session's times of its first and last choice [s]."""

    value: Any
    first_s: float
    last_s: float
    block: str | None = None
    condition: str | None = None
    phase: str | None = None


@dataclass(slots=True)
class Answers:
    """All answers of a study, by question; ``numbers`` draws values that differ from each other."""

    rng: random.Random
    given: dict[Question, Given] = field(default_factory=dict)
    texts: int = 0


class Participant(Answering):
    """A simulated participant whose typed numbers and texts are all different, and noted."""

    def __init__(self, name: str, answers: Answers, codes: Mapping[str, Mapping[str, str]], *of_session: Any) -> None:
        super().__init__(*of_session)
        self._name, self._noted, self._codes = name, answers, codes
        self._chosen: dict[str, tuple[Any, float, float]] = {}

    def _answers_to(self, page: QuestionnairePage | DesignPage) -> list[Choice]:
        views = {item.id: item for item in page.items}
        return [self._changed(choice, views[choice.item]) for choice in super()._answers_to(page)]

    def _changed(self, choice: Choice, view: object) -> Choice:
        rng = self._noted.rng
        after_s = round(rng.uniform(0.2, 3.0), 3)
        if isinstance(view, TextView) and choice.value is not None:
            self._noted.texts += 1
            return Choice(choice.item, f"{self._name}, text {self._noted.texts}", after_s)
        if isinstance(view, NumberView) and view.most is None and isinstance(choice.value, int | float):
            # Questions may depend on whether a number is at least 4, and estimates are positive.
            least, most = (4.0, 900.0) if choice.value >= 4 else (-900.0 if view.least is None else 0.01, 3.9)
            return Choice(choice.item, round(rng.uniform(least, most), 4), after_s)
        return replace(choice, after_s=after_s)

    def _post(self, event: Event) -> None:
        if isinstance(event, Chosen):
            first_s = self._chosen.get(event.item, (None, event.at_s))[1]
            self._chosen[event.item] = (event.value, first_s, event.at_s)
        elif isinstance(event, Submitted) and isinstance(self.page, QuestionnairePage | DesignPage):
            self._note(self.page)
        super()._post(event)

    def _note(self, page: QuestionnairePage | DesignPage) -> None:
        about: dict[str, Any] = {}
        if page.trial is not None:
            trial = self._trials[page.trial]
            about = {"block": trial.block, "phase": trial.phase, "condition": self._codes[trial.block].get(trial.code)}
        form, time = (page.form, page.time) if isinstance(page, QuestionnairePage) else (None, 1)
        for item, (value, first_s, last_s) in self._chosen.items():
            question = Question(participant=self._name, trial=page.trial, form=form, time=time, item=item)
            self._noted.given[question] = Given(value=value, first_s=first_s, last_s=last_s, **about)
        self._chosen = {}


def session_of(
    study: Protocol, store: SessionStore, kept: Any, felt: ConditionFeatures, passed: SimulatedTime, answers: Answers
) -> None:
    """Hold a session from where its journal ends."""
    start_line = store.lines[0]
    own = session_protocol(store.place.study_folder, store.as_recorded(study), start_line.participant, 1)
    schedule: Schedule = build_schedule(own, start_line.participant, start_line.seed)
    start = resume_at(own, schedule, store.lines, store.key)
    state = initial_state(own, schedule, store.key.codes, start_line.language, start, store.key.nonce)
    of_session = (study, state, kept, passed, lambda block, condition: felt[block, condition])
    Participant(start_line.participant, answers, store.key.codes, *of_session).run()


def hold_sessions(study: Protocol, source: bytes, results: Path, felt: ConditionFeatures, number: int) -> Answers:
    """Hold three sessions; that of P002 is cut off at a random line and resumed."""
    answers = Answers(random.Random(number))  # noqa: S311 - of a test
    shared = {"device": DEVICE, "screens": REHEARSED_SCREENS}
    for person in PEOPLE:
        passed = SimulatedTime()
        values = {"seed": number, "language": study.study.languages[0], "simulated": True, **shared}
        with begun(results, person, study, source, clock=SessionClock(passed.ns), **values) as store:
            if person != "P002":
                session_of(study, store, store, felt, passed, answers)
                continue
            lines = len(journal.read(StudyFolder(results).session("P001", 1).journal))
            with pytest.raises(CutOffError):
                session_of(study, store, CutOff(store, answers.rng.randrange(1, lines)), felt, passed, answers)
        events = journal.read(store.folder.journal)
        passed = SimulatedTime(progress_of(events).t_s)
        again = {"operator": "", "now_ns": passed.ns, "now": datetime.fromisoformat(events[-1].at)}
        with reopen_store(store.folder.path, study, source, **shared, **again) as resumed:
            session_of(study, resumed, resumed, felt, passed, answers)
    return answers


def read_exported(folder: Path, table: str) -> pd.DataFrame:
    """Read an exported table as documented."""
    (path,) = folder.glob(f"*description-{table}_data.csv")
    return pd.read_csv(path, keep_default_na=False, na_values="n/a", dtype={"participant": str, "response": str})


def of_row(row: Mapping[str, Any], times: dict[tuple[str, str, str], int]) -> Question:
    """Return the question of a row of answers; ``times`` counts how often a form was asked."""
    trial = None if pd.isna(row["trial"]) else int(row["trial"])
    form = None if pd.isna(row["form"]) else str(row["form"])
    time = 1
    if form is not None:
        key = (row["participant"], form, row["item"])
        times[key] = time = times.get(key, 0) + 1
    return Question(participant=row["participant"], trial=trial, form=form, time=time, item=row["item"])


def check_responses(table: pd.DataFrame, given: Mapping[Question, Given], excluded: Collection[Question] = ()) -> None:
    """Check that each answer has one counted row with its value and times, unless it is excluded or practice."""
    times: dict[tuple[str, str, str], int] = {}
    counted_rows = set()
    judged_rows = table[(table["counted"] | table["excluded"]) & ~table["phase"].isin(["practice", "baseline"])]
    for row in judged_rows[judged_rows["item"] != "adjustment"].to_dict(
        "records"
    ):  # its value is where the steps led to
        question = of_row(row, times)
        answer = given[question]
        assert question not in counted_rows
        counted_rows.add(question)
        assert row["excluded"] == (question in excluded), question
        if isinstance(answer.value, str | tuple):
            assert row["response"] == (answer.value if isinstance(answer.value, str) else " ".join(answer.value))
        elif answer.value is None:
            assert row["cannot_judge"]
        else:
            assert float(row["value"]) == answer.value, question
        assert row["first_choice_s"] == pytest.approx(answer.first_s, abs=6e-4), question
        assert row["last_change_s"] == pytest.approx(answer.last_s, abs=6e-4), question
    expected = {question for question, answer in given.items() if answer.phase in (None, "main")}
    assert counted_rows == expected


def wide_cells(given: Mapping[Question, Given], columns: Collection[str]) -> Iterator[tuple[str, str, Any]]:
    """Yield participant, column and value of each cell of answers about conditions and of forms asked once."""
    cells: dict[tuple[str, str], list[Any]] = {}
    for question, answer in given.items():
        if question.form is not None:
            name = f"{question.form}__{question.item}"
        elif answer.phase == "main":
            short = f"{question.item}__{answer.condition}"
            name = short if short in columns else f"{answer.block}__{short}"
        else:
            continue
        if name in columns and question.time == 1:
            cells.setdefault((question.participant, name), []).append(answer.value)
    for (person, name), values in cells.items():
        known_values = [value for value in values if value is not None]
        if not known_values:
            yield person, name, None
        elif isinstance(known_values[-1], str | tuple):
            yield person, name, known_values[-1] if isinstance(known_values[-1], str) else " ".join(known_values[-1])
        else:
            yield person, name, median(known_values)


def check_wide(folder: Path, given: Mapping[Question, Given], questions_asked_again: Collection[str]) -> int:
    """Check the cells of the wide tables (CSV, Parquet) and return how many were compared."""
    table = read_exported(folder, "wide").set_index("participant")
    (parquet,) = folder.glob("*-wide_data.parquet")
    typed = pd.read_parquet(parquet).set_index("participant")
    compared = 0
    for person, name, value in wide_cells(given, [*table.columns]):
        if name.split("__")[0] in questions_asked_again:
            continue
        for cell in (table.loc[person, name], typed.loc[person, name]):
            if value is None:
                assert pd.isna(cell), name
            elif isinstance(value, str):
                assert str(cell) == value, name
            else:
                assert float(cell) == value, name
        compared += 1
    return compared


def mentioned(folder: Path, text: str) -> list[Path]:
    """Return the files below a folder in which a text is found."""
    return [path for path in folder.rglob("*") if path.is_file() and text.encode() in path.read_bytes()]


@pytest.mark.slow
@pytest.mark.variants(7)  # odd numbers among them: unblinded studies
@pytest.mark.parametrize("number", range(1000, 1300))
def test_each_answer_is_found_once_where_it_belongs(number: int, tmp_path: Path) -> None:
    text, study = drawn(number)
    file, results = tmp_path / "drawn.toml", tmp_path / "results"
    file.write_text(text, encoding="utf-8", newline="\n")
    answers = hold_sessions(study, file.read_bytes(), results, made_up(str(file)), number)
    if number % 2:
        unblind_folder(results, by="AB", reason="a test")
    export(results, tmp_path / "all", extras=("wide", "parquet", "sav"))
    check_exported(tmp_path / "all", answers.given, inattentive(results, answers), unblinded=number % 2 == 1)
    trials = sorted({question.trial for question in answers.given if question.participant == "P001" and question.trial})
    if trials:
        check_exclusion(results, tmp_path, answers, trials)
    check_withdrawal(results, tmp_path, answers)


def inattentive(results: Path, answers: Answers) -> set[Question]:
    """Return the questions of participants whom unblinding excluded because of missed catch trials."""
    people = {row.participant for row in exclusions(results) if row.trial is None}
    return {question for question in answers.given if question.participant in people}


def check_exported(
    folder: Path, given: Mapping[Question, Given], excluded: Collection[Question], *, unblinded: bool
) -> None:
    """Check the long tables of an export, and of an unblinded study the wide ones, which name conditions."""
    table = read_exported(folder, "responses")
    check_responses(table, given, excluded)
    if unblinded and not excluded:
        check_wide(folder, given, {question.form for question in given if question.time > 1 and question.form})
    (parquet,) = folder.glob("*-responses_data.parquet")
    typed = pd.read_parquet(parquet)
    assert typed["value"].astype(float).equals(table["value"].astype(float))
    unguarded = table["response"].fillna("").str.replace(r"^'(?=[-=+@])", "", regex=True)  # docs/results-folder.md
    assert typed["response"].fillna("").tolist() == unguarded.tolist()
    (sav,) = folder.glob("*-responses_data.sav")
    rows = pyreadstat.read_sav(sav)[0]
    values = table["value"].notna()
    assert rows.loc[values.to_numpy(), "value"].tolist() == table.loc[values, "value"].tolist()


def check_exclusion(results: Path, to: Path, answers: Answers, trials: list[int]) -> None:
    """Exclude a trial and include it again; check the exports."""
    before = inattentive(results, answers)
    if any(question.participant == "P001" for question in before):
        return
    trial = answers.rng.choice(trials)
    exclude(results, "P001", 1, trial=trial, by="AB", reason="a test")
    export(results, to / "without")
    excluded_questions = {
        question for question in answers.given if (question.participant, question.trial) == ("P001", trial)
    }
    check_responses(read_exported(to / "without", "responses"), answers.given, excluded_questions | before)
    include(results, "P001", 1, trial=trial, by="AB", reason="a test")
    export(results, to / "with")
    check_responses(read_exported(to / "with", "responses"), answers.given, before)


def check_withdrawal(results: Path, to: Path, answers: Answers) -> None:
    """Withdraw a participant; check that their texts are erased and that the answers of others are unchanged."""
    texts = {
        name: [
            answer.value
            for question, answer in answers.given.items()
            if question.participant == name and isinstance(answer.value, str) and ", text " in answer.value
        ]
        for name in PEOPLE
    }
    assert all(mentioned(results, text) for values in texts.values() for text in values)
    withdraw(results, "P003", by="AB", reason="asked for it")
    export(results, to / "two")
    remaining = {question: answer for question, answer in answers.given.items() if question.participant != "P003"}
    check_responses(read_exported(to / "two", "responses"), remaining, inattentive(results, answers) & remaining.keys())
    for folder in (results, to / "two"):
        assert not any(mentioned(folder, text) for text in texts["P003"])
