"""`vision-s2r reliability` from a checkout."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("reliability")
