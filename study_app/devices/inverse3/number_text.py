"""Numbers and texts written into bytes by compiled code."""

from typing import Any

import numpy as np

from study_app.haptics.kernels.compiled import kernel

_DECIMALS = 6
_SCALE = 10**_DECIMALS


@kernel
def put_text(out: Any, at: int, text: Any) -> int:
    """Copy ``text`` to ``out`` from ``at`` on; return where it ends."""
    for k in range(text.size):
        out[at + k] = text[k]
    return at + int(text.size)


@kernel
def put_fixed(out: Any, at: int, value: float) -> int:
    """Write a number with six decimals, as JSON takes it, from ``at`` on; return where it ends.

    Parameters
    ----------
    out : (n,) array
        Bytes.
    at : int
        Where to begin.
    value : float
        Less than 10^9 in size.
    """
    whole = int(abs(value) * _SCALE + 0.5)
    if value < 0.0 and whole > 0:
        out[at] = np.uint8(45)
        at += 1
    digits = _DECIMALS + 1
    power = _SCALE
    while whole // power >= 10:
        power *= 10
        digits += 1
    for k in range(digits):
        if digits - k == _DECIMALS:
            out[at] = np.uint8(46)
            at += 1
        out[at] = np.uint8(48 + whole // power)
        at += 1
        whole %= power
        power //= 10
    return at
