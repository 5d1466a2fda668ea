"""The kinds of designs, those of a list, and of methods, found by importing the modules of their folder."""

from __future__ import annotations

from functools import reduce
from operator import or_
from types import ModuleType
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias, get_args

from pydantic import Field

from study_app.discovery import modules_of
from study_app.protocol.table import Table
from study_app.protocol.trials import designs, methods
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.method import Method


def _kinds(package: ModuleType, of: type[Any]) -> dict[str, Any]:
    """Return the classes of a folder's modules by the kinds that they stand for."""
    found: dict[str, Any] = {}
    for module in modules_of(package):
        for one in vars(module).values():
            if isinstance(one, type) and issubclass(one, Table) and issubclass(one, of) and "kind" in one.model_fields:
                found |= dict.fromkeys(get_args(one.model_fields["kind"].annotation), one)
    return found


def _union(kinds: dict[str, Any]) -> Any:
    """Return the type of a table that is of one of the kinds."""
    return Annotated[reduce(or_, dict.fromkeys(kinds.values())), Field(discriminator="kind")]


DESIGN_KINDS: Final[dict[str, type[Design]]] = {
    kind: design for design in designs.KINDS for kind in get_args(design.model_fields["kind"].annotation)
}
METHOD_KINDS: Final[dict[str, type[Method]]] = _kinds(methods, Method)

if TYPE_CHECKING:
    AnyDesign: TypeAlias = Design
    AnyMethod: TypeAlias = Method
else:
    AnyDesign = _union(DESIGN_KINDS)
    AnyMethod = _union(METHOD_KINDS)


def default_design(kind: str) -> Design:
    """Return a design of a kind with all its defaults (KeyError of an unknown kind)."""
    return DESIGN_KINDS[kind].model_validate({"kind": kind})


def default_method(kind: str) -> Method:
    """Return a method of a kind with all its defaults (KeyError of an unknown kind)."""
    return METHOD_KINDS[kind].model_validate({"kind": kind})
