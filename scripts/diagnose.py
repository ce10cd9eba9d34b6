"""Where the gap of a recording lies, which effect causes it, how far it shrinks: `recording=DIR out=DIR`."""

from vision_s2r.cli import main
from vision_s2r.diagnose.config import DiagnoseConfig
from vision_s2r.diagnose.diagnose import diagnose_all

if __name__ == "__main__":
    main(lambda cfg: [print(f"report: {path}") for path in diagnose_all(cfg)], DiagnoseConfig, "diagnose")
