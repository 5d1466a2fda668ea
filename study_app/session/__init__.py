"""Running a study without Qt: events in, pages and commands out.

``machine`` decides (its table and ``moves``, over ``state``, with pages from ``compose``). ``runner`` carries out what
it decided, follows the task (``tasks``) and measures the trial (``statistics``). ``rehearsal`` runs whole sessions with
a ``simulated`` participant, who explores in ``strokes``. What they exchange are the values of ``events``, ``commands``
and ``pages``.
"""
