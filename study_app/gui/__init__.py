"""The windows of operator and participant.

Windows show immutable values and emit signals; they open no file and compute no statistics. Read ``kit.fields``
(forms), ``kit.commands`` (actions) and ``theme.themed`` (colours) first, then a folder such as ``home``.

Reading order: display, display_check, key_presses, theme; application, widgets; help, kit, participant,
startup_window; devices, lab, settings, watch; sessions; home, operator, preflight, results.

Public modules: application, devices, display, display_check, help.view, home, kit, lab, operator,
participant.forms.questions_page, participant.tank.glass, participant.window, preflight.window, results.view,
sessions.session_facts, settings.view, startup_window, theme, watch.window, widgets.
"""
