"""Few real grasps: how success grows with the number of labelled grasps on the real robot.

In: recorded real pictures with grasps and their success (`vision_s2r.render.Recorded`), policies to begin with and
the translators that they look through. Out: finetune.json, finetune.csv and finetune.png, success against the number of
real grasps.
"""

from vision_s2r.finetune.config import FinetuneConfig
from vision_s2r.finetune.finetune import Start, finetune

__all__ = ["FinetuneConfig", "Start", "finetune"]
