"""What was decided about the analysis before the first session; the report holds the results to it.

Nothing here changes what a participant meets. It stands in every receipt, so that it cannot be decided afterwards.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from study_app.haptics.model.ranges import within
from study_app.protocol.source.document import Path, entries
from study_app.protocol.source.problems import Fault, did_you_mean
from study_app.protocol.table import Brief, ExtendedTable, Id, Table

Reported = Annotated[float, within(-1e9, 1e9, "no published value is larger")]
LISTS = ("primary", "names", "rising", "falling")


class Published(Table):
    """A value of another study, which figures show next to the study's own."""

    block: Id = Field(description="The block whose results it is comparable with.")
    measure: Literal["weber", "threshold", "exponent", "pse"] = Field(
        description="weber: the Weber fraction; threshold: the threshold; exponent: the exponent of a power law; pse: "
        "the point of subjective equality."
    )
    value: Reported = Field(description="The value; a threshold in the unit of the varied number.")
    standard: Reported | None = Field(default=None, description="Its standard, in that unit; left out: of all.")
    low: Reported | None = Field(default=None, description="Lower end of its interval or range.")
    high: Reported | None = Field(default=None, description="Upper end of its interval or range.")
    percent: Annotated[float, within(0, 100, "a share of answers")] | None = Field(
        default=None, description="Percentage of correct answers at the value; left out: unknown."
    )
    n: Annotated[int, within(1, 1_000_000, "no study had more")] | None = Field(
        default=None, description="Number of its participants."
    )
    source: Brief = Field(default="", description="Where it was published.")

    def described(self) -> str:
        """Return it in words."""
        about = (
            "" if self.standard is None else f", standard {self.standard:g}",
            "" if self.percent is None else f", at {self.percent:g} % correct",
            "" if self.n is None else f", n = {self.n}",
            f", {self.source}" if self.source else "",
        )
        return f"{self.block}: {self.measure} {self.value:g}{''.join(about)}"


class Analysis(ExtendedTable):
    """Decisions about the analysis; without this table the report calls all its results exploratory."""

    LATER: ClassVar[frozenset[str]] = frozenset({"participants", "precision", "published"})

    alpha: Annotated[float, within(0.0001, 0.2, "no study of people shows less than 0.0001")] = Field(
        default=0.05, description="Largest p that counts as significant."
    )
    equivalence_bound: Annotated[float, within(0.05, 6, "the scale has 6 steps, means differ by tenths")] | None = (
        Field(
            default=None,
            description="Largest mean difference to no delay that would not matter, in points of the scale; left out: "
            "equivalence is not tested.",
        )
    )
    primary: tuple[Id, ...] = Field(
        default=(), description="Items of the questions asked; the others are exploratory. Left out: all are primary."
    )
    names: tuple[Id, ...] = Field(
        default=(),
        description="Items that name a liquid; the participant named the one with the single highest answer.",
    )
    rising: tuple[Id, ...] = Field(default=(), description="Items whose answers are expected to rise with delay.")
    falling: tuple[Id, ...] = Field(default=(), description="Items whose answers are expected to fall with delay.")
    noticed: Id | None = Field(
        default=None, description="Item for which agreement (5 to 7) means that a delay was noticed."
    )
    participants: Annotated[int, Field(ge=1, le=100_000)] | None = Field(
        default=None, description="How many participants are planned."
    )
    precision: Annotated[float, within(0.001, 10, "a share of the group's mean")] | None = Field(
        default=None, description="Half the 95 % interval of the group's mean that is planned, as a share of the mean."
    )
    published: tuple[Published, ...] = Field(default=(), description="Published values to compare with.")

    def described(self, named_by: Sequence[str]) -> Iterator[tuple[str, str]]:
        """Yield a row in words for each decision; ``named_by`` says which item names each condition."""
        bound = self.equivalence_bound
        points = "point" if bound == 1 else "points"
        yield "Significant", f"p of at most {self.alpha:g}"
        yield (
            "Equivalent",
            "not tested" if bound is None else f"answers as without delay, to within {bound:g} {points} of the scale",
        )
        yield "Primary", ", ".join(self.primary) or "all statements"
        yield "Names", ", ".join(self.names) or "none"
        if named_by:
            yield "Recognised", ", ".join(named_by)
        yield "Rise with delay", ", ".join(self.rising) or "none"
        yield "Fall with delay", ", ".join(self.falling) or "none"
        yield "Noticed", "not asked" if self.noticed is None else f"{self.noticed} from 5 on"
        if self.participants is not None:
            yield "Participants", f"{self.participants} planned"
        if self.precision is not None:
            yield "Precision", f"group mean ±{100 * self.precision:g} % (half its 95 % interval)"
        for one in self.published:
            yield "Published", one.described()


def decisions(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Check that what is decided is about statements there are, each once, and that liquids are named by such items."""
    asked = (item for _, item in entries(document, "questionnaires.*.items.*") if isinstance(item, Mapping))
    items = {item["id"] for item in asked if isinstance(item.get("id"), str) and "kind" not in item}
    for key in LISTS:
        found = list(entries(document, f"analysis.{key}.*"))
        yield from _unknown(found, items)
        for place, (path, name) in enumerate(found):
            if name in [earlier for _, earlier in found[:place]]:
                yield Fault(path, f'"{name}" is listed twice', "remove one")
    yield from _unknown(entries(document, "analysis.noticed"), items)
    falling = [name for _, name in entries(document, "analysis.falling.*")]
    for path, name in entries(document, "analysis.rising.*"):
        if name in falling:
            yield Fault(path, f'"{name}" is expected to fall too', "an item rises, falls, or is in neither list")
    names = [name for _, name in entries(document, "analysis.names.*")]
    for path, name in entries(document, "conditions.*.label"):
        if isinstance(name, str) and name not in names:
            yield Fault(path, f'"{name}" is not among analysis.names', "add it there, or leave the label out")


def _unknown(found: Iterable[tuple[Path, Any]], items: set[str]) -> Iterator[Fault]:
    for path, name in found:
        if isinstance(name, str) and name not in items:
            yield Fault(path, f'there is no item "{name}"', did_you_mean(name, items))
