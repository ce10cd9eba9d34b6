"""Diagnosis: recordings of the real thing in; where the gap lies, which effect causes it, how far it shrinks out."""
