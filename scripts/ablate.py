"""What each term of a translator's loss is worth; goes on where it was interrupted. Keys: configs/ablation.yaml.

`ablation=debug`: in a minute; `ablation.arms=[full,no_image]`: some arms; any other key goes to all jobs.
"""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("ablate")
