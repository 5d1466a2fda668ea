"""What was decided about the analysis before the first session, as the receipts hold it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal, TypeAlias

from study_app.analysis.tables.compared_blocks import Block
from study_app.errors import AnalysisError

Direction: TypeAlias = Literal["increasing", "decreasing"]


@dataclass(frozen=True, slots=True)
class Decided:
    """The protocol's table ``analysis``.

    ``made`` is False where there was none; ``changed`` where sessions were run under different ones, of which this is
    the first: in both cases everything found is exploratory.
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

    @property
    def binding(self) -> bool:
        """Whether it was decided before the first session, and kept to."""
        return self.made and not self.changed

    def is_primary(self, item: str) -> bool:
        """Whether a statement is one that the study is about."""
        return self.binding and (not self.primary or item in self.primary)

    def direction(self, item: str) -> Direction | None:
        """Return where answers to a statement were expected to go as delay grows; None: nothing was expected."""
        return "increasing" if item in self.rising else "decreasing" if item in self.falling else None

    def named_in(self, block: Block) -> bool:
        """Return whether the statements that name a liquid are those of a block."""
        return bool(self.names) and set(self.names) <= {item.id for item in block.items}


NOTHING: Final = Decided(False, False, 0.05, None, (), (), (), (), None)


def read(tables: Sequence[Mapping[str, Any] | None]) -> Decided:
    """Return what the sessions' receipts say was decided.

    Raises
    ------
    AnalysisError
        A receipt's table is none.
    """
    first = tables[0]
    changed = any(table != first for table in tables)
    if first is None:
        return replace(NOTHING, changed=changed)
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
        )
    except (KeyError, TypeError, ValueError) as error:
        raise AnalysisError(
            f"a receipt does not say what was decided about the analysis ({type(error).__name__}: {error}): it was "
            "changed, or written by another version of the program; restore it from a copy"
        ) from error
