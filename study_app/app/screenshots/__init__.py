"""Pictures of every window in both themes, taken of the real program: a rehearsed study, a session, the lab.

Windows are opened without a screen, sessions are held with the scripted hand, and what one sees is grabbed as it is
painted. Everything lies in a folder that is gone afterwards; the user's settings are not touched.
"""

from study_app.app.screenshots.screenshots import screenshots

__all__ = ["screenshots"]
