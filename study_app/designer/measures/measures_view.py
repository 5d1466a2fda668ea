"""What the tab Measures shows for the selected element, and the cards below the other tabs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from study_app.designer.document.elements import SEQUENCE, title_of
from study_app.designer.document.study import Study
from study_app.designer.measures.cards import (  # fmt: skip
    NARROW_CODES,
    UNKNOWN,
    Figures,
    Line,
    Lines,
    MeasureCard,
    NumberCard,
    Part,
    Segment,
    Segments,
    Table,
    Verdict,
)
from study_app.designer.measures.levels import LIMIT_NAMES, LevelBlock, LevelWords, level_block, rounded
from study_app.designer.measures.simulation import (
    ENOUGH,
    Controls,
    Focus,
    Simulated,
    balance_of,
    focus_of,
    hypotheses_of,
)
from study_app.designer.measures.study_facts import Facts, copied_texts, revealing_texts, valid_part
from study_app.designer.problems import ProblemRow
from study_app.haptics.model.slope_limits import HAND_MPS, steady_force
from study_app.number_text import capitalised, counted, duration, duration_figure, duration_range
from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.orders.block_orders import BlockOrder, order_of
from study_app.protocol.source.document import Path
from study_app.protocol.wording.languages import language_name, languages_of

_BELOW: Final = 4
"""So many cards stay below the other tabs."""
_SQUARE_NAMES: Final = {"williams": "Williams design", "latin": "Latin square"}
_MOST_CODES: Final = 8
"""Of more codes only how even they are is said."""
_MOST_ROWS: Final = 6
"""Positions that are shown of a long block."""
NO_FORCES: Final = "Unknown until you correct the problems of device and scene."
_ON_AVERAGE: Final = "The warning of check refers to the average precision with the planned participants"
FAILED: Final[Verdict] = ("bad", "warning", "simulation failed")
_CLIPPED: Final[Verdict] = ("bad", "warning", "levels are clipped")
_TOO_SMALL: Final = "All levels are below twice the level error of a valid trial"


@dataclass(frozen=True, slots=True)
class MeasuresView:
    """What the tab shows: numbers and plots of a block with a method, else cards; and the cards below other tabs.

    ``words`` are those of the levels where observers are simulated, ``levels`` those whose forces are drawn, and
    ``problems`` theirs, each with the words of its repairs. ``hypotheses`` are those of the block, or of the
    study; ``earlier``: all is of the last study without faults.
    """

    controls: Controls
    words: LevelWords | None = None
    numbers: tuple[NumberCard, ...] = ()
    levels: LevelBlock | None = None
    simulated: Simulated = field(default_factory=Simulated)
    problems: tuple[tuple[ProblemRow, tuple[str, ...]], ...] = ()
    cards: tuple[MeasureCard, ...] = ()
    hypotheses: MeasureCard | None = None
    earlier: bool = False

    @property
    def below(self) -> tuple[MeasureCard, ...]:
        """The cards that stay below other tabs; the measures tab shows them if it has no numbers."""
        return self.cards[:_BELOW]


def measures_view(
    study: Study,
    facts: Facts,
    path: Path,
    controls: Controls,
    simulated: Simulated,
    problems: Mapping[ProblemRow, tuple[str, ...]],
    *,
    earlier: bool = False,
) -> MeasuresView:
    """Return the measures of the selected element.

    ``problems`` has the words of the repairs of each as far as they were found, ``earlier`` says that the study is the
    last one without faults.
    """
    valid = valid_part(study)
    protocol, focus = valid.protocol, focus_of(valid.protocol, path)
    if protocol is None:
        cards = _cards(study, facts, path, focus, controls, simulated)
        return MeasuresView(controls, simulated=simulated, cards=tuple(cards), earlier=earlier)
    block, plan = focus.block, focus.plan
    asked = _hypotheses_card(protocol, path, controls, simulated)
    levels = None if block is None else level_block(protocol, block, forces=valid.forces)
    wording = None if plan is None else LevelWords(plan.stimulus, plan.design)
    of = None if block is None else ("stimuli", str(block.stimulus), "levels")
    own = tuple((row, repairs) for row, repairs in problems.items() if row.fault.path == of)
    if block is not None and levels is not None and plan is not None:
        lasts = facts.steps_s.get(block.id, 0.0)
        numbers = _number_cards(levels, simulated, controls, lasts, order_of(protocol, block))
        cards = [_session_card(study, facts, path)]
    else:
        numbers, cards = (), _cards(study, facts, path, focus, controls, simulated)
    return MeasuresView(controls, wording, numbers, levels, simulated, own, tuple(cards), asked, earlier)


def _cards(
    study: Study, facts: Facts, path: Path, focus: Focus, controls: Controls, simulated: Simulated
) -> list[MeasureCard]:
    """Return the cards of an element without simulated tracks, the most relevant first."""
    valid, block = valid_part(study), focus.block
    protocol = valid.protocol
    cards: list[MeasureCard] = [_session_card(study, facts, path)]
    if protocol is None:
        return cards
    if block is not None:
        cards += _balance_card(study, protocol, block, controls)
    if block is not None and focus.compares:
        known = simulated.detectable
        who = _people_text(controls.participants if known is None else known.participants, controls.planned)
        cards.append(_detectable_card(study, block, who, simulated))
    cards.append(_force_card(study, facts, protocol, _liquids(protocol, path, block)))
    if block is not None and path[0] == "blocks":
        cards.append(_block_card(study, facts, protocol, block))
    return cards


def _liquids(protocol: Protocol, path: Path, block: Block | None) -> list[str]:
    """Return the liquids of an element, or all liquids if it has none."""
    if path[0] == "liquids" and len(path) > 1 and path[1] in protocol.liquids:
        return [str(path[1])]
    names = () if block is None else protocol.conditions_in(block.id)
    if path[0] == "conditions" and len(path) > 1 and path[1] in protocol.conditions:
        names = (str(path[1]),)
    liquids = dict.fromkeys(liquid for name in names for liquid in protocol.conditions[name].liquid_ids)
    return list(liquids) or list(protocol.liquids)


def _people_text(participants: int, planned: int | None) -> str:
    """Return the number of simulated participants, and whether the file plans as many."""
    return f"{participants} {'planned' if participants == planned else 'simulated'}"


def _number_cards(
    of: LevelBlock, simulated: Simulated, controls: Controls, duration_s: float, order: BlockOrder
) -> tuple[NumberCard, ...]:
    """Return the four number cards of a block with simulated tracks."""
    breaks = f", {counted(order.breaks, 'break')}" if order.breaks else ""
    figure, unit = duration_figure(duration_s)
    return (
        _range_card(of, simulated, controls),
        _one_person_card(of, simulated),
        _group_card(of, simulated, controls),
        NumberCard(
            "Lasts", figure, unit=unit, note=("neutral", "clock", f"{order.trials} trials{breaks}"), simulated=False
        ),
    )


def _unknown_card(title: str, unit: str, simulated: Simulated) -> NumberCard:
    """Return the card of an unknown number: not simulated yet, failed, or never simulated."""
    if simulated.failed:
        return NumberCard(title, UNKNOWN, unit=unit, note=FAILED, more=simulated.failed)
    return NumberCard(title, UNKNOWN, unit=unit, note=("neutral", "info", "not simulated"))


def _range_card(of: LevelBlock, simulated: Simulated, controls: Controls) -> NumberCard:
    title, measurable, wording = (f"{capitalised(of.words.name)}s it can measure", simulated.measurable, of.words)
    if measurable is None:
        return _unknown_card(title, wording.unit, simulated)
    clipped = of.clipped_words
    if measurable.ends is None:
        if measurable.planted:
            return NumberCard(title, "none", unit="", note=("bad", "warning", "estimates are biased"), more=clipped)
        if of.clipping is None:
            return NumberCard(title, "none", unit="", note=("bad", "warning", "levels are too small"), more=_TOO_SMALL)
        why = "the standard is clipped" if of.clipping.clips_standard else _CLIPPED[2]
        return NumberCard(title, "none", unit="", note=("bad", "warning", why), more=clipped)
    low, high = measurable.ends
    note: Verdict = ("neutral", "info", f"of {wording.number(of.words.stimulus.levels[1])} {wording.unit} at most")
    if wording.stimulus.level_kind == "weber" and of.standard is not None:
        values = (rounded(level * of.standard, 2) for level in (low, high))
        note = ("neutral", "info", f"{' to '.join(values)} {wording.value_unit}")
    if not low * 0.999 <= controls.threshold <= high * 1.001:
        note = ("warn", "warning", f"not {wording.words(controls.threshold)}")
    return NumberCard(
        title, f"{wording.number(low, 2)} – {wording.number(high, 2)}", unit=wording.unit, note=note, more=clipped
    )


def _one_person_card(of: LevelBlock, simulated: Simulated) -> NumberCard:
    observed = simulated.observed
    if observed is None:
        return _unknown_card("One person", "%", simulated)
    if not of.can_measure(observed.threshold):
        return NumberCard("One person", UNKNOWN, unit="%", note=_CLIPPED, more=of.clipped_words)
    note: Verdict = ("neutral", "people", f"at a {of.words.name} of {of.words.words(observed.threshold)}")
    return NumberCard("One person", f"± {100 * observed.error:.0f}", unit="%", note=note, more=of.as_asked)


def _group_card(of: LevelBlock, simulated: Simulated, controls: Controls) -> NumberCard:
    precision = simulated.group
    if precision is None:
        title = f"{_people_text(controls.participants, controls.planned)} in ± {100 * controls.precision:g} %"
        return _unknown_card(title, "% of studies", simulated)
    title = f"{_people_text(precision.participants, controls.planned)} in ± {100 * precision.precision:g} %"
    if not of.can_measure(controls.threshold):
        return NumberCard(title, UNKNOWN, unit="% of studies", note=_CLIPPED, more=of.clipped_words)
    enough = precision.share >= ENOUGH
    note: Verdict = ("ok", "check", "Enough") if enough else ("warn", "warning", "Not enough")
    many = f"more than {precision.most}" if precision.enough is None else f"about {precision.enough}"
    needed = f"{100 * ENOUGH:g} % are enough" if enough else f"Needed: {many} participants for {100 * ENOUGH:g} %"
    more = f"{needed}; with {precision.more_trials} trials: {100 * precision.more_share:.0f} %"
    more = ". ".join(filter(None, (more, _ON_AVERAGE if simulated.warnings else "", of.as_asked)))
    return NumberCard(title, f"{100 * precision.share:.0f}", unit="% of studies", note=note, more=more)


def _session_card(study: Study, facts: Facts, path: Path) -> MeasureCard:
    """Return the session in numbers, with the duration of the selected step."""
    verdicts = _text_verdicts(study, facts)
    if facts.expected_s is None or facts.range_s is None:
        unknown = tuple((UNKNOWN, word) for word in ("min", "answers", "trials"))
        return MeasureCard("Session", "", (Figures(unknown), *_below_rule(verdicts)))
    figures = (
        duration_figure(facts.expected_s),
        (str(facts.answers), _noun(facts.answers, "answer")),
        (str(facts.trials), _noun(facts.trials, "trial")),
    )
    whole = max(1e-9, sum(facts.steps_s.values()))
    chosen = str(path[1]) if len(path) > 1 else ""
    segments = tuple(
        Segment(f"{_title(study, step)} {duration(step_s)}", step_s / whole, step == chosen, _path(study, step))
        for step, step_s in facts.steps_s.items()
    )
    longest = sorted(facts.steps_s, key=lambda step: -facts.steps_s[step])[:2]
    named = [chosen, *(step for step in longest if step != chosen)][:2] if chosen in facts.steps_s else longest
    notes = tuple(f"{_title(study, step)} {duration(facts.steps_s[step])}" for step in facts.steps_s if step in named)
    breaks = counted(facts.breaks, "break") if facts.breaks else ""
    least_to_most = duration_range(*facts.range_s)
    aside = ", ".join(filter(None, (least_to_most if " to " in least_to_most else "", breaks)))
    return MeasureCard("Session", aside, (Figures(figures), Segments(segments, notes), *_below_rule(verdicts)))


def _below_rule(verdicts: Iterable[Verdict]) -> tuple[Part, ...]:
    """Return verdicts below a rule; empty if there are none."""
    return (None, *states) if (states := tuple(verdicts)) else ()


def _hypotheses_card(protocol: Protocol, path: Path, controls: Controls, simulated: Simulated) -> MeasureCard | None:
    """Return the hypotheses about a block, at the session's order all of them, with the simulated results."""
    block = str(path[1]) if path[:1] == ("blocks",) and len(path) > 1 else ""
    contrasts = hypotheses_of(protocol, block) if block or path == SEQUENCE else ()
    known, waiting = dict(simulated.hypotheses), simulated.failed or simulated.waiting or "liquid-study power plans it"
    said = [
        f"{capitalised(contrast.described())}: {known.get(contrast.described(), waiting)}" for contrast in contrasts
    ]
    who = _people_text(controls.participants, controls.planned)
    return (
        MeasureCard("Hypotheses", who, tuple(("neutral", "flag", sentence) for sentence in said), wide=True)
        if said
        else None
    )


def _noun(count: int | None, word: str) -> str:
    return word if count == 1 else f"{word}s"


def _block_card(study: Study, facts: Facts, protocol: Protocol, block: Block) -> MeasureCard:
    """Return a block in numbers."""
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
        verdicts = [("ok", "check", f"Every text in {languages}")]
    if copied := ", ".join(f"{count} in {language_name(code)}" for code, count in copied_texts(study).items()):
        verdicts = [*(verdicts if missing else ()), ("neutral", "info", f"Texts to translate: {copied}")]
    if (protocol := valid_part(study).protocol) is not None:
        revealed = revealing_texts(study, protocol)
        named = f"{revealed[0].element}: “{revealed[0].word}” reveals a condition" if revealed else ""
        more = f", and {len(revealed) - 1} more" if len(revealed) > 1 else ""
        verdicts.append(
            ("warn", "warning", named + more) if revealed else ("ok", "check", "The texts do not reveal a condition")
        )
    return verdicts


def _balance_card(study: Study, protocol: Protocol, block: Block, controls: Controls) -> list[MeasureCard]:
    """Return how balanced the orders of a block are for the participants; none if it has one code."""
    participants = controls.participants
    judged = balance_of(protocol, block, participants)
    if judged is None:
        return []
    order, evenness, rows = judged
    if evenness.balanced:
        verdict: Verdict = ("ok", "check", "balanced")
        if rows is not None:
            rounds = counted(participants // rows, "round")
            verdict = ("ok", "check", f"balanced: {participants} participants are {rounds} of {rows}")
    elif rows is not None and participants % rows:
        last = participants - participants % rows
        even = f"{last} or {last + rows}" if last else f"{rows}"
        verdict = ("warn", "warning", f"balanced with {even} participants, for a {_SQUARE_NAMES[order]}")
    elif rows is not None:
        verdict = ("warn", "warning", "positions balanced, carry-over not")
    elif order == "fixed":
        verdict = ("warn", "warning", "all participants have the same order, which reveals the codes")
    else:
        verdict = ("neutral", "info", "balanced only on average: drawn for each session")
    aside = f"{_title(study, block.id)}, {_people_text(participants, controls.planned)}"
    if len(evenness.codes) > _MOST_CODES:
        cells = [count for line in evenness.positions for count in line]
        after = evenness.after_another
        summary = f"positions {min(cells)} to {max(cells)} times, carry-over {min(after)} to {max(after)} times"
        return [MeasureCard("Balance", aside, ((*verdict[:2], f"{verdict[2]}; {summary}"),))]
    shown, codes = evenness.positions[:_MOST_ROWS], evenness.codes
    places = tuple(str(number + 1) for number in range(len(shown)))
    tables = Table("position", codes, places, shown), Table("comes after", codes, codes, evenness.follows)
    hidden = len(evenness.positions) - len(shown)
    more = (f"and {hidden} more positions",) if hidden else ()
    return [MeasureCard("Balance", aside, (tables, *more, verdict), wide=len(codes) > NARROW_CODES)]


def _lines_card(
    title: str, aside: str, lines: Iterable[Line], sentences: Iterable[Verdict] = (), waiting: str = ""
) -> MeasureCard:
    """Return lines with bars, and sentences below them; grey lines where others are simulated (``waiting``)."""
    rows, said = tuple(lines), tuple(sentences)
    parts = (Lines(rows, grey=bool(waiting)), *_below_rule(said)) if rows else said
    return MeasureCard(title, waiting or aside, parts)


def _force_card(study: Study, facts: Facts, protocol: Protocol, names: Sequence[str]) -> MeasureCard:
    """Return the force of some liquids against a hand at 0.1 m/s."""
    if not valid_part(study).forces:
        unknown = tuple(Line(_title(study, name, "liquids"), UNKNOWN, 0.0) for name in names)
        return _lines_card("Force of each liquid", "", unknown, (("neutral", "minus", NO_FORCES),))
    limit_n = protocol.device.force_limit_n
    lines = []
    for name in names:
        it = steady_force(protocol.scene_of(name), HAND_MPS)
        verdict: Verdict = ("ok", "check", "not clipped")
        if it.limit is not None:  # in the colour of the limit
            verdict = ("warn" if it.limit == "norm" else "bad", "warning", f"clipped by the {LIMIT_NAMES[it.limit]}")
        lines.append(
            Line(_title(study, name, "liquids"), f"{it.force_n:.2f} N", min(1.0, it.force_n / limit_n), verdict)
        )
    alike = [
        warning
        for warning in facts.warnings
        if "hard to tell apart" in warning and any(name in warning for name in names)
    ]
    sentences: tuple[Verdict, ...] = tuple(("warn", "warning", f"{capitalised(warning)}.") for warning in alike)
    if not sentences and len(names) > 1:
        sentences = (("ok", "check", "All pairs are distinguishable"),)
    return _lines_card("Force of each liquid", f"0.1 m/s, {LIMIT_NAMES['norm']} {limit_n:g} N", tuple(lines), sentences)


def _detectable_card(study: Study, block: Block, who: str, simulated: Simulated) -> MeasureCard:
    """Return the smallest difference of each statement that studies of so many participants (``who``) detect."""
    title, detectable = "Smallest differences", simulated.detectable
    if not valid_part(study).forces:  # the answers depend on them
        return _lines_card(title, who, (), (("neutral", "minus", NO_FORCES),))
    if detectable is None and simulated.failed:
        return _lines_card(title, who, (), (FAILED, ("neutral", "info", simulated.failed)))
    if detectable is None:
        return _lines_card(title, who, (), (("neutral", "clock", "Studies are simulated."),), simulated.waiting)
    items = study.document.get("questionnaires", {}).get(block.questionnaire, {}).get("items", ())
    places = {item.get("id"): at for at, item in enumerate(items)}
    lines = []
    for finding in detectable.findings:
        path: Path = ("questionnaires", str(block.questionnaire), "items", places.get(finding.item, 0))
        name = title_of(study.document, path)
        lines.append(Line(name, finding.number, (finding.detectable or 0.0) / (detectable.points - 1)))
    model = (
        f"The smallest difference, in points of {detectable.points}, that 4 of 5 simulated studies detect, if "
        f"people are {detectable.kind} (range: consistent to noisy). The answers come from a model, not from "
        "measurements."
    )
    note: Verdict = ("neutral", "info", model)
    if not lines:
        note = ("neutral", "info", "The answer model does not know these statements.")
    return _lines_card(title, who, tuple(lines), (note,), simulated.waiting)


def _title(study: Study, name: str, section: str = "") -> str:
    return title_of(study.document, _path(study, name, section))


def _path(study: Study, name: str, section: str = "") -> Path:
    sections = (section,) if section else ("blocks", "pages", "questionnaires")
    return next((key for key in sections if name in study.document.get(key, {})), "blocks"), name
