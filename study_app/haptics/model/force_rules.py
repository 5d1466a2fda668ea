"""Numbers of the force computation that differ between versions of the program, so that old recordings replay.

A receipt states the version of the rules. Compiled code reads the rules of its
scene from ``parameters.rules`` (`layout.RULES`), so that one code computes the force of every version.
"""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from study_app.errors import StoreError


class ForceRules(NamedTuple):
    """The rules of one version.

    ``cut_inertia_share`` is the share of the drag limit for added mass and history if they exceed their limit: with
    more, released handles of 50 g oscillated for 0.6 s.
    """

    version: int
    cut_inertia_share: float


VERSIONS: Final = {
    rules.version: rules
    for rules in (ForceRules(version=1, cut_inertia_share=0.15), ForceRules(version=2, cut_inertia_share=0.15))
}

FORCE_RULES: Final = 2
"""The version by which this program computes forces. Receipts state it: released numbers never change, new numbers are
a new version."""
CURRENT: Final = VERSIONS[FORCE_RULES]


def rules_from(described: Mapping[str, Any]) -> ForceRules:
    """Return the rules that a receipt records with its device; those of version 1 in receipts of earlier versions.

    Raises
    ------
    StoreError
        They are of a version that this program does not know.
    """
    version = described.get("force_rules", 1)
    if version not in VERSIONS:
        raise StoreError(
            f"the receipt states force rules {version!r}, this version knows 1 to {FORCE_RULES}: use a newer version "
            "of liquid-study"
        )
    return VERSIONS[version]
