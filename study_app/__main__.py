"""Run the program with ``python -m study_app``."""

from study_app.cli import main

main()
