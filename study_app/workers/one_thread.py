"""Linear algebra in one thread."""

import os


def compute_in_one_thread() -> None:
    """Limit the linear algebra of this process to one thread; numpy must not be imported yet.

    Matrices are small here: with a second thread a report takes twice the processor time, most of it spent waiting.
    """
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
