"""The transfer table: how well each way from picture to grasp survives a camera it was not trained for.

In: a folder of rendered test scenes and checkpoints of policies and translators. Out: table.csv, table.json and
index.html, a page that shows the numbers and what they look like.
"""

from vision_s2r.evaluate.config import EvaluateConfig
from vision_s2r.evaluate.evaluate import evaluate
from vision_s2r.evaluate.table import Table

__all__ = ["EvaluateConfig", "Table", "evaluate"]
