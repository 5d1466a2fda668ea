"""Sections of the report on answers other than those to statements: questions, scores, levels."""
