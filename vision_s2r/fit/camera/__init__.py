"""The diagnosis of cameras from pairs: a recording in, a case for the search out.

`case.CameraCase` predicts the real pictures through the effects of `vision_s2r.camera`, and scores the prediction pixel
by pixel. How each effect is fitted is said in `effects/NAME.py`.
"""
