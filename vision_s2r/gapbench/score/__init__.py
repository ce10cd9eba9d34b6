"""Scoring: diagnoses each recording in a process of its own, then opens the answers and scores."""
