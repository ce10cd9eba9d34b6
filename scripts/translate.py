"""Train a translator on rendered views, or go on with it. Keys: configs/translate/rcan.yaml."""

from vision_s2r.cli import main
from vision_s2r.config import Config
from vision_s2r.pipeline import paired_translator

if __name__ == "__main__":
    main(lambda cfg: print(paired_translator(cfg, cfg.seed)), Config)  # in OUT/translator-SEED
