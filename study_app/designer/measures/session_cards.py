"""Cards about a session: its length, the balance of its orders, what a hand feels, its texts, what people can show."""

from collections.abc import Mapping, Sequence
from typing import Final

from study_app.designer.document.changes import languages_of
from study_app.designer.document.elements import title_of
from study_app.designer.document.fields import label_of
from study_app.designer.document.names import blocks_using
from study_app.designer.document.study import Study
from study_app.designer.document.study_facts import Facts
from study_app.designer.measures.balance import balance_of
from study_app.designer.measures.number_cards import (
    FAILED,
    LIMIT_NAMES,
    NO_FORCES,
    ON_AVERAGE,
    UNKNOWN,
    BalanceCard,
    BlocksCard,
    Line,
    LinesCard,
    SessionCard,
    TextsCard,
    Verdict,
    people,
)
from study_app.designer.measures.participant_texts import copied_texts, own_texts, revealing, texts_by_language
from study_app.designer.measures.planned import Simulated
from study_app.designer.measures.valid_part import valid_part
from study_app.haptics.model.gate import calls_for
from study_app.haptics.model.slope_limits import HAND_MPS, steady
from study_app.number_text import counted, duration, duration_figure, duration_range
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import order_of
from study_app.protocol.orders.durations import answering_s
from study_app.protocol.source.document import Path
from study_app.protocol.wording.languages import language_name

SQUARE_NAMES: Final = {"williams": "Williams design", "latin": "Latin square"}
MOST_CODES: Final = 8
"""Of more codes only how even they are is said."""
MOST_ROWS: Final = 6
"""Positions that are shown of a long block."""


def session_card(study: Study, facts: Facts, path: Path, parts: int | None = None) -> SessionCard:
    """Return the session in numbers, with the step that is looked at.

    Parameters
    ----------
    study : Study
        The study.
    facts : Facts
        Its facts.
    path : tuple of str or int
        The selected element.
    parts : int, optional
        On how many parts its questions stand on a small screen.
    """
    verdicts = (*_fit(parts), *text_verdicts(study, facts))
    if facts.expected_s is None or facts.range_s is None:
        unknown = tuple((UNKNOWN, word) for word in ("min", "answers", "trials"))
        return SessionCard("Session", unknown, verdicts=verdicts)
    figures = (
        duration_figure(facts.expected_s),
        (str(facts.answers), _word(facts.answers, "answer")),
        (str(facts.trials), _word(facts.trials, "trial")),
    )
    whole = max(1e-9, sum(facts.steps_s.values()))
    chosen = str(path[1]) if len(path) > 1 else ""
    segments = tuple(
        (f"{_title(study, step)} {duration(step_s)}", step_s / whole, step == chosen, _path(study, step))
        for step, step_s in facts.steps_s.items()
    )
    longest = sorted(facts.steps_s, key=lambda step: -facts.steps_s[step])[:2]
    named = [chosen, *(one for one in longest if one != chosen)][:2] if chosen in facts.steps_s else longest
    notes = tuple(f"{_title(study, step)} {duration(facts.steps_s[step])}" for step in facts.steps_s if step in named)
    breaks = counted(facts.breaks, "break") if facts.breaks else ""
    least_to_most = duration_range(*facts.range_s)
    aside = ", ".join(filter(None, (least_to_most if " to " in least_to_most else "", breaks)))
    return SessionCard("Session", figures, aside, segments, notes, verdicts)


def questions_card(protocol: Protocol, name: str, parts: int | None) -> SessionCard:
    """Return a questionnaire in numbers: each time it is asked, and in a session."""
    questionnaire = protocol.questionnaires[name]
    count = len(questionnaire.items)
    blocks = [block for block in protocol.blocks_in_order if block.questionnaire == name]
    times = sum(order_of(protocol, block).trials for block in blocks) + (name in protocol.forms)
    figures = (duration_figure(answering_s(questionnaire)), (str(count), _word(count, "answer")))
    asked: Verdict = ("neutral", "info", f"{count * times} answers per session, asked {times} {_word(times, 'time')}")
    if not times:
        asked = ("warn", "warning", "It is never asked")
    return SessionCard("Each time it is asked", figures, verdicts=(*_fit(parts), asked))


def blocks_card(
    study: Study, protocol: Protocol, facts: Facts, path: Path, measured: Mapping[str, str], shown: str
) -> BlocksCard | None:
    """Return the blocks that use an element that is not one of them; None where none does.

    Parameters
    ----------
    study : Study
        The study.
    protocol : Protocol
        What of it is valid.
    facts : Facts
        Its facts.
    path : tuple of str or int
        The element; the study and its settings concern every block.
    measured : mapping
        What each block measures, in words.
    shown : str
        The block whose numbers are shown, "" where none are.
    """
    if path[:1] == ("blocks",) and len(path) > 1:
        return None
    used = list(protocol.blocks) if len(path) < 2 else blocks_using(study.document, path)
    lines = []
    for block in protocol.blocks_in_order:
        if block.id in used:
            lasts = facts.steps_s.get(block.id)
            known = (measured.get(block.id), None if lasts is None else duration(lasts))
            words = ", ".join(filter(None, (*known, "shown here" if block.id == shown else "")))
            lines.append((f"Block {_title(study, block.id)}: {words}", ("blocks", block.id)))
    if not lines:
        return None
    title = "Blocks of the study" if len(path) < 2 else f"Blocks that use {title_of(study.document, path[:2])}"
    return BlocksCard(title, tuple(dict.fromkeys(lines)))


def _word(count: int | None, word: str) -> str:
    return word if count == 1 else f"{word}s"


def _fit(parts: int | None) -> tuple[Verdict, ...]:
    """Return whether questions fit on one page; nothing where that is not known."""
    if parts is None:
        return ()
    if parts == 1:
        return (("ok", "check", "One page, no scrolling at 1366 × 768"),)
    return (("neutral", "info", f"{parts} pages at 1366 × 768"),)


def block_card(study: Study, facts: Facts, protocol: Protocol, block: Block) -> SessionCard:
    """Return a block in numbers."""
    order, questionnaire = order_of(protocol, block), protocol.questionnaire_of(block.id)
    answers = 0 if questionnaire is None else len(questionnaire.items)
    duration_s = facts.steps_s.get(block.id)
    figures = (
        (UNKNOWN, "min") if duration_s is None else duration_figure(duration_s),
        (str(order.trials), _word(order.trials, "trial")),
        (str(order.trials * answers), _word(order.trials * answers, "answer")),
    )
    aside = counted(order.breaks, "break") if order.breaks else ""
    return SessionCard(_title(study, block.id), figures, aside)


def text_verdicts(study: Study, facts: Facts) -> Sequence[Verdict]:
    """Return whether texts are missing, and whether a text reveals a condition."""
    if study.unreadable:
        return ()
    missing = ", ".join(f"{count} in {language_name(code)}" for code, count in facts.missing.items())
    codes = languages_of(study)
    languages = " and ".join(language_name(code) for code in codes) if len(codes) < 3 else f"{len(codes)} languages"
    found: list[Verdict] = [("bad", "warning", f"Missing texts: {missing}")]
    if not missing:
        found = [("ok", "check", f"Every text in {languages}")]
    if copied := ", ".join(f"{count} in {language_name(code)}" for code, count in copied_texts(study).items()):
        found = [*(found if missing else ()), ("neutral", "info", f"Texts to translate: {copied}")]
    if (protocol := valid_part(study).protocol) is not None:
        revealed = revealing(study, protocol)
        named = f"{revealed[0].element}: “{revealed[0].word}” reveals a condition" if revealed else ""
        more = f", and {len(revealed) - 1} more" if len(revealed) > 1 else ""
        found.append(("warn", "warning", named + more) if revealed else ("ok", "check", "No text reveals a condition"))
    return found


def balance_card(
    study: Study, protocol: Protocol, block: Block, participants: int, planned: int | None = None
) -> BalanceCard | None:
    """Return how even the orders of a block are over so many participants; None where it has one code."""
    judged = balance_of(protocol, block, participants)
    if judged is None:
        return None
    evenness, rows, who = judged.evenness, judged.rows, people(participants, planned)
    if evenness.balanced:
        verdict: Verdict = ("ok", "check", "balanced")
        if rows is not None:
            rounds = counted(participants // rows, "round")
            verdict = ("ok", "check", f"balanced: {participants} participants are {rounds} of {rows}")
    elif rows is not None and participants % rows:
        even = " or ".join(str(one) for one in (judged.last_even, judged.next_even) if one)
        verdict = ("warn", "warning", f"balanced with {even} participants, for a {SQUARE_NAMES[judged.order]}")
    elif rows is not None:
        verdict = ("warn", "warning", "positions balanced, carry-over not")
    elif judged.order == "fixed":
        verdict = ("warn", "warning", "all participants have the same order, which reveals the codes")
    else:
        verdict = ("neutral", "info", "balanced on average only: drawn for each session")
    title = _title(study, block.id)
    if len(evenness.codes) > MOST_CODES:
        cells = [count for line in evenness.positions for count in line]
        after = evenness.after_another
        words = f"positions {min(cells)} to {max(cells)} times, carry-over {min(after)} to {max(after)} times"
        return BalanceCard(title, who, (), (), (), 0, (*verdict[:2], f"{verdict[2]}; {words}"))
    shown = evenness.positions[:MOST_ROWS]
    return BalanceCard(
        title, who, evenness.codes, shown, evenness.follows, len(evenness.positions) - len(shown), verdict
    )


def force_card(study: Study, facts: Facts, protocol: Protocol, names: Sequence[str]) -> LinesCard:
    """Return the force of some liquids against a hand at 0.1 m/s."""
    if not valid_part(study).forces:
        unknown = tuple(Line(_title(study, name, "liquids"), UNKNOWN, 0.0) for name in names)
        return LinesCard("Force of each liquid", "", unknown, (("neutral", "minus", NO_FORCES),))
    limit_n = protocol.device.force_limit_n
    lines = []
    for name in names:
        it = steady(protocol.scene_of(name), HAND_MPS)
        verdict: Verdict = ("ok", "check", "not clipped")
        if it.limit is not None:  # in the colour of the limit
            verdict = ("warn" if it.limit == "norm" else "bad", "warning", f"clipped by the {LIMIT_NAMES[it.limit]}")
        lines.append(
            Line(_title(study, name, "liquids"), f"{it.force_n:.2f} N", min(1.0, it.force_n / limit_n), verdict)
        )
    alike = [one for one in facts.warnings if "hard to tell apart" in one and any(name in one for name in names)]
    sentences: tuple[Verdict, ...] = tuple(("warn", "warning", _sentence(one)) for one in alike)
    if not sentences and len(names) > 1:
        sentences = (("ok", "check", "No pair is hard to tell apart"),)
    return LinesCard("Force of each liquid", f"0.1 m/s, {LIMIT_NAMES['norm']} {limit_n:g} N", tuple(lines), sentences)


def effects_card(study: Study, protocol: Protocol, name: str) -> LinesCard:
    """Return which effects act in a liquid, with their bounds, and why others do not."""
    verdicts = [one for one in calls_for(protocol.scene_of(name)) if one.liquid == name]
    lines = tuple(
        Line(
            label_of(one.effect), f"{one.bound_n:.3g} N", one.share,
            ("ok", "check", f"in: {one.why}") if one.included else ("neutral", "minus", f"out: {one.why}"),
        )
        for one in verdicts
    )  # fmt: skip
    said = tuple((*line.verdict[:2], f"{line.title}, {line.verdict[2]}") for line in lines)
    return LinesCard(f"Effects in {_title(study, name, 'liquids')}", "largest force of each", lines, said)


def texts_card(study: Study) -> TextsCard:
    """Return how many texts each language has, and the texts that reveal a condition."""
    lines = []
    counts = texts_by_language(study)
    with_own = own_texts(study, counts)
    for code, (there, wanted) in counts.items():
        own = with_own[code][0]
        parts = (wanted - there, "missing"), (there - own, "to translate")
        words = ", ".join(f"{count} {what}" for count, what in parts if count)
        verdict: Verdict = ("bad", "warning", words) if there < wanted else ("neutral", "info", words)
        if own == wanted:
            verdict = ("ok", "check", "complete")
        lines.append(Line(language_name(code), f"{own} of {wanted}", own / max(1, wanted), verdict))
    protocol = valid_part(study).protocol
    found = () if protocol is None else revealing(study, protocol)
    revealed = tuple((f"{one.element}, {one.key.lower()}: “{one.word}”", one.path) for one in found)
    return TextsCard(tuple(lines), revealed)


def detectable_card(study: Study, block: Block, who: str, simulated: Simulated) -> LinesCard:
    """Return the smallest difference of each statement that studies of so many participants (``who``) show."""
    title, found = "Smallest differences", simulated.detectable
    if not valid_part(study).forces:  # what is answered depends on them
        return LinesCard(title, who, (), (("neutral", "minus", NO_FORCES),))
    if found is None and simulated.failed:
        return LinesCard(title, who, (), (FAILED, ("neutral", "info", simulated.failed)))
    if found is None:
        return LinesCard(title, who, (), (("neutral", "clock", "Studies are simulated."),), simulated.waiting)
    items = study.document.get("questionnaires", {}).get(block.questionnaire, {}).get("items", ())
    places = {item.get("id"): at for at, item in enumerate(items)}
    lines = []
    for one in found.findings:
        path: Path = ("questionnaires", str(block.questionnaire), "items", places.get(one.item, 0))
        name = title_of(study.document, path)
        number = UNKNOWN if one.detectable is None else f"{one.detectable:.1f}"
        lines.append(Line(name, number, (one.detectable or 0.0) / (found.points - 1)))
    model = (
        f"The smallest difference, in points of {found.points}, that 4 of 5 simulated studies show. The answers are a "
        "model's, not measured."
    )
    note: Verdict = ("neutral", "info", model)
    if not lines:
        note = ("neutral", "info", "The answer model knows none of the statements.")
    return LinesCard(title, who, tuple(lines), (note,), simulated.waiting)


def warnings_card(facts: Facts, more: Sequence[str]) -> LinesCard | None:
    """Return the warnings of ``check``; None where there are none.

    ``more`` are those about a precision that is not reached, which take simulated observers.
    """
    sentences: list[Verdict] = [("warn", "warning", _sentence(one)) for one in (*facts.warnings, *more)]
    if more:
        sentences.append(("neutral", "info", f"{ON_AVERAGE}."))
    return LinesCard("Warnings", "of check", (), tuple(sentences)) if sentences else None


def _title(study: Study, name: str, section: str = "") -> str:
    return title_of(study.document, _path(study, name, section))


def _path(study: Study, name: str, section: str = "") -> Path:
    sections = (section,) if section else ("blocks", "pages", "questionnaires")
    return next((one for one in sections if name in study.document.get(one, {})), "blocks"), name


def _sentence(words: str) -> str:
    """Return words as a sentence; a place in the file, such as "designs.pair.feedback:", stays as it is."""
    place = "." in words.partition(":")[0].partition(" ")[0]
    return f"{words if place else words[:1].upper() + words[1:]}."
