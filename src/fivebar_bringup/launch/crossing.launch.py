"""Makes the run of a scenario under `ros2 launch`, as `fivebar run` does, and ends with it.

ros2 launch fivebar_bringup crossing.launch.py scenario:=middle mode:=lockstep out:=runs/from_launch

Bag, report and summary are in the directory that the last lines name. The launch fails where the run did not complete.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, ExecuteProcess, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration

from fivebar_bringup.runs.graph import Hardware, Mode
from fivebar_bringup.runs.launching import run_command

STOP_TIMEOUT = "30"
"""Time (s) that the run has after Ctrl-C to stop its nodes in order, the recorder last."""


def start_run(context):
    """Return the process of the run, and what ends the launch with it."""
    scenario, mode, out = (LaunchConfiguration(name).perform(context) for name in ("scenario", "mode", "out"))
    command = run_command(scenario, Mode(mode), out, Hardware.SIMULATED)
    run = ExecuteProcess(
        cmd=list(command), name="fivebar_run", output="screen", sigterm_timeout=STOP_TIMEOUT, emulate_tty=True
    )
    return [run, RegisterEventHandler(OnProcessExit(target_action=run, on_exit=end_with_run))]


def end_with_run(event, context):
    """End the launch; fail where the run failed."""
    if event.returncode != 0:
        raise RuntimeError(f"the run did not complete: exit status {event.returncode}")
    return [EmitEvent(event=Shutdown(reason="the run has ended"))]


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="middle", description="Shipped scenario or a YAML file."),
            DeclareLaunchArgument("mode", default_value="lockstep", choices=[mode.value for mode in Mode]),
            DeclareLaunchArgument("out", default_value="", description="New directory for the results."),
            OpaqueFunction(function=start_run),
        ]
    )
