"""Runs an experiment under `ros2 launch`: estimator, controllers, bridge and recorder, with real or emulated drives.

ros2 launch fivebar_bringup robot.launch.py scenario:=middle_robot hardware:=emulated out:=runs/rehearsed
ros2 launch fivebar_bringup robot.launch.py scenario:=mine.yaml hardware:=socketcan drives:=/path/to/drives.yaml
ros2 launch fivebar_bringup robot.launch.py scenario:=motkin_middle hardware:=usb port:=/dev/ttyACM0

This is the run of `fivebar run SCENARIO --hardware ...`: it shuts down when the run ends, and fails if it did not
succeed. Emulated drives and a motor board are powered as soon as all nodes are ready; real drives on a bus once the
operator has configured and activated the bridge, or by themselves with activate:=true.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration

from fivebar_bringup.runs.graph.node_spec import Hardware, Mode
from fivebar_bringup.runs.launching import run_command

STOP_TIMEOUT = "120"
"""Time (s) for the run to stop its nodes in order after Ctrl-C, the recorder last; longer than the run itself waits."""


def start_experiment(context):
    """Return the process of the run, and the handler that shuts the launch down with it."""
    names = ("scenario", "hardware", "drives", "port", "out", "namespace")
    scenario, hardware, drives, port, out, namespace = (LaunchConfiguration(name).perform(context) for name in names)
    activate, scene = (LaunchConfiguration(name).perform(context) == "true" for name in ("activate", "scene"))
    command = run_command(
        *(scenario, Mode.REALTIME, out, Hardware(hardware)),
        scene=scene,
        namespace=namespace,
        drives=drives,
        port=port,
        activate=activate,
    )
    run = ExecuteProcess(
        cmd=list(command), name="fivebar_run", output="screen", sigterm_timeout=STOP_TIMEOUT, emulate_tty=True
    )
    return [run, RegisterEventHandler(OnProcessExit(target_action=run, on_exit=end_with_run))]


def end_with_run(event, context):
    """Shut the launch down; fail if the run failed."""
    if event.returncode != 0:
        raise RuntimeError(f"the run did not succeed: exit status {event.returncode}")
    return [EmitEvent(event=Shutdown(reason="the run has ended"))]


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
                description="With socketcan: configuration of the drives; with usb: that of the board.",
            ),
            DeclareLaunchArgument(
                "activate",
                default_value="false",
                choices=["true", "false"],
                description="With socketcan: enable the drives as soon as all nodes are ready, without the operator.",
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
