"""Runs an experiment under `ros2 launch`: estimator, controllers, bridge and recorder, with real or emulated drives.

ros2 launch fivebar_bringup robot.launch.py scenario:=middle_robot hardware:=emulated out:=runs/rehearsed
ros2 launch fivebar_bringup robot.launch.py scenario:=mine.yaml hardware:=socketcan drives:=/path/to/drives.yaml
ros2 launch fivebar_bringup robot.launch.py scenario:=motkin_middle hardware:=usb port:=/dev/ttyACM0

With emulated drives, or a motor board on a port, this is the run of `fivebar run SCENARIO --hardware emulated`, or
`usb`: it powers the motors as soon as all nodes are ready, shuts down when it ends, and fails if it is not completed.
With real drives on a bus the nodes run until one of them ends or you stop them, and the bridge waits to be activated;
`fivebar report DIRECTORY` makes the report.
"""

from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    ExecuteProcess,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
)
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration

from fivebar_bringup.runs.graph.node_spec import Hardware, Mode
from fivebar_bringup.runs.launching import drive_processes, run_command

DEFAULT_DRIVES = "dextar_socketcan"

STOP_TIMEOUT = "30"
"""Time (s) for a node to stop in order after Ctrl-C."""

RUN_STOP_TIMEOUT = "120"
"""The same for a run, which stops its nodes one group after the other; longer than it waits itself."""


def start_experiment(context):
    """Return the processes of the experiment, with the handlers that shut the launch down."""
    names = ("scenario", "hardware", "drives", "port", "out")
    scenario, hardware, drives, port, out = (LaunchConfiguration(name).perform(context) for name in names)
    namespace = LaunchConfiguration("namespace").perform(context)
    scene = LaunchConfiguration("scene").perform(context) == "true"
    if hardware != "socketcan":
        command = run_command(
            *(scenario, Mode.REALTIME, out, Hardware(hardware)),
            scene=scene,
            namespace=namespace,
            drives=drives,
            port=port,
        )
        return [*process("fivebar_run", command, RUN_STOP_TIMEOUT)]
    directory, started = drive_processes(scenario, drives or DEFAULT_DRIVES, out, scene, namespace)
    message = LogInfo(msg=f"results in {directory}; afterwards: fivebar report {directory}")
    return [message, *(action for one in started for action in process(one.name, one.command, STOP_TIMEOUT))]


def process(name, command, stop_timeout):
    """Return a process whose end shuts the launch down, and whose failure fails it."""
    action = ExecuteProcess(
        cmd=list(command), name=name, output="screen", sigterm_timeout=stop_timeout, emulate_tty=True
    )

    def end(event, context):
        if event.returncode != 0:
            raise RuntimeError(f"{name} failed: exit status {event.returncode}")
        return [EmitEvent(event=Shutdown(reason=f"{name} has ended"))]

    return action, RegisterEventHandler(OnProcessExit(target_action=action, on_exit=end))


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", default_value="middle_robot", description="Shipped scenario or a YAML file."
            ),
            DeclareLaunchArgument("hardware", default_value="emulated", choices=["emulated", "socketcan", "usb"]),
            DeclareLaunchArgument(
                "drives",
                default_value="",
                description=f"With socketcan: drive configuration ({DEFAULT_DRIVES}); with usb: that of the board.",
            ),
            DeclareLaunchArgument("port", default_value="", description="With usb: such as /dev/ttyACM0."),
            DeclareLaunchArgument("out", default_value="", description="New directory for the results."),
            DeclareLaunchArgument(
                "scene", default_value="false", choices=["true", "false"], description="Pictures for RViz and Foxglove."
            ),
            DeclareLaunchArgument("namespace", default_value="", description="Of all nodes, such as robot1."),
            OpaqueFunction(function=start_experiment),
        ]
    )
