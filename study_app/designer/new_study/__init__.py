"""Beginning a study: templates, copies of studies, and the questions that it begins with."""
