"""All methods side by side, or go on with it: experiment=methods."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("compare")
