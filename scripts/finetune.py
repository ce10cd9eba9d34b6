"""Success against the number of real grasps, or go on with it. Keys: configs/finetune/default.yaml."""

from vision_s2r.cli import main
from vision_s2r.comparison import few_real_grasps
from vision_s2r.config import Config

if __name__ == "__main__":
    main(lambda cfg: print(few_real_grasps(cfg)), Config)
