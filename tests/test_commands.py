"""The command line as people meet it: help, mistakes, completion; and that every entry of its table is true."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from vision_s2r.cli import compose
from vision_s2r.commands.keys import groups, keys
from vision_s2r.commands.main import main
from vision_s2r.commands.table import COMMANDS

SCRIPTS = Path(__file__).parents[1] / "scripts"


def typed(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", ["vision-s2r", *arguments])
    main()


@pytest.mark.parametrize("command", COMMANDS.values(), ids=list(COMMANDS))
def test_what_help_says_of_a_command_is_true(command, monkeypatch, capsys):
    task, schema = command.load()
    assert callable(task)
    for arguments, _ in command.examples if schema else []:
        compose(schema, command.config, shlex.split(arguments))
    typed(monkeypatch, *command.name.split(), "--help")
    shown = capsys.readouterr().out
    explained = keys(command)
    assert command.help in shown and explained and all(key.name in shown for key in explained)
    assert sum(bool(key.comment) for key in explained) > len(explained) / 4
    assert all(group.chosen in group.options for group in groups(command))


def test_every_script_is_a_door_to_a_command_and_every_command_has_one():
    doors = {path.stem.replace("_", "-") for path in SCRIPTS.glob("*.py")}
    assert doors == {name.split()[0] for name in COMMANDS}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["daignose"], "error: no command 'daignose': did you mean 'diagnose'?"),
        (["control", "folow"], "error: control: no command 'folow': did you mean 'follow'?"),
        (["diagnose", "recordin=x"], "error: unknown configuration key 'recordin': did you mean 'recording'?"),
        (["import", "columns={t: time}"], "error: configuration key 'columns': names are added to it: +columns={…}"),
        (["completion", "fish"], "error: completion: no shell 'fish': did you mean 'zsh'?"),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_2(arguments, message, monkeypatch, capsys):
    with pytest.raises(SystemExit) as left:
        typed(monkeypatch, *arguments)
    assert left.value.code == 2 and capsys.readouterr().err == message + "\n"


def test_help_imports_nothing_heavy():
    code = "import sys; from vision_s2r.commands.main import main; sys.argv[1:] = ['diagnose', '--help']; main(); "
    code += "print({'torch', 'numpy', 'hydra', 'scipy', 'numba'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.endswith("set()\n")


def test_bash_completes_commands_keys_and_choices(monkeypatch, capsys):
    expected = {
        "vision-s2r diag": "diagnose",
        "vision-s2r control f": "follow",
        "vision-s2r diagnose recording=DIR jo": "jobs=",
        "vision-s2r translate camera=ph": "phone",  # readline keeps what is before "="
        "vision-s2r diagnose recording=/tm": "",  # … and completes files itself
    }
    typed(monkeypatch, "completion", "bash")
    lines = [capsys.readouterr().out]
    lines += [
        f'COMP_LINE="{line}"; COMP_POINT=${{#COMP_LINE}}; _vision_s2r; echo "${{COMPREPLY[0]-}}"' for line in expected
    ]
    done = subprocess.run(["bash"], input="\n".join(lines), capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == list(expected.values())


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the wheel holds."""
    out = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out)]
    subprocess.run(build, cwd=SCRIPTS.parent, check=True, capture_output=True)
    site = out / "site"
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", str(site)]
    subprocess.run([*command, *map(str, out.glob("*.whl"))], check=True)
    return site


def test_the_wheel_works_from_an_empty_folder(installed, tmp_path):
    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": str(installed)}
        command = [installed / "bin" / "vision-s2r", *arguments]
        return subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)

    assert all((installed / "vision_s2r" / name).exists() for name in ("py.typed", "report/templates/report.html"))
    assert "camera.evidence" in run("diagnose", "--help").stdout
    wrong = run("diagnose", "recording=nowhere")
    assert wrong.returncode == 2
    assert wrong.stderr.splitlines()[-1] == "error: nowhere: no such folder, expected a recording"


def test_pybullet_says_nothing():
    done = subprocess.run([sys.executable, "-c", "import vision_s2r.bullet"], capture_output=True, check=True)
    assert not done.stdout + done.stderr
