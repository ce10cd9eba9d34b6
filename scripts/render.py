"""Render scenes: paired views, labels and simulated grasps, as shards. Keys: configs/render/default.yaml."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("render")
