"""Render scenes: paired views, labels and simulated grasps, as shards."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("render")
