"""The drag coefficient by recursive least squares with forgetting.

The force is C_d·g + h (``liquid_model``). With y = measured − h the sums Σ w g², Σ w g·y, Σ w y² and those of
neighbouring rows are stored, each multiplied by exp(−Δt/τ) per row: the estimate Σ w g·y / Σ w g² is that of all rows,
weighted by their age (the information form of recursive least squares; Ljung 1999, System Identification, §11.2), and
residuals at the present estimate follow from the same sums.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from study_app.lab.estimation.rows import Floats

_SUMS: Final = 6
_GG, _GY, _YY, _GG1, _GY1, _YY1 = range(_SUMS)


class RecursiveDrag:
    """Estimates the drag coefficient from all rows so far.

    Parameters
    ----------
    memory_s : float
        τ [s]: a row of this age counts by 1/e.
    """

    def __init__(self, memory_s: float) -> None:
        self._memory_s = memory_s
        self._sums: Floats = np.zeros((_SUMS, 3))
        self._t_s = math.nan
        self._last: tuple[Floats, Floats] | None = None
        self.rows = 0.0

    def take(self, t_s: Floats, g_n: Floats, y_n: Floats, usable: NDArray[np.bool_]) -> None:
        """Add rows: times (n,) [s], force by C_d = 1 and measured force less that of other effects (n, 3) [N]."""
        if len(t_s) == 0:
            return
        if not math.isnan(self._t_s):
            kept = math.exp(-(float(t_s[-1]) - self._t_s) / self._memory_s)
            self._sums *= kept
            self.rows *= kept
        weights = np.exp((t_s - t_s[-1]) / self._memory_s) * usable
        before_g, before_y = self._last if self._last is not None else (np.zeros(3), np.zeros(3))
        earlier_g, earlier_y = np.vstack([before_g, g_n[:-1]]), np.vstack([before_y, y_n[:-1]])
        in_row = weights * np.concatenate([[self._last is not None], usable[:-1]])
        self._sums += [
            weights @ (g_n * g_n),
            weights @ (g_n * y_n),
            weights @ (y_n * y_n),
            in_row @ (g_n * earlier_g),
            in_row @ (g_n * earlier_y + earlier_g * y_n),
            in_row @ (y_n * earlier_y),
        ]
        self.rows += float(weights.sum())
        self._t_s = float(t_s[-1])
        self._last = (g_n[-1], y_n[-1]) if usable[-1] else None

    @property
    def value(self) -> float:
        """C_d; NaN without motion."""
        size = float(self._sums[_GG].sum())
        return float(self._sums[_GY].sum()) / size if size > 0 else math.nan

    @property
    def normal_n2(self) -> float:
        """Σ w g² [N²]."""
        return float(self._sums[_GG].sum())

    @property
    def residual(self) -> tuple[float, float]:
        """Variance [N²] of the residuals of the axes that count, and their correlation from row to row."""
        value = self.value
        counts = self._sums[_YY] + self._sums[_GG] > 0
        squares = float((self._sums[_YY] - 2 * value * self._sums[_GY] + value**2 * self._sums[_GG]).sum())
        following = float((self._sums[_YY1] - value * self._sums[_GY1] + value**2 * self._sums[_GG1]).sum())
        seen = self.rows * int(counts.sum())
        if seen <= 0 or squares <= 0:
            return 0.0, 0.0
        return squares / seen, following / squares

    @property
    def force_rms_n(self) -> float:
        """The root mean square of the measured force [N], less that of other effects."""
        return math.sqrt(float(self._sums[_YY].sum()) / self.rows) if self.rows > 0 else 0.0
