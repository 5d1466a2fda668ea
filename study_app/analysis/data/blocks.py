"""What a study asks: blocks, their settings, statements, levels and questions, and what was decided beforehand.

While the key is sealed a setting is its code and nothing else. Texts are in English where the study has it, otherwise
in its first language.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, Self, TypeAlias, get_args

from study_app.analysis.wording import significant
from study_app.errors import AnalysisError
from study_app.protocol.blocks import Compared, Phase
from study_app.protocol.model import Analysis, Contrast, Protocol, Published
from study_app.protocol.orders.block_orders import every_step_of, follows_in
from study_app.protocol.presented.presentation import link_descriptions
from study_app.protocol.questionnaires import Score
from study_app.protocol.questions import Context, Question, Scale, Statement, question_of
from study_app.protocol.table import text_in
from study_app.protocol.tracks import design_of, has_correct_answer, method_of, stimulus_of, success_name
from study_app.protocol.trials.designs import KINDS as DESIGN_KINDS
from study_app.protocol.trials.designs import Design, default_design
from study_app.protocol.trials.methods import Method
from study_app.protocol.trials.stimuli import DELAY, OF_LINK, Assumed, Stimulus, assumed_for, rises
from study_app.store.blinded.blinding import Key, complete_protocol

Kind: TypeAlias = Compared

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

_DELAY_PREFIX: Final = "D"
"""Codes of delay settings are D1, D2 …: what tells a block of delays in sealed receipts of earlier versions."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Item:
    """One statement: its id, its words, and a few words for figures."""

    id: str
    text: str
    short: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What was presented under a code; all but the code is None until the key is opened.

    ``label`` is the item that names what was felt, where one does, ``link`` how its force was sent if not promptly,
    ``view`` what was seen, empty for the drawn tank. A track ("8/1") has neither liquid nor delay, but the condition
    ``of`` which it varies a number.
    """

    code: str
    condition: str | None = None
    liquid: str | None = None
    delay_ms: float | None = None
    label: str | None = None
    link: str = ""
    view: str = ""
    of: Self | None = None

    @property
    def standard(self) -> str | None:
        """What a track's comparisons are compared with; None of a condition, and of a track without a standard."""
        standard, is_track, _ = (self.condition or "").partition("/")
        return standard or None if is_track else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A main block with a questionnaire: ``settings`` in code order, once known in the order of the conditions.

    ``kind`` is what the block compares, as its receipt says. ``labels`` name the seven levels, lowest first;
    ``cannot_judge`` is the answer off the scale, or None.
    """

    id: str
    title: str
    kind: Kind
    settings: tuple[Setting, ...]
    items: tuple[Item, ...]
    labels: tuple[str, ...]
    cannot_judge: str | None

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the settings, in their order."""
        return tuple(setting.code for setting in self.settings)

    @property
    def columns(self) -> dict[str, int]:
        """The column of each code in tables of answers: conditions of one delay are replicates of it, in one column."""
        if self.kind == "delays" and self.revealed:
            return {setting.code: self.delays_ms.index(setting.delay_ms or 0.0) for setting in self.settings}
        return {code: place for place, code in enumerate(self.codes)}

    @property
    def delays_ms(self) -> tuple[float, ...]:
        """The delays of the settings, each once, shortest first; 0 while they are not known."""
        return tuple(sorted({setting.delay_ms or 0.0 for setting in self.settings}))

    @property
    def codes_as_dealt(self) -> tuple[str, ...]:
        """The codes of the settings in the order of the codes."""
        return tuple(sorted(self.codes, key=lambda code: (len(code), code)))

    @property
    def revealed(self) -> bool:
        """Whether the settings' conditions are known."""
        return all(setting.condition is not None for setting in self.settings)

    def name(self, setting: Setting) -> str:
        """Return what a figure calls a setting."""
        return setting_name(setting, self.settings)


def settings_of(key: Key) -> dict[tuple[str, str], Setting]:
    """Return what the opened key says of every code: (block id, code) → setting."""
    return {
        (block, code): _setting(key, block, code, presented)
        for block, codes in key.codes.items()
        for code, presented in codes.items()
    }


def _setting(key: Key, block: str, code: str, presented: str) -> Setting:
    """Return what a code stands for: a condition, or a track of a design such as "8/1", with its standard."""
    conditions = key.tables["conditions"]
    if presented in conditions:
        return _of_condition(conditions[presented], code, presented)
    stimulus = key.tables["stimuli"][key.tables["blocks"][block]["stimulus"]]
    name = stimulus["condition"] or next(iter(conditions))
    of = _of_condition(conditions[name], name, name)
    return Setting(code=code, condition=presented, of=replace(of, delay_ms=None) if stimulus["vary"] == DELAY else of)


def _of_condition(condition: Mapping[str, Any], code: str, name: str) -> Setting:
    liquids = " + ".join(condition["liquids"] if condition["liquid"] is None else [condition["liquid"]])
    link = ", ".join(link_descriptions(*(condition.get(key, 0.0) for key in OF_LINK)))
    view = condition.get("view", "tank") + (" alone" if condition.get("overlay") == "hidden" else "")
    view = "" if view == "tank" else view
    return Setting(
        code=code,
        condition=name,
        liquid=liquids,
        delay_ms=float(condition["delay_ms"]),
        label=condition.get("label"),
        link=link,
        view=view,
    )


def main_blocks(protocol: Mapping[str, Any], key: Key | None) -> tuple[Block, ...]:
    """Read the main blocks that ask something, in the order of the session, from a protocol as a receipt holds it."""
    asked = [protocol["blocks"][step] for step in every_step_of(protocol) if step in protocol["blocks"]]
    return tuple(
        _block(protocol, block, spoken(protocol), key)
        for block in asked
        if block["phase"] == "main" and block["questionnaire"] is not None and _statements(protocol, block)
    )


def _statements(protocol: Mapping[str, Any], block: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the statements of a block's questionnaire, which have no kind."""
    return [item for item in protocol["questionnaires"][block["questionnaire"]]["items"] if "kind" not in item]


def spoken(protocol: Mapping[str, Any]) -> str:
    """Return the language of figures and tables: English where the study has it, otherwise its first."""
    languages = list(protocol["study"]["languages"])
    return "en" if "en" in languages else str(languages[0])


def _block(protocol: Mapping[str, Any], block: Mapping[str, Any], language: str, key: Key | None) -> Block:
    questionnaire = protocol["questionnaires"][block["questionnaire"]]
    scale = protocol["scales"][questionnaire["scale"]]
    off_scale = scale["cannot_judge"]
    settings = _settings_in(protocol, block["id"], key)
    kind: Kind = block.get("compares") or ("delays" if block["code_prefix"] == _DELAY_PREFIX else "liquids")
    if key is not None:
        kind = _opened(key, block["id"], block["codes"], block.get("compares"))[1]
    return Block(
        id=block["id"],
        title=text_in(block["title"], language),
        kind=kind,
        settings=settings,
        items=tuple(
            Item(id=item["id"], text=text_in(item["text"], language), short=text_in(item["short"], language))
            for item in _statements(protocol, block)
        ),
        labels=tuple(scale["labels"][language]),
        cannot_judge=None if off_scale is None else text_in(off_scale, language),
    )


def _settings_in(protocol: Mapping[str, Any], block: str, key: Key | None) -> tuple[Setting, ...]:
    """Return the settings of a block: in code order, once known in the order of the conditions."""
    table = protocol["blocks"][block]
    if key is None:
        return tuple(Setting(code=code) for code in table["codes"])
    return _opened(key, block, table["codes"], table.get("compares"))[0]


def setting_name(setting: Setting, others: Sequence[Setting]) -> str:
    """Return what a figure calls a setting: its code, or its liquid and, where they differ, its view and delay."""
    if setting.liquid is None or setting.delay_ms is None:
        return setting.code if setting.standard is None else f"Standard {setting.standard}"
    liquid = setting.liquid.replace("_", " ")
    named = liquid[:1].upper() + liquid[1:]
    named = f"{named}, {setting.view or 'tank'}" if len({other.view for other in others}) > 1 else named
    named = f"{named}, {setting.delay_ms:g} ms" if len({other.delay_ms for other in others}) > 1 else named
    return f"{named}, {setting.link}" if setting.link else named


def _opened(key: Key, block: str, codes: Sequence[str], kind: Kind | None) -> tuple[tuple[Setting, ...], Kind]:
    """Return the settings by name: delays ascending, others in the order of the protocol's conditions.

    Without ``kind``, in receipts of earlier versions, one liquid under several delays is a block of delays.
    """
    known = settings_of(key)
    settings = [known[block, code] for code in codes]
    if kind is None:
        delays = {setting.delay_ms for setting in settings}
        kind = "delays" if len(delays) > 1 and len({setting.liquid for setting in settings}) == 1 else "liquids"
    if kind == "delays":
        return tuple(sorted(settings, key=lambda setting: setting.delay_ms or 0.0)), "delays"
    order = list(key.tables["conditions"])
    if any(setting.condition not in order for setting in settings):  # tracks, by their standards
        return tuple(
            sorted(settings, key=lambda setting: float((setting.condition or "").partition("/")[0] or 0))
        ), "liquids"
    return tuple(sorted(settings, key=lambda setting: order.index(setting.condition))), kind


def published_words(published: Published) -> str:
    """Return a published value with what is known of it."""
    known = [
        *([] if published.standard is None else [f"standard {published.standard:g}"]),
        *([] if published.low is None or published.high is None else [f"{published.low:g} to {published.high:g}"]),
        *([] if published.percent is None else [f"at {published.percent:g} % correct"]),
        *([] if published.n is None else [f"n = {published.n}"]),
    ]
    source = f"{published.source}: " if published.source else ""
    return f"{source}{published.measure} {published.value:g}" + (f" ({', '.join(known)})" if known else "")


def compared_percent(published: Iterable[Published]) -> float | None:
    """Return the percentage of successes at which published thresholds were measured; None: unknown, or several."""
    percents = {one.percent for one in published if one.measure in {"weber", "threshold"}}
    return percents.pop() if len(percents) == 1 else None


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnDynamics:
    """The device's own damping [N·s/m], friction [N] and mass [kg], as ``devices bench`` measured them.

    Means over axes, and over those ``sessions`` of all ``of`` whose receipts record them.
    """

    damping_nspm: float
    friction_n: float
    mass_kg: float
    sessions: int
    of: int


@dataclass(frozen=True, slots=True)
class LevelBlock:
    """A block with a design.

    ``stimulus`` is what it varies, ``method`` how its levels were chosen: None where it compares conditions, and while
    the key is sealed; ``published`` are the values of other studies that the protocol compares it with;
    ``wrong_most`` is the share of incorrect answers to catch trials that is permitted, None without catch trials.
    """

    id: str
    title: str
    phase: Phase
    design: Design
    stimulus: Stimulus | None
    settings: tuple[Setting, ...]
    method: Method | None = None
    published: tuple[Published, ...] = ()
    wrong_most: float | None = None

    @property
    def has_correct_answer(self) -> bool:
        """Whether an answer can be correct."""
        return has_correct_answer(self.design, self.stimulus)

    @property
    def counts(self) -> str:
        """What the share of answers at a level is of."""
        return success_name(self.design, self.stimulus)

    @property
    def standards_rove(self) -> bool:
        """Whether trials of several standards alternate."""
        standards = {setting.standard for setting in self.settings}
        return len(standards) > 1 and self.method is not None and self.method.order == "interleaved"

    @property
    def assumed(self) -> Assumed | None:
        """What is assumed about its psychometric function; None where no answer enters one, or the key is sealed."""
        if self.stimulus is None or not rises(self.stimulus, self.design):
            return None
        if self.method is None:
            return assumed_for(self.stimulus, self.design)
        return self.method.assumed(self.stimulus, self.design)


def contrasts_of(key: Key) -> tuple[Contrast, ...]:
    """Return the contrasts that the opened key holds."""
    return tuple(Contrast.model_validate(one) for one in key.tables.get("analysis", {}).get("contrasts", ()))


def level_blocks(protocol: Mapping[str, Any], key: Key | None) -> tuple[LevelBlock, ...]:
    """Return the blocks with a design of the protocol in a receipt, in the order of the session; ``key`` is open."""
    steps = [step for step in every_step_of(protocol) if "slots" in protocol["blocks"].get(step, {})]
    whole = complete_protocol(protocol, key) if key is not None and steps else None
    return tuple(_level_block(protocol, step, key, whole) for step in steps)


def _level_block(protocol: Mapping[str, Any], step: str, key: Key | None, whole: Protocol | None) -> LevelBlock:
    table = protocol["blocks"][step]
    stimulus: Stimulus | None = None
    method: Method | None = None
    published: tuple[Published, ...] = ()
    if whole is not None:
        block = whole.blocks[step]
        design = design_of(whole, block)
        if block.stimulus is not None:
            stimulus, method = stimulus_of(whole, block), method_of(whole, block)
        if whole.analysis is not None:
            published = tuple(published for published in whole.analysis.published if published.block == step)
    elif (written := protocol.get("designs", {}).get(table["design"])) is not None:
        design = DESIGN_KINDS[written["kind"]].model_validate(written)
    else:
        design = default_design(table["design"])
    title = text_in(table["title"], spoken(protocol))
    return LevelBlock(
        step, title, table["phase"], design, stimulus, _settings_in(protocol, step, key), method, published,
        (table.get("catch") or {}).get("wrong_most"),
    )  # fmt: skip


_Direction: TypeAlias = Literal["increasing", "decreasing"]
Spending: TypeAlias = Literal["obrien-fleming", "pocock"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Decided:
    """The protocol's table ``analysis``.

    ``made`` is False where there was none; ``changed`` where sessions were run under different ones, of which this is
    the first: in both cases everything found is exploratory. Where ``looks`` are planned, ``alpha`` is that of the
    number ``look`` of them (0: before the first one, where everything is exploratory, too), and ``planned_alpha`` that
    of all.
    """

    made: bool
    changed: bool
    alpha: float
    equivalence_bound: float | None
    primary: tuple[str, ...]
    names: tuple[str, ...]
    rising: tuple[str, ...]
    falling: tuple[str, ...]
    noticed: str | None
    looks: tuple[int, ...] = ()
    spending: Spending = "obrien-fleming"
    look: int | None = None
    planned_alpha: float | None = None
    trends: Literal["ranks", "slopes"] = "ranks"

    @property
    def binding(self) -> bool:
        """Whether it was decided before the first session, and kept to."""
        return self.made and not self.changed and self.look != 0

    @property
    def alphas(self) -> tuple[float, ...]:
        """The significant p at each planned look."""
        from study_app.analysis.statistics.outcome import alpha_of_looks  # noqa: PLC0415 - loads scipy

        alpha = self.planned_alpha or self.alpha
        return alpha_of_looks(self.looks, alpha, self.spending) if self.looks else (alpha,)

    def at(self, n: int) -> Self:
        """Return what holds with so many participants: at the last planned look that they reach."""
        look = sum(planned <= n for planned in self.looks)
        alpha = self.alphas[max(look, 1) - 1]
        return replace(self, alpha=alpha, look=look, planned_alpha=self.alpha) if self.looks else self

    def alpha_words(self) -> str:
        """Return the planned alpha, and what is left of it at a look."""
        if self.planned_alpha is None:
            return f"{self.alpha:g}"
        return f"{self.planned_alpha:g} over all looks, {significant(self.alpha)} at this one"

    def look_words(self, n: int) -> str:
        """Return which planned look a study of ``n`` participants is at, in sentences; nothing where none is planned.

        A number that is not planned is called unplanned, with the error rate of testing at every number.
        """
        if self.look is None:
            return ""
        planned = f"{' and '.join([', '.join(map(str, self.looks[:-1])), str(self.looks[-1])])} participants"
        if self.look == 0:
            return f"Looks are planned at {planned}; none has been reached, so all results are exploratory."
        if n not in self.looks:
            from study_app.analysis.statistics.outcome import error_of_every_report  # noqa: PLC0415 - loads scipy

            alpha = self.planned_alpha or self.alpha
            return (
                f"This look at {n} participants is unplanned: looks are planned at {planned}. An adjusted p ≤ "
                f"{significant(self.alpha)} is significant, as at the last planned look. A study without an effect "
                "that is tested at every number of participants in this way makes a false claim in "
                f"{100 * error_of_every_report(self.looks, alpha, self.spending):.1f} % of cases instead of "
                f"{100 * alpha:g} %."
            )
        return (
            f"This is look {self.look} of {len(self.looks)}, planned at {planned}. An adjusted p ≤ "
            f"{significant(self.alpha)} is significant (alpha is shared by {SPENDINGS[self.spending]} spending)."
        )

    def is_primary(self, item: str) -> bool:
        """Whether a statement is one that the study is about."""
        return self.binding and (not self.primary or item in self.primary)

    def direction(self, item: str) -> _Direction | None:
        """Return where answers to a statement were expected to go as delay grows; None: nothing was expected."""
        return "increasing" if item in self.rising else "decreasing" if item in self.falling else None


TRENDS: Final = {
    "ranks": "a sign-flip permutation test on the participants' rank correlations of answers and delays",
    "slopes": "Student's t test on the slopes of each participant's own regression of answers on delays",
}
"""How a trend over the delay is tested, in words."""

SPENDINGS: Final[Mapping[Spending, str]] = {"obrien-fleming": "O'Brien–Fleming", "pocock": "Pocock"}
NOTHING_DECIDED: Final = Decided(
    made=False,
    changed=False,
    alpha=0.05,
    equivalence_bound=None,
    primary=(),
    names=(),
    rising=(),
    falling=(),
    noticed=None,
)


def decisions(protocol: Protocol) -> Decided:
    """Return what a protocol decides, the defaults where it has no table."""
    return read_decided([(protocol.analysis or Analysis()).model_dump(mode="json")])


def read_decided(tables: Sequence[Mapping[str, Any] | None]) -> Decided:
    """Return what the sessions' receipts say was decided."""
    first = tables[0]
    changed = any(table != first for table in tables)
    if first is None:
        return replace(NOTHING_DECIDED, changed=changed)
    try:
        bound, noticed = first["equivalence_bound"], first["noticed"]
        return Decided(
            made=True,
            changed=changed,
            alpha=float(first["alpha"]),
            equivalence_bound=None if bound is None else float(bound),
            primary=tuple(map(str, first["primary"])),
            names=tuple(map(str, first["names"])),
            rising=tuple(map(str, first["rising"])),
            falling=tuple(map(str, first["falling"])),
            noticed=None if noticed is None else str(noticed),
            looks=tuple(map(int, first.get("looks", ()))),
            spending=first.get("spending", "obrien-fleming"),
            trends=first.get("trends", "ranks"),
        )
    except (KeyError, TypeError, ValueError) as error:
        raise AnalysisError(
            f"a receipt does not contain the decisions about the analysis ({type(error).__name__}, {error}): it "
            "was changed, or written by another version of the program; restore it from a copy"
        ) from error


START: Final = "0"
"""The code of a form before the first block, which no block has as its id."""


@dataclass(frozen=True, slots=True)
class QuestionPlace:
    """Where questions were asked: after the trials of a block, with its ``settings``, or in a form.

    A form that sessions have several times has a setting for each block that it comes after, others have none.
    """

    id: str
    title: str
    is_form: bool
    settings: tuple[Setting, ...]

    def name(self, setting: Setting) -> str:
        """Return what tables and figures call a setting."""
        return setting.label or "" if self.is_form else setting_name(setting, self.settings)


@dataclass(frozen=True, slots=True)
class PlacedQuestion:
    """A question, and where it was asked."""

    where: QuestionPlace
    question: Question
    context: Context

    @property
    def id(self) -> str:
        """The id of its item."""
        return self.question.id

    @property
    def text(self) -> str:
        """Its words."""
        return self.context.text(self.question.text)

    @property
    def short(self) -> str:
        """A few words for it."""
        return self.context.text(self.question.short)

    @property
    def levels(self) -> dict[str, str]:
        """All answers with their words, where these are few."""
        return self.question.levels(self.context)

    @property
    def bounds(self) -> tuple[float, float] | None:
        """The smallest and the largest number it can be answered with."""
        return self.question.bounds(self.context)

    @property
    def cannot_judge(self) -> str | None:
        """The answer off the scale, or None."""
        return getattr(self.question.view(0, self.context), "cannot_judge", None)


@dataclass(frozen=True, slots=True)
class PlacedScore:
    """A score of a questionnaire, with the questions that it is computed of."""

    where: QuestionPlace
    name: str
    instrument: str | None
    score: Score
    questions: tuple[PlacedQuestion, ...]


@dataclass(frozen=True, slots=True)
class OtherQuestions:
    """What a study asked besides statements after trials."""

    questions: tuple[PlacedQuestion, ...] = ()
    scores: tuple[PlacedScore, ...] = ()


NO_QUESTIONS: Final = OtherQuestions()


def other_questions(protocol: Mapping[str, Any], key: Key | None) -> OtherQuestions:
    """Read them from a protocol as a receipt holds it, in the order of the session."""
    if protocol.get("format", 1) < 2:
        return NO_QUESTIONS
    questions: list[PlacedQuestion] = []
    scores: list[PlacedScore] = []
    scales = {name: Scale.model_validate(table) for name, table in protocol["scales"].items()}
    for where, table in _questionnaires(protocol, key):
        context = Context(scales, table.get("scale"), spoken(protocol))
        placed = tuple(PlacedQuestion(where, _question(item, where), context) for item in table["items"])
        questions += [question for question in placed if where.is_form or not isinstance(question.question, Statement)]
        scores += [
            PlacedScore(where, name, table.get("instrument"), Score.model_validate(score), placed)
            for name, score in table.get("scores", {}).items()
        ]
    return OtherQuestions(tuple(questions), tuple(scores))


def _questionnaires(protocol: Mapping[str, Any], key: Key | None) -> Iterator[tuple[QuestionPlace, Mapping[str, Any]]]:
    language = spoken(protocol)
    for step in every_step_of(protocol):
        if step in protocol["blocks"]:
            block = protocol["blocks"][step]
            if block["phase"] == "main" and block["questionnaire"] is not None:
                title = text_in(block["title"], language)
                where = QuestionPlace(step, title, False, _settings_in(protocol, step, key))
                yield where, protocol["questionnaires"][block["questionnaire"]]
        elif step in protocol["questionnaires"]:
            table = protocol["questionnaires"][step]
            titled = table["title"] is not None
            title = text_in(table["title"], language) if titled else step.replace("_", " ").capitalize()
            after = follows_in(protocol, step)
            titles = {name: text_in(block["title"], language) for name, block in protocol["blocks"].items()}
            labels = ((START, "At the start") if name is None else (name, f"After {titles[name]}") for name in after)
            settings = tuple(Setting(code=name, condition=name, label=label) for name, label in labels)
            yield QuestionPlace(step, title, True, settings), table


def _question(table: Mapping[str, Any], where: QuestionPlace) -> Question:
    try:
        return question_of(table)
    except (KeyError, ValueError) as error:
        raise AnalysisError(
            f"question {table.get('id')!r} of {where.id!r} has a kind that this version does not know "
            f"({table.get('kind')}): use the version that ran the study"
        ) from error
