"""Running a study without Qt: events in, pages and commands out.

``transitions`` decides (its table over events and state). ``runner`` carries out what it decided, follows the task
(``tasks``) and measures the trial (``trial``). ``simulated`` runs whole sessions with simulated
participants.
"""
