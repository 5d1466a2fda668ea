"""Groups and sessions that differ: who has which sequence, and that each block belongs to a group."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from study_app.protocol.groups import sequences_in
from study_app.protocol.source.document import entries, names
from study_app.protocol.source.problems import Fault

OWN = ("sequence", "sequences")


def groups(document: Mapping[str, Any]) -> Iterator[Fault]:
    """Check that there are several groups, that each block is in a sequence of one, and that no sequence is unused."""
    if all(key in document for key in OWN):
        yield Fault(("sequences",), "give either sequence or sequences, one of the two")
    tables = [table for _, table in entries(document, "groups.*") if isinstance(table, Mapping)]
    if not tables:
        return
    if len(names(document, "groups")) == 1:
        yield Fault(("groups",), "there is only one group", "add another group, or leave groups out")
    own = [any(key in table for key in OWN) for table in tables]
    for key in OWN:
        if key in document and all(own):
            yield Fault((key,), "is used by no group: each has its own", f"remove {key}, or the one of a group")
    used = {step for _, steps in sequences_in(document) for step in steps if isinstance(step, str)}
    for block in names(document, "blocks"):
        if used and block not in used:
            yield Fault(("groups",), f'block "{block}" is in no group\'s sequence', "add it to one, or take it out")
