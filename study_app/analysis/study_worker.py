"""The worker process for studies: carry out orders, and send each part of the answer as soon as it is ready."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from study_app.analysis.worker_messages import (
    Answer,
    Done,
    FigureDrawn,
    FindStudies,
    FirstPage,
    LeaveOut,
    OpenKey,
    Order,
    Progress,
    ProposedExclusions,
    ReadStudy,
    SessionsFound,
    StudiesFound,
    StudyAt,
    StudyFound,
    TakeBack,
    WriteReport,
    WriteTables,
)
from study_app.errors import StoreError
from study_app.protocol.participants import EACH_GROUP
from study_app.store import receipt
from study_app.store.exclusions import exclude, include, keep
from study_app.store.files import cannot_read
from study_app.store.merged import all_exclusions, folders_of, locate_participant, sessions_in
from study_app.store.tables import participants_of, study_folders
from study_app.store.unblinding import has_opened_keys, reveals_of, unblind_folder
from study_app.workers.server import Stopped

if TYPE_CHECKING:
    from study_app.analysis.data.study_tables import Study
    from study_app.analysis.page_layout import Picture
    from study_app.analysis.results import Results

# Libraries for an evaluation are imported in functions, so that the list of sessions does not wait for them.

Send: TypeAlias = Callable[[Answer], object]

_EVALUATION: Final = 0.7
"""The evaluation's proportion of the progress after the first figures; the rest is drawing."""


def carry_out(order: Order, send: Send, stop: Callable[[], bool]) -> Done:
    """Carry out an order; raise `Stopped` if ``stop`` returns True before anything is written."""
    match order:
        case FindStudies():
            send(StudiesFound(tuple(_find_studies(order.results))))
        case ReadStudy():
            _read_study(order.folder, send, stop)
        case LeaveOut():
            place = locate_participant(order.folder, order.participant)
            by, reason = order.by, order.reason
            if not isinstance(order, TakeBack):
                exclude(*place, order.session, trial=order.trial, rule=order.rule, by=by, reason=reason)
            elif order.rule:
                keep(*place, order.session, rule=order.rule, by=by, reason=reason)
            else:
                include(*place, order.session, trial=order.trial, by=by, reason=reason)
        case OpenKey():
            show = partial(_send_unstoppable, send)
            opened = unblind_folder(order.folder, by=order.by, reason=order.reason, progress=show)
            return Done(warnings=tuple(line for site in opened.values() for line in site.left))
        case WriteTables() | WriteReport():
            return _write_outputs(order, send, stop)
    return Done()


def _find_studies(results: Path) -> Iterator[StudyAt]:
    """Yield the study folders under ``results``, which need not exist."""
    try:
        folders = list(study_folders(results))
    except FileNotFoundError:
        return
    except OSError as error:
        raise cannot_read(results, error) from error
    for folder in folders:
        try:
            sessions = sessions_in(folders_of(folder).values())
        except StoreError:  # reported when the study is read
            sessions = ()
        first_receipt: dict[str, Any] = {}
        if sessions:
            with contextlib.suppress(StoreError):  # reported when the study is read
                first_receipt = receipt.read(sessions[0].receipt)
        newest = 0.0
        for session in sessions:
            with contextlib.suppress(OSError):
                newest = max(newest, session.path.stat().st_mtime)
        yield StudyAt(folder, bool(first_receipt.get("simulated")), bool(first_receipt.get("pilot")), newest)


def _read_study(folder: Path, send: Send, stop: Callable[[], bool]) -> None:
    """Send the sessions, the study and its figures; if the key is open, evaluate the study and send all figures."""
    send(Progress("reading sessions", 0.0))
    openings = reveals_of(folder) if has_opened_keys(folder) else ()
    send(
        SessionsFound(
            folder, tuple(participants_of(folder)), all_exclusions(folder), openings[-1] if openings else None
        )
    )
    _raise_if_stopped(stop)
    send(Progress("reading answers", 0.1))
    from study_app.analysis.data.study_tables import load_study  # noqa: PLC0415

    study = load_study(folder)
    send(_study_message(study))
    _raise_if_stopped(stop)
    from study_app.analysis.figures import answer_figures  # noqa: PLC0415
    from study_app.analysis.report.study_figures import block_name  # noqa: PLC0415

    for number, block in enumerate(study.blocks if study.n else ()):
        send(Progress("drawing", 0.3 + 0.7 * number / len(study.blocks)))
        message, name = "No completed session has answers in this block yet.", block_name(study, block)
        if len(study.answers(block)):
            send(_figure_message(answer_figures.answers_picture(study, block, name, ("svg",))))
        else:
            send(FigureDrawn(name=name, title=answer_figures.title(block), caption=message))
        _raise_if_stopped(stop)
    drawn = []
    for picture in _question_pictures(study):
        send(_figure_message(picture))
        drawn.append(picture)
        _raise_if_stopped(stop)
    if study.revealed and study.n:
        _evaluate_study(study, drawn, send, stop)
        return
    _send_proposed_exclusions(study, None, send)
    for part in _studies_by_group(study):
        answers = (
            answer_figures.answers_picture(part, block, block_name(study, block), ("svg",))
            for block in part.blocks
            if len(part.answers(block))
        )
        for picture in chain(answers, _question_pictures(part)):
            send(_figure_message(picture, split=part.split))
            _raise_if_stopped(stop)


def _question_pictures(study: Study) -> Iterator[Picture]:
    """Yield the figures of questions outside blocks of statements."""
    from study_app.analysis.figures.question_figures import question_figure_tasks  # noqa: PLC0415
    from study_app.analysis.page_layout import draw_figures  # noqa: PLC0415
    from study_app.analysis.questions import question_results  # noqa: PLC0415

    return draw_figures(question_figure_tasks(study, question_results(study), ("svg",)))


def _groups_to_split(study: Study) -> tuple[str, ...]:
    """Return the groups by which figures can be split; empty unless two groups have participants."""
    from study_app.analysis.data.study_tables import group_counts  # noqa: PLC0415

    groups = tuple(group_counts(study))
    return groups if len(groups) > 1 else ()


def _studies_by_group(study: Study) -> Iterator[Study]:
    """Yield the study with its groups compared, then each group alone."""
    from study_app.analysis.data.study_tables import split_study  # noqa: PLC0415

    if groups := _groups_to_split(study):
        yield from (split_study(study, split) for split in (EACH_GROUP, *groups))


def _figure_message(picture: Picture, **answer: str) -> FigureDrawn:
    """Return the message with a figure; ``answer`` are the fields of a first-page answer that it shows."""
    return FigureDrawn(
        name=picture.name,
        title=picture.title,
        caption=picture.caption,
        svg=picture.files["svg"],
        numbers=picture.numbers,
        **answer,
    )


def _study_message(study: Study) -> StudyFound:
    from study_app import figure_style as style  # noqa: PLC0415

    trials: dict[tuple[str, int], dict[int, str]] = {}
    main = study.trials[study.trials["phase"] == "main"]
    titles = {
        block.id: (block.title, {setting.code: block.name(setting) for setting in block.settings})
        for block in study.blocks
    }
    for participant, session, trial, block, code in main[
        ["participant", "session", "trial", "block", "code"]
    ].itertuples(index=False):
        title, names = titles.get(block, (block, {}))
        trials.setdefault((str(participant), int(session)), {})[int(trial)] = f"{title}, {names.get(code, code)}"
    return StudyFound(
        name=study.name,
        title=study.title,
        n=study.n,
        blocks=len(study.blocks) or len(study.others.questions),
        revealed=study.revealed,
        trials={session: tuple(sorted(descriptions.items())) for session, descriptions in trials.items()},
        doubts=tuple(map(str, study.doubts)),
        colours={
            "text": style.TEXT,
            "text2": style.TEXT_SOFT,
            "text3": style.AXIS,
            "grid": style.GRID,
            "border": style.BORDER,
            "accent": style.ACCENT,
            "band": style.BAND,
            "second": style.SECOND,
            "ctl": style.PARTICIPANT,
            "warn": style.WARN,
            "warn_bg": style.WARN_GROUND,
            "sunk": style.SEALED_GROUND,
            "hover": style.GROUND,
        },
        groups=_groups_to_split(study),
    )


def _send_proposed_exclusions(study: Study, results: Results | None, send: Send) -> None:
    """Send the proposed exclusions, and the sentence on each planned rule."""
    from study_app.analysis.planned_exclusions import rule_sentences, undecided  # noqa: PLC0415

    send(ProposedExclusions(undecided(study, results), rule_sentences(study, results)))


def _evaluate_study(study: Study, drawn: list[Picture], send: Send, stop: Callable[[], bool]) -> None:
    """Run all tests, then send the figures that depend on them, the first page, and the figures by group.

    ``drawn`` are the figures of questions.
    """
    from study_app.analysis.evaluate import evaluate  # noqa: PLC0415
    from study_app.analysis.figures.summary_figures import numbers_of, summary_figure_tasks  # noqa: PLC0415
    from study_app.analysis.page_layout import draw_figures  # noqa: PLC0415
    from study_app.analysis.report.first_page import cards, presented_in  # noqa: PLC0415
    from study_app.analysis.report.study_figures import block_figure_tasks  # noqa: PLC0415
    from study_app.analysis.results import Failures  # noqa: PLC0415

    report_progress = partial(_report_progress, send, stop)
    report_progress("testing", 0.0)
    results = evaluate(study, progress=lambda what, share: report_progress(what, _EVALUATION * share))
    _send_proposed_exclusions(study, results, send)
    numbers = numbers_of(study)
    tasks = chain(block_figure_tasks(study, results, ("svg",)), summary_figure_tasks(study, results, numbers, ("svg",)))
    for number, picture in enumerate(draw_figures(tasks), start=1):
        drawn.append(picture)
        send(_figure_message(picture))
        report_progress("drawing", _EVALUATION + (1 - _EVALUATION) * min(1.0, number / 8))
    presented = Failures().value("the presented liquids", lambda: presented_in(study), {})
    page = []
    for index, card in enumerate(cards(results, numbers, presented)):
        figure, answer = card.figure_of(drawn), " ".join(card.sentences)
        if figure is None:
            shown = FigureDrawn(name=f"answer-{index}", title=card.question, caption=answer, verdict=card.badge)
        else:
            shown = _figure_message(figure, question=card.question, verdict=card.badge, answer=answer)
        send(shown)
        page.append(shown)
    send(FirstPage(tuple(shown.name for shown in page)))
    _draw_groups(study, results, {shown.name: shown.question for shown in page}, send, stop)


def _draw_groups(
    study: Study, results: Results, questions: Mapping[str, str], send: Send, stop: Callable[[], bool]
) -> None:
    """Send the figures by group; ``questions`` are those of the first page by figure.

    The tests in these figures are of all participants.
    """
    from study_app.analysis.evaluate import evaluate  # noqa: PLC0415
    from study_app.analysis.figures.summary_figures import numbers_of, summary_figure_tasks  # noqa: PLC0415
    from study_app.analysis.page_layout import draw_figures  # noqa: PLC0415
    from study_app.analysis.report.study_figures import block_figure_tasks  # noqa: PLC0415

    for number, part in enumerate(_studies_by_group(study)):
        _report_progress(send, stop, "drawing the groups", number / (1 + len(_groups_to_split(study))))
        group_results = results
        if part.split != EACH_GROUP:
            blocks = evaluate(replace(part, levels=(), contrasts=()), recordings=False).blocks
            group_results = replace(results, blocks=blocks)
        tasks = chain(
            block_figure_tasks(part, group_results, ("svg",)),
            summary_figure_tasks(part, group_results, numbers_of(part), ("svg",)),
        )
        for picture in chain(_question_pictures(part), draw_figures(tasks)):
            send(_figure_message(picture, split=part.split, question=questions.get(picture.name, "")))
            _raise_if_stopped(stop)


def _write_outputs(order: WriteTables | WriteReport, send: Send, stop: Callable[[], bool]) -> Done:
    from study_app.analysis.export_study import export  # noqa: PLC0415
    from study_app.analysis.report.write_report import report  # noqa: PLC0415

    warnings: list[str] = []
    write = partial(export, extras=order.extras) if isinstance(order, WriteTables) else report
    written = write(
        order.folder,
        order.to,
        progress=partial(_report_progress, send, stop),
        warn=warnings.append,
        failed=warnings.append,
    )
    return Done(written, tuple(warnings))


def _report_progress(send: Send, stop: Callable[[], bool], what: str, share: float) -> None:
    _raise_if_stopped(stop)
    send(Progress(what, share))


def _send_unstoppable(send: Send, what: str, share: float) -> None:
    send(Progress(what, share, stops=False))


def _raise_if_stopped(stop: Callable[[], bool]) -> None:
    if stop():
        raise Stopped("stopped before anything was written")
