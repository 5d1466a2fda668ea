"""Running a study without Qt: events in, pages and commands out."""
