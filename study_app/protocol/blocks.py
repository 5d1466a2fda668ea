"""Blocks: trials that share a task and a questionnaire, and the order of their conditions."""

from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Final, Literal, Self, TypeAlias

from pydantic import Field, StringConstraints, model_validator

from study_app.haptics.model.ranges import later, within
from study_app.ids import MAX_ID
from study_app.protocol.randomization.sequences import Constraint
from study_app.protocol.source.table import Id, Localised, Table, invalid, text_in

Phase: TypeAlias = Literal["main", "practice", "baseline"]
Order: TypeAlias = Literal["fixed", "shuffled", "constrained", "williams", "latin"]
OrderOfBlocks: TypeAlias = Literal["fixed", "balanced", "random"]
Compared: TypeAlias = Literal["liquids", "delays", "views"]
Kind: TypeAlias = Annotated[str, StringConstraints(pattern=r"^[a-z0-9][a-z0-9_]*$", max_length=MAX_ID)]


_NOT_WITH_DESIGN: Final = ("max_repeats", "min_distance", "questionnaire")
"""Keys of a block without a design: a design draws its own order and asks its own question."""

_CONTENTS: Final = ("a stimulus", "a design", "conditions but no design")
"""The content of a block as text, for each entry of `Block.NOT_WITH`."""
_ROUNDING: Final = 1e-9


class Criterion(Table):
    """The block ends as soon as ``right`` of the last ``of`` answers are correct."""

    right: int = Field(ge=1, le=100, description="How many of the most recent answers must be correct.")
    of: int = Field(ge=1, le=100, description="How many of the most recent answers are considered.")
    missed: Literal["go_on", "end"] = Field(
        default="go_on",
        description="What happens if the criterion is not met. go_on: the session continues; end: the session ends.",
    )

    @model_validator(mode="after")
    def _check_counts(self) -> Self:
        if self.right > self.of:
            raise invalid(f"{self.right} of {self.of} answers cannot be correct: choose at most {self.of}", "right")
        return self

    def condition_text(self, verb: str = "are") -> str:
        """Return when the block ends as a clause; ``verb`` is "are" or "were"."""
        if self.right == self.of:
            answers = "1 answer" if self.of == 1 else f"{self.of} answers in a row"
            return f"as soon as {answers} {'is' if (self.of, verb) == (1, 'are') else verb} correct"
        return f"as soon as {self.right} of the last {self.of} answers {verb} correct"

    @property
    def missed_text(self) -> str:
        """What happens if the criterion is not met, as a clause."""
        end = "ends" if self.missed == "end" else "continues after the last trial"
        return f"if this never happens, the session {end}"


class Catch(Table):
    """Easy trials among the others: participants who answer many of them incorrectly are not attending to the task."""

    share: Annotated[float, within(0.01, 0.5, "from one catch trial per 100 other trials to one per 2")] = Field(
        default=0.1,
        description="Ratio of catch trials to other trials in a track. One catch trial occurs at a random position in "
        "every 1/share trials.",
    )
    wrong_most: Annotated[float, within(0, 1, "a proportion of the catch trials")] = Field(
        default=0.25,
        description="Maximum proportion of catch trials answered incorrectly; above this, the session is excluded.",
    )

    def count(self, trials: int) -> int:
        """Return the number of catch trials that are added to this number of other trials."""
        return int(trials * self.share + _ROUNDING)

    def stretch(self, number: int) -> range:
        """Return the range of slots from which that of catch trial ``number`` (from 0) is drawn, without slot 0."""
        begin, end = (number + int(at / self.share + _ROUNDING) for at in (number, number + 1))
        return range(max(begin, 1), end + 1)


class Block(Table):
    """Trials that share a task and a questionnaire.

    In tables, each condition of a main block has a code, such as L1 if ``code_prefix`` is L; which condition a code
    stands for is random. Practice and baseline blocks have one condition and are announced as such.
    """

    ONE_OF: ClassVar[tuple[tuple[str, str], ...]] = (("conditions", "stimulus"),)
    NOT_WITH: ClassVar[tuple[tuple[tuple[str, ...], tuple[str, ...]], ...]] = (
        (("stimulus",), ("standard", "repetitions", "order", "compares", *_NOT_WITH_DESIGN)),
        (("design",), ("standards", "method", "catch", "order", "compares", *_NOT_WITH_DESIGN)),
        ((), ("standard", "standards", "method", "until", "catch")),
    )
    SECTIONS: ClassVar[tuple[tuple[str, tuple[str, ...]], ...]] = (
        ("Words", ("title", "setting_label")),
        (
            "What is presented",
            ("conditions", "standard", "stimulus", "standards", "design", "method", "until", "catch", "repetitions",
             "order", "max_repeats", "min_distance"),
        ),
        ("In each trial", ("task", "questionnaire")),
        ("Part and blinding", ("phase", "part", "code_prefix", "compares", "replicates")),
        ("Breaks", ("break_every", "break_page")),
    )  # fmt: skip

    id: Id = Field(description="The name of the block's table.")
    phase: Phase = Field(
        default="main",
        description="How the block's data are used. main: analysed; practice: kept but not analysed; baseline: kept "
        "for comparison but not analysed.",
    )
    part: int | None = Field(default=None, ge=1, le=20, description="Part of the study that contains the block.")
    title: Localised = Field(description="Name of the block.")
    setting_label: Localised = Field(
        description="Neutral name for the block's trials; the program adds a number, as in “Liquid setting 1”."
    )
    code_prefix: str | None = Field(default=None, pattern=r"^[A-Z]$", description="First letter of the block's codes.")
    conditions: tuple[Id, ...] = Field(
        default=(), description="The conditions to present, unless the block has a stimulus."
    )
    standard: Id | None = later(
        default=None, description="The reference condition; the design compares the block's other conditions with it."
    )
    stimulus: Id | None = later(
        default=None, description="The stimulus to present at varying levels, instead of conditions."
    )
    standards: tuple[float, ...] = later(
        default=(), max_length=8, description="Which of the stimulus's standards the block presents; default: all."
    )
    design: Kind | None = later(
        default=None,
        description="How a trial is constructed: the name of a table in [designs], or a kind with default settings. "
        "The design randomises the order of trials and asks its own question.",
    )
    method: Kind | None = later(
        default=None,
        description="How levels are chosen: the name of a table in [methods], or a kind with default settings.",
    )
    until: Criterion | None = later(default=None, description="When the block ends early; default: never.")
    catch: Catch | None = later(
        default=None,
        description="Easy trials that check attention, and the rule for excluding participants; default: none.",
    )
    compares: Compared | None = Field(
        default=None,
        description="How the conditions of a main block differ. liquids: in their liquids; delays: in their delays "
        "(the default if all have the same liquid but different delays); views: in their views (the default if "
        "all have the same liquid but different views). With views, the delays may differ too.",
    )
    replicates: bool = Field(
        default=False,
        description="Whether a block that compares delays may have several conditions with the same delay. Such "
        "conditions are analysed as replicates of one condition.",
    )
    order: Order = Field(
        default="fixed",
        description="Order of the conditions. fixed: as written; shuffled: a new order in each repetition; "
        "constrained: all trials are shuffled together, subject to max_repeats and min_distance; williams, latin: "
        "a row of a Williams design or Latin square, selected by the number in the participant's ID.",
    )
    max_repeats: int | None = Field(
        default=None,
        ge=1,
        le=100,
        description="Maximum number of consecutive presentations of a condition; only if order is constrained.",
    )
    min_distance: int | None = Field(
        default=None,
        ge=1,
        le=1000,
        description="Minimum number of trials from one presentation of a condition to the next; only if order is "
        "constrained. 2 means never twice in a row; 3 means at least two other trials in between.",
    )
    repetitions: int = Field(default=1, ge=1, le=100, description="How many times each condition is presented.")
    break_every: int | None = Field(
        default=None, ge=1, le=10_000, description="Number of trials between breaks; default: no breaks."
    )
    break_page: Id | None = Field(default=None, description="The page shown during a break; its kind is 'break'.")
    task: Id = Field(description="The participant's task in each trial.")
    questionnaire: Id | None = Field(default=None, description="The questionnaire after each trial; default: none.")

    @model_validator(mode="after")
    def _check_presentation_keys(self) -> Self:
        contents = zip(_CONTENTS, self.NOT_WITH, strict=True)
        content, surplus_keys = next(
            (content, keys) for content, (given, keys) in contents if all(getattr(self, key) for key in given)
        )
        for name in surplus_keys:
            if name in self.model_fields_set and getattr(self, name) is not None:  # receipts contain every key
                hint = {
                    "repetitions": "set it in the method's table",
                    "questionnaire": "ask its questions in a form after the block",
                }.get(name, "")
                raise invalid(f"cannot be used in a block with {content}", name, hint, kind="surplus")
        if content == "a design" and len(self.conditions) < 2:
            message = "the block has one condition, but its design compares at least two"
            raise invalid(message, "conditions", "add another condition")
        if content == "a design" and self.standard is None:
            hint = f'write standard = "{self.conditions[0]}", or the condition with which the others are compared'
            raise invalid("is missing", "standard", hint, use=("standard", self.conditions[0]))
        if content == "a design" and self.standard not in self.conditions:
            raise invalid("must be one of the block's conditions", "standard", use=("standard", self.conditions[0]))
        return self

    @model_validator(mode="after")
    def _check_codes_and_part(self) -> Self:
        if self.phase == "main":
            if self.code_prefix is None:
                raise invalid("a main block needs a code_prefix (one capital letter)", "code_prefix")
            if self.part is None:
                raise invalid("a main block needs a part (1, 2, …)", "part")
        elif self.compares is not None:
            raise invalid(f"a {self.phase} block does not compare conditions", "compares", kind="surplus")
        elif self.code_prefix is not None:
            raise invalid(f"a {self.phase} block is not blinded", "code_prefix", kind="surplus")
        elif len(self.conditions) > 1 and self.design is None:
            count = len(self.conditions)
            raise invalid(
                f"a {self.phase} block must have one condition, but has {count}: use a separate block for each",
                "conditions",
            )
        return self

    @model_validator(mode="after")
    def _check_constraint(self) -> Self:
        stated_keys = [name for name in ("max_repeats", "min_distance") if getattr(self, name) is not None]
        if self.order != "constrained":
            if stated_keys:
                raise invalid(
                    f'requires order = "constrained", but order is "{self.order}"',
                    stated_keys[0],
                    'write order = "constrained"',
                    ("order", "constrained"),
                    "surplus",
                )
            return self
        if not stated_keys:
            raise invalid('"constrained" needs max_repeats, min_distance or both', "order")
        if self.repetitions == 1:
            raise invalid('is 1, so conditions cannot repeat: write order = "shuffled"', "repetitions")
        constraint = Constraint(self.max_repeats, self.min_distance)
        if (impossible := constraint.impossible_key(len(self.conditions), self.repetitions)) is not None:
            key, sentence = impossible
            raise invalid(sentence, key)
        return self

    @model_validator(mode="after")
    def _check_breaks(self) -> Self:
        keys = {"break_every": self.break_every, "break_page": self.break_page}
        missing = [name for name, value in keys.items() if value is None]
        if len(missing) == 1:
            raise invalid("is missing: break_every and break_page must be used together", missing[0])
        trials = len(self.conditions) * self.repetitions
        if self.break_every is not None and self.design is None and trials <= self.break_every:
            trials_text = "1 trial" if trials == 1 else f"{trials} trials"
            raise invalid(
                f"is {self.break_every}, but the block has only {trials_text}, so there would be no break",
                "break_every",
            )
        return self


def display_language(protocol: Mapping[str, Any]) -> str:
    """Return the language of figures and tables: English if the study has it, otherwise its first language."""
    languages = list(protocol["study"]["languages"])
    return "en" if "en" in languages else str(languages[0])


def block_titles(protocol: Mapping[str, Any]) -> dict[str, str]:
    """Return the title of each block by ID; the ID follows a title that several blocks of one phase share."""
    language = display_language(protocol)
    titles = {name: (block["phase"], text_in(block["title"], language)) for name, block in protocol["blocks"].items()}
    counts = Counter(titles.values())
    return {name: f"{title[1]} ({name})" if counts[title] > 1 else title[1] for name, title in titles.items()}
