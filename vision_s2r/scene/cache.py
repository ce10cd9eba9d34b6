"""Where files that are derived from the code alone are kept between runs."""

import os
from pathlib import Path


def cache() -> Path:
    """$VISION_S2R_CACHE, else ~/.cache/vision_s2r."""
    return Path(os.environ.get("VISION_S2R_CACHE", Path.home() / ".cache" / "vision_s2r"))
