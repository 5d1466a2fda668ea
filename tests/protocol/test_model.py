"""The first use of a model builds its validator; several threads may use it first at the same time."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from pydantic import BaseModel, GetCoreSchemaHandler, ValidationError

from study_app.haptics.model.overrides import number_names
from study_app.haptics.model.ranges import Frozen
from study_app.protocol.descriptions.protocol_text import describe
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.quantities import can_vary, quantity, quantity_text
from study_app.protocol.source.files import source_bytes
from study_app.store.receipt import without_conditions
from tests.protocol.sound import SOUND

SMALL = parse(SOUND.encode(), "small.toml")


def test_a_protocol_never_changes():
    with pytest.raises(ValidationError, match="frozen"):
        SMALL.study.name = "other"  # type: ignore[misc]


@pytest.mark.parametrize("protocol", [SMALL, load("rek2024"), load("demo")], ids=lambda protocol: protocol.study.name)
def test_a_protocol_survives_json(protocol: Protocol):
    assert Protocol.model_validate_json(protocol.model_dump_json()) == protocol


def test_a_scene_holds_the_liquids_of_its_condition_in_order():
    scene = SMALL.scene_for("both")
    assert [liquid.id for liquid in scene.liquids] == ["thin", "thick"]
    assert (scene.scale, scene.rate_hz, scene.force_limit_n) == (10, 1000, 8)


def test_lines_of_the_file_do_not_matter_in_a_text():
    body = load("rek2024").pages["part_1"].body
    first, second = SMALL.paragraphs(body, "en")
    assert first == "You will now feel three liquids, one after the other. We do not tell you which they are."
    assert second.startswith("Explore each")


THREADS = 8


@pytest.mark.parametrize("base", [type(SMALL.limits), Frozen])
def test_threads_that_use_a_model_first_build_its_validator_once(base: type[BaseModel]) -> None:
    begin = threading.Barrier(THREADS)
    builders: list[str] = []

    class Model(base):  # type: ignore[valid-type, misc]
        value: int

        @classmethod
        def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> Any:
            builders.append(threading.current_thread().name)
            time.sleep(0.05)
            return handler(source)

    def validate(value: int) -> Any:
        begin.wait(10.0)
        return Model.model_validate({"value": value})

    with ThreadPoolExecutor(THREADS) as threads:
        values = list(threads.map(validate, range(THREADS)))
    assert [(type(value), value.value) for value in values] == [(Model, value) for value in range(THREADS)]
    assert len(builders) == 1, "a second builder deletes the validator that others use"


DEMO = source_bytes("demo").decode()
SAYS = 'blinding = "double"'


def told(line: str) -> bytes:
    assert DEMO.count(SAYS) == 1
    return DEMO.replace(SAYS, line).encode()


@pytest.mark.parametrize("blinding", ["double", "single"])
def test_the_receipt_keeps_which_it_was(blinding: str) -> None:
    protocol = parse(told(f'blinding = "{blinding}"'), "demo")
    assert without_conditions(protocol)["study"]["blinding"] == blinding
    assert f"{blinding}-blind" in describe(protocol)


OF_THE_LOOP = {"format", "rate_hz", "fade_s"}
"""Numbers of a scene that hold for a whole session."""


@pytest.mark.parametrize("study", ["rek2024", "demo", "physical2"])
def test_every_number_of_a_liquid_has_words(study: str) -> None:
    protocol = load(study)
    names = {name for condition in protocol.conditions for name in number_names(protocol.scene_for(condition))}
    assert len(names) >= 15
    for name in names - OF_THE_LOOP:
        assert quantity_text(name)
        assert "_" not in quantity_text(name)


@pytest.mark.parametrize(
    ("name", "wording", "varies"),
    [
        ("viscosity_pa_s", "viscosity", True),
        ("wake.scaling", "wake scaling", True),
        ("local_wake.reach_m", "local wake reach", True),
        ("scene.scale", "scale", False),
        ("motion.speed_mps", "fastest", False),
    ],
)
def test_a_quantity_is_named_with_its_effect_and_varies_unless_it_holds_for_a_session(
    name: str, wording: str, varies: bool
) -> None:
    assert (quantity_text(name), can_vary(name)) == (wording, varies)


def test_unknown_quantity_is_refused() -> None:
    with pytest.raises(KeyError):
        quantity("rate_hz")
