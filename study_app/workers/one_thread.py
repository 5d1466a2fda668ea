"""The limit of linear algebra to one thread."""

import os


def compute_in_one_thread() -> None:
    """Limit the linear algebra of this process to one thread; numpy must not be imported yet.

    Since the matrices are small, a second thread would double a report's processor time, mostly by waiting.
    """
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
