"""Train a grasp policy on rendered views, or go on with it; `grasp=randomized` trains the baseline."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("grasp")
