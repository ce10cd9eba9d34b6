"""All methods side by side, or go on with it: experiment=methods. Keys: configs/config.yaml."""

from vision_s2r.cli import main
from vision_s2r.comparison import compare
from vision_s2r.config import Config

if __name__ == "__main__":
    main(lambda cfg: print(compare(cfg)), Config)
