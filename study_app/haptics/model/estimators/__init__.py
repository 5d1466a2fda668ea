"""The velocity estimators: one descriptor per module, found by importing every module of this folder."""

from importlib import import_module
from pkgutil import iter_modules
from typing import Final

from study_app.haptics.model.estimator import EstimatorKind

ESTIMATORS: Final[tuple[EstimatorKind, ...]] = tuple(
    sorted((import_module(f"{__name__}.{it.name}").ESTIMATOR for it in iter_modules(__path__)), key=lambda it: it.code)
)
"""Every estimator, in the order of its code."""

NAMED: Final = {estimator.name: estimator for estimator in ESTIMATORS}
"""The same by name."""

if len({estimator.code for estimator in ESTIMATORS}) < len(ESTIMATORS) or len(NAMED) < len(ESTIMATORS):
    raise ValueError(f"two estimators share a name or a code: {[(it.name, it.code) for it in ESTIMATORS]}")
