"""Pictures of every window in both themes, taken of the real program: a rehearsed study, a session, the lab.

Windows are opened without a screen, and sessions are run with the scripted hand. All files are in a temporary folder;
the user's settings are not changed.
"""

from tools.screenshots.screenshots import screenshots

__all__ = ["screenshots"]
