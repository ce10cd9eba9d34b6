"""The parameters of a joint from its recordings, the effects given: `recording=DIR out=DIR effects=[backlash]`."""

from vision_s2r.cli import main
from vision_s2r.identify import IdentifyConfig, identify_all

if __name__ == "__main__":
    main(lambda cfg: [print(f"written: {path}") for path in identify_all(cfg)], IdentifyConfig, "identify")
