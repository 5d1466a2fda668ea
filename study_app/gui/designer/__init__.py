"""The study designer's place: header, outline, form, file and problems."""
