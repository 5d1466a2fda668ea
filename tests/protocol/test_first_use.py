"""The first use of a model builds its validator; several threads may use it first at the same time."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest
from pydantic import BaseModel, GetCoreSchemaHandler

from study_app.haptics.model.ranges import Frozen
from study_app.protocol.table import Table

THREADS = 8


@pytest.mark.parametrize("base", [Table, Frozen])
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
    assert [(type(one), one.value) for one in values] == [(Model, value) for value in range(THREADS)]
    assert len(builders) == 1, "a second builder deletes the validator that others use"
