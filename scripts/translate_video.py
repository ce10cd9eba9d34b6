"""A camera's stream beside its canonical view: `source=FILE|DIR out=FILE.mp4`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("translate-video")
