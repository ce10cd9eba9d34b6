"""Render scenes: paired views, labels and simulated grasps, as shards. Keys: configs/render/default.yaml."""

from vision_s2r.cli import main
from vision_s2r.config import Config
from vision_s2r.render import render

if __name__ == "__main__":
    main(lambda cfg: render(cfg.scene, cfg.render), Config)
