"""The parameters of a joint from its recordings, the effects given: `recording=DIR out=DIR effects=[backlash]`."""

from vision_s2r.commands.main import main

if __name__ == "__main__":
    main("identify")
