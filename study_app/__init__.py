"""Run, record and analyse studies of how liquids feel through a haptic device.

The packages, from the inside out; each imports only those named before it (a test holds it so):

``errors``      the exception tree
``haptics``     the force model and the 1 kHz servo
``protocol``    what is to be run: a file becomes a frozen value, the value a schedule
``devices``     what can be felt with
``store``       what is kept: journal, receipt, tables, blinding
``session``     running it: pages, events, the transition table
``analysis``    understanding it: tables, figures, export
``evaluation``  the force model under test
``lab``         the liquid lab without its windows: two settings side by side
``gui``         drawing it
``app``         where device, servo, store, session and windows meet
``cli``         the commands
"""

__version__ = "0.2.0"
