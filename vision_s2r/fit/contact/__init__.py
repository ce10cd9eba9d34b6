"""Fitting contact effects: tosses in, a case for the search out.

`ContactCase` predicts short windows of a recording through the machines of `vision_s2r.contact`, each from a measured
state, and scores the prediction in units of what is not known of it.
"""

from vision_s2r.fit.contact.case import ContactCase

__all__ = ["ContactCase"]
