"""Identification: recordings of a joint in, its nominal parameters and chosen effects with how sure they are out.

The diagnosis searches for effects; here they are given. `identify(recording, cfg)` is the whole of it in memory,
`identify_all(cfg)` from folders to folders. Two methods share everything but the fit: `forward` (the simulator against
the recording, any effect) and `inverse` (least squares on the torque balance).
"""

from vision_s2r.identify.config import IdentifyConfig
from vision_s2r.identify.identified import Identified
from vision_s2r.identify.identify import identify
from vision_s2r.identify.run import identify_all
from vision_s2r.lazy import callable_package

__all__ = ["Identified", "IdentifyConfig", "identify", "identify_all"]

callable_package(__name__, "vision_s2r.identify.identify:identify")
