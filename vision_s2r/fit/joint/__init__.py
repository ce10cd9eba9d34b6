"""The diagnosis of joints: a log in, a case for the search out.

`case.JointCase` predicts a recording through the machines of `vision_s2r.joint`, led by a leaky observer, and scores
the prediction sample by sample. How each effect is fitted is said in `effects/NAME.py`.
"""
