"""The client of the worker process that reads and evaluates studies for a window.

The libraries and tables of an evaluation stay in that process.
"""

from typing import TypeAlias

from study_app.analysis.worker_messages import Answer, Order
from study_app.workers.client import WorkerClient

AnalysisClient: TypeAlias = WorkerClient[Order, Answer]


def start_analysis_worker() -> AnalysisClient:
    """Start a worker process for orders about studies (see `study_app.analysis.study_worker.carry_out`)."""
    return WorkerClient("study_app.analysis.study_worker:carry_out", name="analysis")
