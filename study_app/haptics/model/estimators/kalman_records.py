"""State of the Kalman filter of velocity (`kalman`), all at the hand."""

from __future__ import annotations

import numpy as np

KALMAN_STATE = np.dtype(
    [
        ("force_n", np.float64, (3,)),  # mean force since the last sample, without buoyancy and weight
        ("before_n", np.float64, (3,)),  # the same at the sample before
        ("passed_n", np.float64, (3,)),  # output of the first high-pass filter
        ("input_n", np.float64, (3,)),  # output of the second
        ("offset_m", np.float64, (3,)),  # estimated less measured position, of a filter that knows no force
        ("velocity_mps", np.float64, (3,)),
        ("acceleration_mps2", np.float64, (3,)),
        ("response_m", np.float64, (3,)),  # how these three would have moved with a force on 1 kg [1/kg · m …]
        ("response_mps", np.float64, (3,)),
        ("response_mps2", np.float64, (3,)),
        ("covariance", np.float64, (6,)),  # of one axis, the same for all: pp, pv, pa, vv, va, aa
        ("per_kg", np.float64),  # θ, the inverse of the mass that the force moves
        ("per_kg_variance", np.float64),
        ("estimate_mps", np.float64, (3,)),  # velocity with the force known
        ("smoothed_mps", np.float64, (3,)),  # by EWMA, in the scene: what is used while the filter is not trusted
        ("carried_mps", np.float64, (3,)),  # in the scene: left of the difference when one took over from the other
        ("believed_ticks", np.int64),  # delay of the loop, as believed at this sample
        ("delay_ticks", np.int64),  # the same at the sample before
        ("distrusted", np.int64),  # 1 while EWMA is used
        ("surprise", np.float64),  # mean of squared innovations over their variance
        ("quiet_s", np.float64),  # time since the last trouble
        ("repeated", np.int64),  # 1 where the last sample was taken for a repeated one
    ],
    align=True,
)
