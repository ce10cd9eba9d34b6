"""Success against the strength of each camera effect, or go on with it."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("sensitivity")
