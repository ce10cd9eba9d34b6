"""What translations do to pictures, and which metric of a picture foretells grasp success.

In: finished folders of `vision-s2r evaluate`. Out: metrics.csv, metrics.json and two figures: how near each row's
translations are to the true canonical pictures, how often they drop, invent, move or recolour an object, how much they
change Q, and how each of these goes with grasp success over checkpoints and columns.
"""

from vision_s2r.metrics.config import MetricsConfig
from vision_s2r.metrics.metrics import metrics

__all__ = ["MetricsConfig", "metrics"]
