"""Pages of questions: statements on scales, and forms with questions of several kinds."""
