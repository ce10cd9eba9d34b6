"""Scoring: diagnoses each sealed recording in a process of its own, then opens the answers and scores."""
