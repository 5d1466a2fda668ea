from __future__ import annotations

import pytest

from study_app.errors import ProtocolError
from study_app.protocol.checks.not_supported import METHODS
from tests.protocol.trials.studies import study

CONSTANT = 'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8'
STIMULUS = 'stimulus = "viscosity"'


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        *(
            (
                'kind = "constant"\nlevels = [0.2, 0.4, 0.8]\nrepetitions = 8',
                f'kind = "{name}"\ntrials = 40',
                "methods.few.kind",
            )
            for name in METHODS
        ),
        ('method = "few"', 'method = "adjustment"', "blocks.viscosity.method"),
        ('design = "2ifc"', 'design = "adjustment"', "blocks.viscosity.design"),
    ],
)
def test_what_a_later_version_supports_is_one_fault_that_says_so(old: str, new: str, place: str) -> None:
    with pytest.raises(ProtocolError) as caught:
        study((old, new))
    (problem,) = caught.value.problems
    assert problem.place == place
    assert "not supported yet" in problem.message
