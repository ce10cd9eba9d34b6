"""How each contact effect is fitted, one a file. Importing this package registers every file's record."""

import importlib
import pkgutil

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")
