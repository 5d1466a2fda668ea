"""Facts of a study that follow every edit: its length, trials, forces, missing texts and warnings."""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Final

from study_app.designer.document.study import Study
from study_app.designer.measures.participant_texts import missing_texts, to_translate
from study_app.designer.measures.valid_part import valid_part
from study_app.haptics.model.slope_limits import HAND_MPS, steady
from study_app.protocol.checks.warnings import warnings
from study_app.protocol.orders.block_orders import orders_of
from study_app.protocol.orders.durations import duration_range_s, expected_duration_s, step_duration_s
from study_app.store.workstation import device_without_force

MOST_PARTICIPANTS: Final = 200


@dataclass(frozen=True, slots=True)
class Facts:
    """What a study is, in numbers: those that depend on a broken element are not known."""

    expected_s: float | None = None  # how long a session will take [s]
    range_s: tuple[float, float] | None = None  # how long the shortest and the longest session will take [s]
    # how long each page, form and block will take [s], by its id
    steps_s: dict[str, float] = field(default_factory=dict)
    # how many a complete session has at most, practice included
    trials: int | None = None
    answers: int | None = None
    breaks: int | None = None
    forces_n: dict[str, float] = field(default_factory=dict)  # force of each liquid [N] against a hand at 0.1 m/s
    # how many texts each language lacks; none where it lacks none
    missing: dict[str, int] = field(default_factory=dict)
    # the warnings of ``check``, but those that take simulated observers, and what is to be translated
    warnings: tuple[str, ...] = ()


@lru_cache(maxsize=2)
def facts(study: Study) -> Facts:
    """Return the facts of a study."""
    missing, translate = missing_texts(study), to_translate(study)
    valid = valid_part(study)
    if (protocol := valid.protocol) is None:
        return Facts(missing=missing, warnings=translate)
    language = protocol.study.languages[0]
    known = Facts(
        steps_s={step: step_duration_s(protocol, step, language) for step in protocol.steps},
        missing=missing,
        warnings=translate,
    )
    if valid.forces:
        forces_n = {name: steady(protocol.scene_of(name), HAND_MPS).force_n for name in protocol.liquids}
        warned = warnings(protocol, simulates=False, without_force=device_without_force())
        known = replace(known, forces_n=forces_n, warnings=(*warned, *translate))
    if not valid.whole:
        return known
    orders = orders_of(protocol)
    return replace(
        known,
        expected_s=expected_duration_s(protocol),
        range_s=duration_range_s(protocol),
        trials=sum(block.trials for block in orders.blocks),
        answers=orders.answers,
        breaks=sum(block.breaks for block in orders.blocks),
    )
