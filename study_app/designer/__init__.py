"""The study designer: one open study, its document, and the panels that edit and show it.

``document.document`` holds the text and the undo history (without Qt), ``form.card`` shows the form of an element, and
``controller`` connects the panels; read these first. The text is authoritative: an edit changes only its own bytes.

Reading order: parts, templates; document; editing, outline, prompts, version_rows; problems; measures; form; file;
header; new_study_page; window; measures_controller, participant, versions; saving; controller.

Public modules: controller, document.document, header, new_study_page, participant.playable, problems, templates,
version_rows, window.
"""
