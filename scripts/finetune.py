"""Success against the number of real grasps, or go on with it. Keys: configs/finetune/default.yaml."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("finetune")
