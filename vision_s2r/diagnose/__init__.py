"""Diagnosis: recordings of the real thing in; where the gap lies, which effect causes it, how far it shrinks out.

`diagnose(recording, cfg)` is the whole of it in memory, `diagnose_all(cfg)` from folders to folders.
A kind of recording is a `Case`: it predicts the recording under effects and scores the prediction; the search, the
statistics and the report are written once for all kinds.
"""

from vision_s2r.lazy import callable_package

callable_package(__name__, "vision_s2r.diagnose.diagnose:diagnose")
