"""Computation in other processes: a worker process for a window, and executors of many independent cases.

Read first: ``client`` and ``server``, the two ends of a worker process, and ``executors``, which opens an executor of
processes or of a cluster; ``cases`` implements these executors. ``shared_tasks`` shares tasks with a copy of this
process; ``one_thread`` limits linear algebra to one thread.

Reading order: one_thread, shared_tasks; server; cases, client; executors.

Public modules: client, executors, one_thread, server, shared_tasks.
"""
