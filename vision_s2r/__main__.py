"""`python -m vision_s2r COMMAND …`, the same as `vision-s2r COMMAND …`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main()
