"""What each term of a translator's loss is worth; goes on where it was interrupted.

`ablation=debug`: in a minute; `ablation.variants=[full,no_image]`: some variants; any other key goes to all jobs.
"""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("ablate")
