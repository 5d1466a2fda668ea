"""Work in other processes: a worker process for a window, and executors for many independent cases.

``client`` and ``server`` are the two ends of a worker process; ``executors`` runs cases in processes or on a cluster;
read these first. ``cases`` compares the versions of both sides, ``shared_tasks`` shares tasks with a copy of this
process, ``one_thread`` limits linear algebra.

Reading order: one_thread, shared_tasks; server; cases, client; executors.

Public modules: client, executors, one_thread, server, shared_tasks.
"""
