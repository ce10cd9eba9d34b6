"""The commands: what each is called, what it runs, and which configuration it reads. A new one is an entry here."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from vision_s2r.lazy import load

VISUAL, DIAGNOSIS, DYNAMICS, SPEED = (
    "Bridge the visual gap",
    "Diagnose the gap",
    "Bridge the dynamics gap",
    "Measure speed and reliability",
)


@dataclass(frozen=True)
class Command:
    """One command. `task` and `schema` are MODULE:NAME and only imported when it runs.

    The task takes an instance of the schema; where there is none, the overrides themselves. It returns the paths to
    look at, one or several, or nothing.
    """

    name: str  # as it is typed: "diagnose", "control follow"
    group: str  # under which it is listed
    help: str  # one line: what it does
    task: str
    schema: str | None = "vision_s2r.config:Config"
    config: str = "config"  # configs/CONFIG.yaml
    keys: tuple[str, ...] = ()  # parts of the configuration that its help explains; none: all of it
    examples: tuple[tuple[str, str], ...] = ()  # arguments, and what they are for
    result: str = ""  # what the returned paths are called
    words: tuple[str, ...] = ()  # keys of its first arguments where these are bare words: `import chessboard DIR`

    def load(self) -> tuple[Callable[..., Any], type[Any] | None]:
        """The task and the schema, imported."""
        return load(self.task), load(self.schema) if self.schema else None


_CONTROL: dict[str, Any] = {
    "group": DYNAMICS,
    "schema": "vision_s2r.control.config:ControlConfig",
    "config": "control",
    "result": "picture",
}

_ALL = (
    Command(
        "run",
        VISUAL,
        "The whole way: render, train translator and policies, evaluate",
        "vision_s2r.pipeline:run",
        keys=("",),
        examples=(
            ("experiment=demo", "small, in minutes"),
            ("experiment=cpu", "a few hours without a GPU"),
            ("experiment=full jobs=4", "everything, four trainings at a time"),
        ),
        result="transfer table",
    ),
    Command(
        "render",
        VISUAL,
        "Render scenes: randomized and canonical pictures, labels and simulated grasps",
        "vision_s2r.commands.visual:render",
        keys=("render", "scene"),
        examples=(
            ("render.scenes=200 render.out=renders/mine", "a small set"),
            ("render.real=true render.views=1", "with the appearance that stands for reality"),
        ),
    ),
    Command(
        "translate",
        VISUAL,
        "Train the translator: any look of a scene to its canonical view (RCAN)",
        "vision_s2r.commands.visual:translate",
        keys=("translate",),
        examples=(
            ("experiment=cpu", "on the views of that experiment"),
            ("translate=conditional_gan", "a plain conditional GAN instead"),
            ("translate.loss.adversarial=0.01 camera=harsh", "another loss, under another camera"),
        ),
    ),
    Command(
        "adapt",
        VISUAL,
        "Adapt to recorded real pictures without pairs (RL-CycleGAN, CycleGAN, GraspGAN)",
        "vision_s2r.commands.visual:adapt",
        keys=("adapt",),
        examples=(("adapt=graspgan", "another method"),),
    ),
    Command(
        "grasp",
        VISUAL,
        "Train a grasp policy on rendered views",
        "vision_s2r.commands.visual:grasp",
        keys=("grasp",),
        examples=(
            ("experiment=cpu", "on canonical views"),
            ("grasp=randomized", "the baseline: domain randomization"),
        ),
    ),
    Command(
        "evaluate",
        VISUAL,
        "Measure the transfer table: how well policies grasp through each camera",
        "vision_s2r.commands.visual:table",
        keys=("evaluate",),
        examples=(
            ("experiment=released", "the weights of the package, on scenes rendered for it"),
            ("experiment=released data.test.seed=7 data.test.scenes=200", "on fresh ones"),
            (
                "experiment=cpu 'evaluate.rows.rcan.policy=[POLICY]' 'evaluate.rows.rcan.translator=[TRANSLATOR]'",
                "checkpoints of your own",
            ),
        ),
    ),
    Command(
        "sensitivity",
        VISUAL,
        "Success against the strength of each camera effect",
        "vision_s2r.pipeline:measure_sensitivity",
        keys=("sensitivity",),
        examples=(("experiment=released", "of the weights of the package"),),
        result="summary",
    ),
    Command(
        "compare",
        VISUAL,
        "All methods side by side, trained on the same scenes",
        "vision_s2r.comparison:compare",
        keys=("", "evaluate"),
        examples=(("experiment=methods", "the published table"),),
        result="table",
    ),
    Command(
        "finetune",
        VISUAL,
        "Success against the number of real grasps",
        "vision_s2r.comparison:few_real_grasps",
        keys=("finetune",),
        examples=(("experiment=methods", "starts from the methods that `compare` trained"),),
        result="summary",
    ),
    Command(
        "metrics",
        VISUAL,
        "What translations do to pictures, and which metric foretells success",
        "vision_s2r.metrics:metrics",
        schema="vision_s2r.metrics:MetricsConfig",
        config="metrics",
        examples=(("'tables=[outputs/cpu]' out=outputs/metrics", "of a finished table"),),
    ),
    Command(
        "ablate",
        VISUAL,
        "What each term of the translator's loss is worth",
        "vision_s2r.ablation.sweep:ablate",
        schema=None,
        config="ablation",
        keys=("", "ablation"),
        examples=(
            ("ablation=debug", "in a minute"),
            ("'ablation.variants=[full,no_image]' seeds=3 jobs=2", "some variants, three trainings of each"),
        ),
    ),
    Command(
        "diagnose",
        DIAGNOSIS,
        "Where the gap of a recording lies, which effect causes it, how far it shrinks",
        "vision_s2r.diagnose.diagnose:diagnose_all",
        schema="vision_s2r.diagnose.config:DiagnoseConfig",
        config="diagnose",
        examples=(
            ("recording=DIR out=outputs/diagnosis", "one recording"),
            ("'recording=[DIR,DIR]' jobs=8", "several"),
            ("recording=DIR 'withhold=[backlash]'", "what if an effect were unknown?"),
        ),
        result="report",
    ),
    Command(
        "replay",
        DIAGNOSIS,
        "Another recording through the simulator before and after a diagnosis",
        "vision_s2r.diagnose.replay:replay_all",
        schema="vision_s2r.diagnose.replay:ReplayConfig",
        config="replay",
        examples=(("recording=DIR report=outputs/diagnosis/report.json", "nothing is fitted to it"),),
        result="replay",
    ),
    Command(
        "close-gap",
        DIAGNOSIS,
        "Diagnose a robot, train for what was diagnosed, measure what it won",
        "vision_s2r.close_gap.loop:close_gap",
        schema="vision_s2r.close_gap.config:CloseGapStudyConfig",
        config="close_gap",
        keys=("close_gap",),
        examples=(
            ("experiment=demo", "a withheld robot, small"),
            ("experiment=cpu recording=DIR", "the robot, or the camera, of a recording"),
        ),
        result="summary",
    ),
    Command(
        "gapbench",
        DIAGNOSIS,
        "The benchmark of diagnosis: machines with withheld answers, and a score",
        "vision_s2r.gapbench.bench:bench",
        schema="vision_s2r.gapbench.config:GapbenchConfig",
        config="gapbench",
        examples=(
            ("kind=joint set=tuning seed=0", "generate, diagnose and score"),
            ("kind=camera stage=score", "score recordings that are there"),
            ("kind=joint stage=follow", "what unsettled diagnoses ask to record, beside random commands"),
        ),
    ),
    Command(
        "hardware",
        DIAGNOSIS,
        "Measured machines: every real log diagnosed, and tried on the others",
        "vision_s2r.hardware.study:study",
        schema="vision_s2r.hardware.config:HardwareConfig",
        config="hardware",
        examples=(("path=tests/data/emps", "the tables of the docs"), ("path=DIR 'only=[Wrist_Roll]'", "a part of it")),
        result="table",
    ),
    Command(
        "reliability",
        SPEED,
        "What spoilt inputs do to readers, and SIGKILL to commands, counted",
        "vision_s2r.reliability:reliability",
        schema="vision_s2r.reliability:ReliabilityConfig",
        config="reliability",
        examples=(
            ("'checks=[fuzz]' inputs=1000", "spoilt inputs of every reader"),
            ("'checks=[kill]' 'commands=[render]' times=50", "one command, killed at 50 random moments"),
        ),
        result="table",
    ),
    Command(
        "import",
        DIAGNOSIS,
        "Logs of other projects (SAGE, BAM, LeRobot, any CSV), photographs of a chessboard or a bench, as recordings",
        "vision_s2r.imports:import_all",
        schema="vision_s2r.imports:ImportConfig",
        config="import",
        words=("source", "path"),
        examples=(
            ("source=chessboard path=DIR out=recordings/board", "photographs of a board beside an ideal one"),
            ("source=images real=DIR sim=DIR", "photographs beside renders"),
            ("source=sage path=DIR out=recordings/so101", "a recording a joint of a motion"),
            ("path=log.csv '+columns={t: time, position: angle, target: goal}' drive=sts3215", "any table"),
        ),
        result="recording",
    ),
    Command(
        "identify",
        DYNAMICS,
        "The parameters of a joint from its recordings, the effects given",
        "vision_s2r.identify:identify_all",
        schema="vision_s2r.identify:IdentifyConfig",
        config="identify",
        examples=(
            ("recording=DIR 'effects=[backlash]' out=outputs/identified", "beside the nominal parameters"),
            ("recording=DIR report=outputs/diagnosis/report.json", "the effects that a diagnosis found"),
            ("example=two_point out=outputs/two_point", "a joint from two steady states, worked out"),
        ),
        result="written",
    ),
    Command(
        "actuator",
        DYNAMICS,
        "An actuator network in the motor's place, and policies that transfer because of it",
        "vision_s2r.actuator.run:run",
        schema="vision_s2r.actuator.config:ActuatorConfig",
        config="actuator",
        examples=(("actuator=small out=outputs/actuator", "in two minutes"),),
        result="picture",
    ),
    Command(
        "control follow",
        help="Policies trained on the wrong simulator and on randomized ones, in reality",
        task="vision_s2r.control.follow:follow",
        examples=(("control=small", "in a few minutes"),),
        **_CONTROL,
    ),
    Command(
        "control ablate",
        help="What each randomization is worth, one frozen at a time",
        task="vision_s2r.control.ablate:ablate",
        examples=(("control=small", "in a few minutes"),),
        **_CONTROL,
    ),
    Command(
        "control adr",
        help="Automatic domain randomization: ranges that widen while the policy performs",
        task="vision_s2r.control.adr:adr",
        examples=(("control=small", "in a few minutes"),),
        **_CONTROL,
    ),
    Command(
        "translate-video",
        VISUAL,
        "A camera's stream (a video, or a folder of pictures) beside its canonical view",
        "vision_s2r.translate.video:translate_video",
        schema="vision_s2r.translate.video:VideoConfig",
        config="translate_video",
        examples=(("source=bench.mp4 out=canonical.mp4", "by the released translator"),),
        result="video",
    ),
    Command(
        "export translator",
        VISUAL,
        "A translator as ONNX, for programs without torch",
        "vision_s2r.export:export_translator",
        schema="vision_s2r.export:ExportConfig",
        config="export",
        examples=(("checkpoint=bin-64", "the released one"),),
        result="network",
    ),
    Command(
        "export policy",
        VISUAL,
        "A policy's Q as ONNX; the search for its best grasp stays outside",
        "vision_s2r.export:export_policy",
        schema="vision_s2r.export:ExportConfig",
        config="export",
        examples=(("checkpoint=bin-64-student", "the released one"),),
        result="network",
    ),
    Command(
        "export lerobot",
        VISUAL,
        "A recording of a joint or an arm, or renders with their grasps, as a LeRobot data set",
        "vision_s2r.export.lerobot:export_lerobot",
        schema="vision_s2r.export.lerobot:LeRobotConfig",
        config="export_lerobot",
        examples=(
            ("recording=DIR out=outputs/lerobot", "of a robot"),
            ("renders=renders/demo/pairs out=outputs/lerobot", "of the simulator"),
        ),
        result="data set",
    ),
    Command(
        "export rerun",
        DIAGNOSIS,
        "A replay and a diagnosis as a recording for Rerun's viewer",
        "vision_s2r.export.rerun:export_rerun",
        schema="vision_s2r.export.rerun:RerunConfig",
        config="export_rerun",
        examples=(("replay=outputs/replay report=outputs/diagnosis/report.json out=outputs/replay.rrd", "both"),),
        result="recording",
    ),
    Command(
        "benchmark render",
        SPEED,
        "Pairs a second, against the engine's limit and the usual loop",
        "vision_s2r.benchmarks:render",
        keys=("render", "scene"),
    ),
    Command(
        "benchmark scale",
        SPEED,
        "What a million scenes cost, on one node, ten and a hundred",
        "vision_s2r.benchmarks:scale",
        keys=("data", "scene"),
        result="table",
    ),
    Command(
        "benchmark translate",
        SPEED,
        "The translator against the U-Net of the literature: speed, and errors after the same time",
        "vision_s2r.benchmarks:translate",
        keys=("benchmark",),
    ),
    Command(
        "benchmark grasp",
        SPEED,
        "Three forms of Q on the same data in the same minutes",
        "vision_s2r.benchmarks:grasp",
        schema=None,
        keys=("grasp",),
    ),
    Command(
        "benchmark export",
        SPEED,
        "Milliseconds from a picture to a grasp, torch beside onnxruntime",
        "vision_s2r.benchmarks:export",
        keys=("",),
    ),
    Command(
        "benchmark joint",
        SPEED,
        "Steps a second of the joint simulator, against a NumPy loop and PyBullet",
        "vision_s2r.benchmarks:joint",
        keys=("",),
    ),
    Command(
        "benchmark contact",
        SPEED,
        "Steps a second of the contact simulator, against PyBullet",
        "vision_s2r.benchmarks:contact",
        keys=("",),
    ),
    Command(
        "benchmark sysid",
        SPEED,
        "An arm's diagnosis beside MuJoCo's system identification, which is told what is wrong",
        "vision_s2r.benchmarks:sysid",
        keys=("",),
    ),
    Command(
        "benchmark control",
        SPEED,
        "Steps a second of the speed-tracking environment, against a Python loop",
        "vision_s2r.benchmarks:control",
        keys=("",),
    ),
)

COMMANDS = {command.name: command for command in _ALL}
FAMILIES = {
    "control": "Controllers of a joint's speed across the dynamics gap",
    "export": "Networks, recordings and findings for other programs",
    "benchmark": "Speed, side by side with the usual way",
}
