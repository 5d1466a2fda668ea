"""The windows of operator and participant.

Windows show frozen values and emit signals; they open no file and compute no statistics. Read ``kit.fields`` (what is
edited), ``kit.commands`` (actions) and ``theme.themed`` (colours) first, then a folder as an example, such as ``home``.

Reading order: display, key_presses, theme; application, widgets; help, kit, participant; devices, lab, settings,
watch; sessions; home, operator, preflight, results.

Public modules: application, devices.diagnosis_dialog, devices.view, display.display_check, display.screens, help.view,
home.dialogs, home.main_window, home.startup_window, home.study_facts, home.view, kit.commands, kit.devices,
kit.dialogs, lab.lab_state, lab.view, operator.operator_view, operator.servo_health, operator.session_panels,
operator.window, participant.forms.questions_page, participant.tank.glass, participant.window, preflight.window,
results.view, sessions.session_facts, settings.view, theme.icons, theme.theme, theme.themed, watch.window,
widgets.accessible, widgets.background, widgets.boxes, widgets.cards, widgets.controls, widgets.labels,
widgets.main_view, widgets.numbers.
"""
