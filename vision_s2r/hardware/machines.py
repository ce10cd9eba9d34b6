"""Which machines a folder has logs of."""

from dataclasses import dataclass
from pathlib import Path

from vision_s2r.errors import UserError
from vision_s2r.imports.convert import import_recording

# What is known of public logs from elsewhere, by the machine's name up to its first /.
EXPERTS = {
    "emps": "asymmetric friction: a screw that is worn (Janot, Gautier, Brunot 2019)",
    "so101": "gains and damping are not the model's; the bus and the firmware take 15 to 20 ms",
    "sts3250": "friction that grows with the load (Duclusaud et al. 2024), and no back-EMF where the drive is off",
    "xl330": "friction that grows with the load, by 0.2 of the motor's torque and 0.1 to 0.3 of the load's (BAM's M6)",
}


@dataclass(frozen=True)
class MachineRecordings:
    """Recordings of one machine, by what was done."""

    name: str
    recordings: dict[str, Path]

    @property
    def expert(self) -> str:
        """What is known of it; – where nothing is."""
        return EXPERTS.get(self.name.split("/")[0], "–")


def machines(path: Path, imported: Path) -> list[MachineRecordings]:
    """All machines of a folder; logs that are none of our recordings are imported into another, once.

    Recordings that lie side by side are of one machine, and so are the motions of one joint. Raises UserError where
    there is none.
    """
    found: dict[str, dict[str, Path]] = {}
    for folder in sorted(each for each in [path, *path.rglob("*")] if each.is_dir()):
        name = str(folder.relative_to(path))
        if _is_recording(folder):
            found.setdefault(_named(folder.parent if folder != path else path, path), {})[folder.name] = folder
        elif any(folder.glob("*/control.csv")):
            _import("sage", folder, imported / name)
            for each in sorted((imported / name).glob("*/*/recording.yaml")):
                joint = f"{_named(folder, path).removesuffix('/sage')}/{each.parent.name}"
                found.setdefault(joint, {})[each.parent.parent.name] = each.parent
        elif any('"entries"' in each.read_text(encoding="utf-8") for each in folder.glob("*.json")):
            _import("bam", folder, imported / name)
            found.setdefault(_named(folder, path), {})["all logs"] = imported / name
    if not found:
        raise UserError(
            f"{path}: no logs in it, expected recordings of joints, arms or cameras, motions of SAGE or benches of BAM"
        )
    return [MachineRecordings(name, recordings) for name, recordings in sorted(found.items())]


def _is_recording(folder: Path) -> bool:
    header = folder / "recording.yaml"
    if not header.is_file():
        return False
    content = header.read_text(encoding="utf-8")
    return any(f"kind: {kind}" in content for kind in ("joint", "arm", "camera"))


def _named(folder: Path, path: Path) -> str:
    return folder.name if folder == path else str(folder.relative_to(path))


def _import(source: str, folder: Path, out: Path) -> None:
    if not out.exists():
        import_recording(source, folder, out)
