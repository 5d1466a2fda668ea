"""The cards of the selected element in the tab Measures and below the other tabs."""

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from study_app.designer.document.elements import title_of
from study_app.designer.document.study import Study
from study_app.designer.measures.cards import (  # fmt: skip
    FEW_CODES,
    UNKNOWN,
    Figures,
    Line,
    Lines,
    MeasureCard,
    Part,
    Segment,
    Segments,
    Table,
    Verdict,
)
from study_app.designer.measures.levels import LIMIT_NAMES, block_of
from study_app.designer.measures.simulation import Simulated
from study_app.designer.measures.study_facts import (
    PARTICIPANTS,
    Facts,
    copied_texts,
    planned_participants,
    revealing_texts,
    valid_part,
)
from study_app.haptics.model.slope_limits import HAND_MPS, steady_force
from study_app.number_text import capitalised, counted, duration, duration_figure, duration_range
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders import block_balance, order_of
from study_app.protocol.source import Path
from study_app.protocol.wording import language_name, languages_of

_SQUARE_NAMES: Final = {"williams": "Williams design", "latin": "Latin square"}
_MOST_CODES: Final = 8
"""Greatest number of codes in a table; for more, a sentence summarises the counts."""
_MOST_ROWS: Final = 6
"""Greatest number of positions in a table."""
_NO_FORCES: Final = "Unknown until you correct the problems in the device and scene settings."


@dataclass(frozen=True, slots=True)
class MeasuresView:
    """Cards of the selected element and simulated results; ``earlier`` if they are of the last study without faults."""

    cards: tuple[MeasureCard, ...]
    simulated: Simulated
    earlier: bool = False


def measures_view(
    study: Study, facts: Facts, path: Path, simulated: Simulated, *, earlier: bool = False
) -> MeasuresView:
    """Return the measures of the element at ``path``; ``earlier`` if ``study`` is an earlier one without faults."""
    protocol = valid_part(study).protocol
    cards = [_session_card(study, facts, path)]
    if protocol is not None:
        block = block_of(protocol, path)
        if block is not None:
            cards += _balance_card(study, protocol, block)
        cards.append(_force_card(study, facts, protocol, _liquids(protocol, path, block)))
        if block is not None and path[0] == "blocks":
            cards.append(_block_card(study, facts, protocol, block))
    return MeasuresView(tuple(cards), simulated, earlier)


def _liquids(protocol: Protocol, path: Path, block: Block | None) -> list[str]:
    """Return the liquids of an element in file order, else those of its block or of all blocks, else all liquids."""
    if path[0] == "liquids" and len(path) > 1 and path[1] in protocol.liquids:
        return [str(path[1])]
    blocks = protocol.blocks if block is None else (block.id,)
    names = [name for block_id in blocks for name in protocol.conditions_in(block_id)]
    if path[0] == "conditions" and len(path) > 1 and path[1] in protocol.conditions:
        names = [str(path[1])]
    used = {liquid for name in names for liquid in protocol.conditions[name].liquid_ids}
    return [name for name in protocol.liquids if name in used or not used]


def _session_card(study: Study, facts: Facts, path: Path) -> MeasureCard:
    """Return the card with the session's duration, answers, trials and steps, and verdicts on its texts."""
    verdicts = _text_verdicts(study, facts)
    if facts.expected_s is None or facts.range_s is None:
        unknown = tuple((UNKNOWN, word) for word in ("min", "answers", "trials"))
        return MeasureCard("Session", "", (Figures(unknown), *_below_rule(verdicts)))
    figures = (
        duration_figure(facts.expected_s),
        (str(facts.answers), _noun(facts.answers, "answer")),
        (str(facts.trials), _noun(facts.trials, "trial")),
    )
    total_s = max(1e-9, sum(facts.steps_s.values()))
    chosen = str(path[1]) if len(path) > 1 else ""
    segments = tuple(
        Segment(f"{_title(study, step)} {duration(step_s)}", step_s / total_s, step == chosen, _path(study, step))
        for step, step_s in facts.steps_s.items()
    )
    longest = sorted(facts.steps_s, key=lambda step: -facts.steps_s[step])[:2]
    noted_steps = [chosen, *(step for step in longest if step != chosen)][:2] if chosen in facts.steps_s else longest
    notes = tuple(
        f"{_title(study, step)} {duration(facts.steps_s[step])}" for step in facts.steps_s if step in noted_steps
    )
    breaks = counted(facts.breaks, "break") if facts.breaks else ""
    least_to_most = duration_range(*facts.range_s)
    aside = ", ".join(filter(None, (least_to_most if " to " in least_to_most else "", breaks)))
    return MeasureCard("Session", aside, (Figures(figures), Segments(segments, notes), *_below_rule(verdicts)))


def _below_rule(verdicts: Iterable[Verdict]) -> tuple[Part, ...]:
    """Return verdicts below a rule; empty if there are none."""
    return (None, *states) if (states := tuple(verdicts)) else ()


def _noun(count: int | None, word: str) -> str:
    return word if count == 1 else f"{word}s"


def _block_card(study: Study, facts: Facts, protocol: Protocol, block: Block) -> MeasureCard:
    """Return the card with a block's duration, trials, answers and breaks."""
    order, questionnaire = order_of(protocol, block), protocol.questionnaire_of(block.id)
    answers = 0 if questionnaire is None else len(questionnaire.items)
    duration_s = facts.steps_s.get(block.id)
    figures = (
        (UNKNOWN, "min") if duration_s is None else duration_figure(duration_s),
        (str(order.trials), _noun(order.trials, "trial")),
        (str(order.trials * answers), _noun(order.trials * answers, "answer")),
    )
    aside = counted(order.breaks, "break") if order.breaks else ""
    return MeasureCard(_title(study, block.id), aside, (Figures(figures),))


def _text_verdicts(study: Study, facts: Facts) -> Sequence[Verdict]:
    """Return verdicts on missing texts and on texts that reveal a condition."""
    if study.is_unreadable:
        return ()
    missing = ", ".join(f"{count} in {language_name(code)}" for code, count in facts.missing.items())
    codes = languages_of(study.document)
    languages = " and ".join(language_name(code) for code in codes) if len(codes) < 3 else f"{len(codes)} languages"
    verdicts: list[Verdict] = [("bad", "warning", f"Missing texts: {missing}")]
    if not missing:
        verdicts = [("ok", "check", f"Every text is available in {languages}")]
    if copied := ", ".join(f"{count} in {language_name(code)}" for code, count in copied_texts(study).items()):
        verdicts = [*(verdicts if missing else ()), ("neutral", "info", f"Texts to translate: {copied}")]
    if (protocol := valid_part(study).protocol) is not None:
        revealing = revealing_texts(study, protocol)
        sentence = f"in {revealing[0].element}, “{revealing[0].word}” reveals a condition" if revealing else ""
        more = f", and {len(revealing) - 1} more" if len(revealing) > 1 else ""
        verdicts.append(
            ("warn", "warning", sentence + more)
            if revealing
            else ("ok", "check", "The texts do not reveal any condition")
        )
    return verdicts


def _times(counts: Collection[int]) -> str:
    """Return how often something occurs: "1 time", "1 to 2 times"."""
    minimum, maximum = min(counts), max(counts)
    return counted(maximum, "time") if minimum == maximum else f"{minimum} to {maximum} times"


def _balance_card(study: Study, protocol: Protocol, block: Block) -> list[MeasureCard]:
    """Return the card on the balance of a block's orders for the planned participants; none for a single code."""
    planned = planned_participants(study)
    participants = planned or PARTICIPANTS
    balance = block_balance(protocol, block.id, participants)
    if balance is None:
        return []
    order, evenness, rows = balance.order, balance.evenness, balance.rows
    if evenness.balanced:
        verdict: Verdict = ("ok", "check", "balanced")
        if rows is not None:
            repetitions = counted(participants // rows, "time")
            verdict = ("ok", "check", f"balanced: {participants} participants, each of the {rows} orders {repetitions}")
    elif rows is not None and participants % rows:
        lower_count = participants - participants % rows
        suitable_counts = f"{lower_count} or {lower_count + rows}" if lower_count else f"{rows}"
        verdict = ("warn", "warning", f"a {_SQUARE_NAMES[order]} would be balanced with {suitable_counts} participants")
    elif rows is not None:
        verdict = ("warn", "warning", "positions are balanced, but carry-over is not")
    elif order == "fixed":
        verdict = ("warn", "warning", "the order is the same for all participants, which reveals the codes")
    else:
        verdict = ("neutral", "info", "balanced only on average, because a new order is drawn for each session")
    aside = f"{_title(study, block.id)}, {participants} {'participants' if planned is None else 'planned'}"
    if len(evenness.codes) > _MOST_CODES:
        cells = [count for line in evenness.positions for count in line]
        following_counts = evenness.after_another
        summary = (
            f"each code occurs in each position {_times(cells)} and follows every other code {_times(following_counts)}"
        )
        return [MeasureCard("Balance", aside, ((*verdict[:2], f"{verdict[2]}; {summary}"),))]
    shown, codes = evenness.positions[:_MOST_ROWS], evenness.codes
    places = tuple(str(number + 1) for number in range(len(shown)))
    tables = Table("position", codes, places, shown), Table("comes after", codes, codes, evenness.follows)
    hidden_count = len(evenness.positions) - len(shown)
    note = (f"and {counted(hidden_count, 'more position')}",) if hidden_count else ()
    return [MeasureCard("Balance", aside, (tables, *note, verdict), wide=len(codes) > FEW_CODES)]


def _lines_card(title: str, aside: str, lines: tuple[Line, ...], sentences: tuple[Verdict, ...]) -> MeasureCard:
    """Return a card of lines with bars, and verdicts below them."""
    return MeasureCard(title, aside, (Lines(lines), *_below_rule(sentences)))


def _force_card(study: Study, facts: Facts, protocol: Protocol, names: Sequence[str]) -> MeasureCard:
    """Return the card with the force of liquids against a hand at 0.1 m/s."""
    if not valid_part(study).forces:
        unknown = tuple(Line(_title(study, name, "liquids"), UNKNOWN, 0.0) for name in names)
        return _lines_card("Force for each liquid", "", unknown, (("neutral", "minus", _NO_FORCES),))
    limit_n = protocol.device.force_limit_n
    lines = []
    for name in names:
        force = steady_force(protocol.scene_of(name), HAND_MPS)
        verdict: Verdict = ("ok", "check", "not clipped")
        if force.limit is not None:  # the tone is the colour of the limit
            verdict = (
                "warn" if force.limit == "norm" else "bad",
                "warning",
                f"clipped by the {LIMIT_NAMES[force.limit]}",
            )
        lines.append(
            Line(_title(study, name, "liquids"), f"{force.force_n:.2f} N", min(1.0, force.force_n / limit_n), verdict)
        )
    similarity_warnings = [
        warning
        for warning in facts.warnings
        if "hard to tell apart" in warning and any(name in warning for name in names)
    ]
    sentences: tuple[Verdict, ...] = tuple(
        ("warn", "warning", f"{capitalised(warning)}.") for warning in similarity_warnings
    )
    if not sentences and len(names) > 1:
        sentences = (("ok", "check", "All pairs of liquids are distinguishable"),)
    return _lines_card(
        "Force for each liquid", f"0.1 m/s, {LIMIT_NAMES['norm']} {limit_n:g} N", tuple(lines), sentences
    )


def _title(study: Study, name: str, section: str = "") -> str:
    return title_of(study.document, _path(study, name, section))


def _path(study: Study, name: str, section: str = "") -> Path:
    sections = (section,) if section else ("blocks", "pages", "questionnaires")
    return next((key for key in sections if name in study.document.get(key, {})), "blocks"), name
