"""Home: the studies, the recorded sessions, and the start of the next one.

Reading order: main_window, startup_window, study_facts; cards, dialogs; view.
"""
