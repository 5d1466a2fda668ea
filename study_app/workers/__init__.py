"""Work in other processes: a worker process for a window, and executors for many independent cases.

``client`` and ``server`` are the two ends of a worker process; ``executors`` runs cases in processes or on a cluster;
read these first. ``cases`` compares the versions of both sides, ``forked`` computes a part in a copy of this process,
``one_thread`` limits linear algebra.

Reading order: forked, one_thread; server; cases, client; executors.
"""
