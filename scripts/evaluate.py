"""Measure the transfer table: CSV, JSON and one page. Keys: configs/evaluate/default.yaml."""

from vision_s2r.cli import main
from vision_s2r.config import Config
from vision_s2r.evaluate import evaluate

if __name__ == "__main__":
    main(lambda cfg: evaluate(cfg.evaluate, cfg.scene), Config)
