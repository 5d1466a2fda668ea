"""IDs, short names and typed numbers made from texts, compared with reviewed files."""

from pathlib import Path

import pytest

from study_app.ids import MAX_ID, free_id, free_short_name, id_of, short_name_of
from study_app.number_text import exact_text, number_of, readings_of, typed_numbers
from tests.golden import compare
from tests.transcripts import calls, played

FUNCTIONS = (id_of, free_id, free_short_name, short_name_of, number_of, readings_of, exact_text, typed_numbers)
PLAY = calls({"LONG": MAX_ID * "x", **{function.__name__: function for function in FUNCTIONS}}, ValueError)


@pytest.mark.parametrize("file", sorted((Path(__file__).parent / "texts").iterdir()), ids=lambda file: file.stem)
def test_texts_as_recorded(file: Path, pytestconfig: pytest.Config) -> None:
    compare(file, played(file, PLAY), pytestconfig, exact=True)
