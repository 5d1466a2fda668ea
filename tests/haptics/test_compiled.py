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


def test_code_of_the_servo_counts_no_references():
    @kernel
    def total(array):
        return array[0] + array[1]

    assert total(np.ones(2)) == 2.0
    (assembly,) = total.inspect_asm().values()
    body = assembly.split(".type")[1]
    assert "NRT_incref" not in body


def test_evaluation_may_make_arrays():
    @workings
    def make(count):
        return np.zeros(count)

    assert len(make(3)) == 3
