"""The sentences of the methods paragraph on practice trials and breaks, from the receipts and the recorded trials."""

from collections.abc import Iterator, Mapping
from typing import Any

from study_app.analysis.data.study_tables import Study
from study_app.analysis.wording import listed
from study_app.number_text import counted
from study_app.protocol.blocks import Criterion, block_titles
from study_app.protocol.participants import RecordedSessions


def practice_sentences(study: Study) -> Iterator[str]:
    """Yield a sentence on each practice block: its trials, the criterion that ended it, and feedback."""
    blocks = study.protocol.get("blocks", {})
    levels = {level.id: level for level in study.levels}
    practice = {name for name, table in blocks.items() if table.get("phase") == "practice"}
    for name, title in block_titles(study.protocol).items() if practice else ():
        if name not in practice or not (trials := _presented_trials(study, name)):
            continue
        level = levels.get(name)
        shows_feedback = level is not None and level.has_correct_answer and level.design.shows_feedback(True)
        feedback = " with feedback after every trial" * shows_feedback
        table = blocks[name].get("until")
        criterion = None if table is None else Criterion.model_validate(table)
        ended = "" if criterion is None else f"; practice ended {criterion.condition_text('were')}"
        if criterion is not None and criterion.missed == "end":
            ended += "; if this never happened, the session ended"
        yield f"Participants completed {trials} in “{title}”{feedback}{ended}."


def _presented_trials(study: Study, block: str) -> str:
    """Return the number of a participant's trials in a block, "10 to 14 practice trials"; "" if there are none."""
    rows = study.trials[(study.trials["block"] == block) & study.trials["participant"].isin(study.people)]
    numbers = rows.drop_duplicates(["participant", "session", "trial"])["participant"].value_counts()
    if numbers.empty:
        return ""
    minimum, maximum = int(numbers.min()), int(numbers.max())
    trials = counted(maximum, "practice trial")
    return trials if minimum == maximum else f"{minimum} to {trials}"


def break_sentence(study: Study) -> str:
    """Return a sentence on the breaks in and between blocks; "" without any."""
    protocol = study.protocol
    blocks, pages = protocol.get("blocks", {}), protocol.get("pages", {})
    by_interval: dict[tuple[int, str], list[str]] = {}
    with_breaks = {name for name, table in blocks.items() if table.get("break_page") and table.get("phase") == "main"}
    for name, title in block_titles(protocol).items() if with_breaks else ():
        if name in with_breaks:
            table = blocks[name]
            interval = int(table["break_every"]), _shortest_break_text(pages[table["break_page"]])
            by_interval.setdefault(interval, []).append(f"“{title}”")
    breaks = [
        f"a break{shortest} after every {counted(every, 'trial') if every > 1 else 'trial'} of {listed(titles)}"
        for (every, shortest), titles in by_interval.items()
    ]
    if between := _breaks_between_blocks(protocol):
        breaks.append(between)
    return f"Participants had {listed(breaks)}." if breaks else ""


def _breaks_between_blocks(protocol: Mapping[str, Any]) -> str:
    """Return a phrase on the break pages among the steps of a session; "" without any, or if sessions differ."""
    pages = protocol.get("pages", {})
    if protocol.get("groups") or protocol.get("sessions"):
        return ""
    steps = RecordedSessions.model_validate(protocol).steps
    breaks = [pages[step] for step in steps if pages.get(step, {}).get("kind") == "break"]
    if not breaks:
        return ""
    texts = {_shortest_break_text(page) for page in breaks}
    shortest = next(iter(texts)) if len(texts) == 1 else ""
    return f"{'a break' if len(breaks) == 1 else f'{len(breaks)} breaks'}{shortest} between parts of the session"


def _shortest_break_text(page: Mapping[str, Any]) -> str:
    shortest_s = page.get("min_s") or 0
    return f" of at least {shortest_s:g} s" if shortest_s else ""
