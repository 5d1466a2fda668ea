import numpy as np
import pytest
from numba.core.errors import NumbaError

from study_app.haptics.compiled import kernel, part, workings
from tests.haptics.scenes import COMPILED

pytestmark = pytest.mark.skipif(not COMPILED, reason="about compiled code")


@pytest.mark.parametrize("decorator", [kernel, part])
def test_code_of_the_servo_that_would_allocate_does_not_compile(decorator):
    @decorator
    def make(count):
        return np.zeros(count)[0]

    with pytest.raises((NumbaError, NotImplementedError)):
        make(3)


def test_evaluation_may_make_arrays():
    @workings
    def make(count):
        return np.zeros(count)

    assert len(make(3)) == 3
