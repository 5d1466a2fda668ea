"""The compiled force model and loop.

Reading order: compiled; c_functions, plant, vector; known_force; effects, estimators, sample_validation; passivity,
regions; safety; tick; loop.
"""

from study_app.haptics.kernels.c_functions import (
    READ,
    READ_LOST,
    READ_NEW,
    READ_NOTHING_NEW,
    WRITE,
    WRITE_SATURATED,
    Driver,
    c_function,
    call_at,
    command_at,
    device_functions,
    fence,
    full_fence,
    reading_at,
    record_at,
)
from study_app.haptics.kernels.compiled import CACHE, entry_of, evidence_kernel, following_compilation, kernel
from study_app.haptics.kernels.effects.drag import resistance
from study_app.haptics.kernels.effects.wake import REST_MPS, response
from study_app.haptics.kernels.passivity import SURE_MPS
from study_app.haptics.kernels.plant import HANDLE, measure, move, new_handle, push, random, release_handle
from study_app.haptics.kernels.safety import START_FADE_S, begin_scene, new_safety
from study_app.haptics.kernels.sample_validation import can_have_moved
from study_app.haptics.kernels.vector import clear, copy, distance, dot, is_finite, norm, square, square_distance

__all__ = [
    "CACHE",
    "HANDLE",
    "READ",
    "READ_LOST",
    "READ_NEW",
    "READ_NOTHING_NEW",
    "REST_MPS",
    "START_FADE_S",
    "SURE_MPS",
    "WRITE",
    "WRITE_SATURATED",
    "Driver",
    "begin_scene",
    "c_function",
    "call_at",
    "can_have_moved",
    "clear",
    "command_at",
    "copy",
    "device_functions",
    "distance",
    "dot",
    "entry_of",
    "evidence_kernel",
    "fence",
    "following_compilation",
    "full_fence",
    "is_finite",
    "kernel",
    "measure",
    "move",
    "new_handle",
    "new_safety",
    "norm",
    "push",
    "random",
    "reading_at",
    "record_at",
    "release_handle",
    "resistance",
    "response",
    "square",
    "square_distance",
]
