"""Any table in a CSV or parquet file, its columns named by the user."""

from pathlib import Path

import numpy as np
import pandas

from vision_s2r.errors import UserError, nearest
from vision_s2r.imports.table import ImportOptions, JointTable
from vision_s2r.recording.joint import COLUMNS


def load(path: Path, options: ImportOptions) -> list[JointTable]:
    """The one joint of a file. Raises UserError for columns that are not there, or are no numbers."""
    try:
        parquet = path.suffix == ".parquet"
        table = pandas.read_parquet(path) if parquet else pandas.read_csv(path, skipinitialspace=True)
    except ImportError as error:
        raise UserError("parquet files need pyarrow: pip install pyarrow") from error
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror})") from error
    except ValueError as error:
        raise UserError(f"{path}: is no table ({str(error).splitlines()[0]})") from error
    columns: dict[str, np.ndarray] = {}
    for ours in COLUMNS:
        theirs = options.columns.get(ours, ours)
        if theirs in table.columns:
            values = pandas.to_numeric(table[theirs], errors="coerce").to_numpy(float)
            columns[ours] = values * options.scale.get(ours, 1.0)
        elif ours in options.columns:
            raise UserError(f"{path}: no column '{theirs}', {nearest(theirs, map(str, table.columns))}")
    for ours in options.columns:
        if ours not in COLUMNS:
            raise UserError(f"columns: '{ours}' is none of ours, {nearest(ours, COLUMNS)}")
    columns.setdefault("episode", np.zeros(len(table)))
    for ours in ("t", "position"):
        if ours not in columns:
            theirs = ", ".join(map(str, table.columns))
            raise UserError(
                f"{path}: no column {ours} among {theirs}; say which it is: +columns={{{ours}: THEIR_NAME}}"
            )
    known = {options.columns.get(ours, ours) for ours in columns}
    left_out = {str(name): "not asked for" for name in table.columns if name not in known}
    return [JointTable(path.stem, columns, "", left_out=left_out)]
