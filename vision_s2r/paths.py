"""Where the configuration files lie."""

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent

# Inside the package where that is installed, beside it in a checkout.
CONFIGS = next(path for path in (_PACKAGE / "configs", _PACKAGE.parent / "configs") if path.is_dir())
