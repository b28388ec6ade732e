# SPDX-License-Identifier: Apache-2.0
"""How the processes of a run start, run and end, with processes that are no nodes."""

from __future__ import annotations

import errno
import json
import os
import select
import signal
import subprocess
import sys
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from fivebar_bringup.graph.node_spec import NodeSpec
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.runs import launcher
from fivebar_bringup.runs.launcher import stop_all
from fivebar_bringup.runs.node_processes import STARTER, NodeProcess, NodesNotStarted, start_processes
from fivebar_bringup.runs.node_starter import COMMON_MODULES, LONGEST_NAME, NodeCommand, StartRequest
from fivebar_bringup.runs.processes import ProcessSpec
from fivebar_description.ros.run import MIDDLEWARE_LEFT

DOMAIN = 42
PACKAGE = "processes_of_this_test"
DEADLINE = 120.0

PROGRAMS = {
    "reports_itself": """
        import json, os, pathlib, sys
        def main():
            print(json.dumps({
                "arguments": sys.argv[1:],
                "parameters": pathlib.Path(sys.argv[-1]).read_text(),
                "domain": os.environ["ROS_DOMAIN_ID"],
                "pid": os.getpid(),
                "parent": os.getppid(),
                "session": os.getsid(0),
                "name": pathlib.Path("/proc/self/comm").read_text().strip(),
            }))
            print("that is all", file=sys.stderr)
    """,
    "exits": "import sys\ndef main(): sys.exit(3)",
    "raises": "def main(): raise ValueError('no such thing')",
    "interrupted": """
        import os, signal
        os.kill(os.getpid(), signal.SIGINT)
        def main():
            raise RuntimeError("not reached")
    """,
    "never_taken_apart": """
        import ctypes
        from fivebar_description.ros import run
        from fivebar_description.ros.node import GraphNode
        run.TEARDOWN_TIME = 0.2
        class Stuck(GraphNode):
            def __init__(self):
                super().__init__("stuck")
                print("made", flush=True)
            def stop(self):
                print("stopped", flush=True)
            def destroy_node(self):
                ctypes.PyDLL(None).pause()  # with the lock of the interpreter
        def main():
            run.run_nodes([Stuck])
    """,
    "writes_on": """
        import pathlib, signal, sys, time
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        def main():
            print("begun", flush=True)
            signal.sigwait([signal.SIGINT])
            for size in range(10):
                pathlib.Path(sys.argv[-1]).with_name(f"part{size}").write_text("more")
                time.sleep(0.1)
    """,
    "waits": """
        import signal
        signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
        def main():
            print("begun", flush=True)
            signal.pause()
    """,
}


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RunDirectory:
    folder = tmp_path / "modules" / PACKAGE / "nodes"
    folder.mkdir(parents=True)
    for name, program in PROGRAMS.items():
        (folder / f"{name}.py").write_text(textwrap.dedent(program), encoding="utf-8")
    executables = [f'{name} = Executable("{PACKAGE}.nodes.{name}")\n' for name in PROGRAMS]
    executable = "from fivebar_description.executable import Executable\n"
    (folder.parent / "executables.py").write_text("".join([executable, *executables]), encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path / "modules")
    before = os.environ.get("PYTHONPATH")
    path = os.pathsep.join(filter(None, (str(tmp_path / "modules"), before)))
    monkeypatch.setenv("PYTHONPATH", path)
    (tmp_path / "run").mkdir()
    return RunDirectory(tmp_path / "run")


@pytest.fixture
def processes() -> Iterator[dict[str, NodeProcess]]:
    started: dict[str, NodeProcess] = {}
    yield started
    for process in started.values():
        process.send(signal.SIGKILL)
        assert process.wait(time.monotonic() + DEADLINE)


def spec(name: str) -> ProcessSpec:
    return ProcessSpec(name, (NodeSpec(PACKAGE, name, {"rate_hz": 500}, (), ()),))


def wait_for_line(run: RunDirectory, name: str, line: str) -> None:
    """Wait until a process has printed a line."""
    log = run.logs / f"{name}.log"
    end = time.monotonic() + DEADLINE
    while line not in log.read_text(encoding="utf-8").splitlines():
        assert time.monotonic() < end, log.read_text(encoding="utf-8")
        time.sleep(0.02)


def wait(process: NodeProcess) -> int | None:
    assert process.wait(time.monotonic() + DEADLINE)
    return process.status


@pytest.mark.extra
def test_a_process_has_what_its_own_command_would_have_given_it(
    run: RunDirectory, processes: dict[str, NodeProcess]
) -> None:
    start_processes([spec("reports_itself")], run, DOMAIN, processes)
    process = processes["reports_itself"]
    assert wait(process) == 0
    reported = json.loads((run.logs / "reports_itself.log").read_text(encoding="utf-8").splitlines()[0])
    parameters = run.parameters / "reports_itself.yaml"
    assert reported == {
        "arguments": ["--ros-args", "--params-file", str(parameters)],
        "parameters": spec("reports_itself").parameter_file(),
        "domain": str(DOMAIN),
        "pid": process.pid,
        "parent": os.getpid(),
        "session": process.pid,
        "name": "reports_itself"[:LONGEST_NAME],
    }
    assert process.last_line() == "that is all"


@pytest.mark.extra
def test_how_a_process_has_ended(run: RunDirectory, processes: dict[str, NodeProcess]) -> None:
    programs = ["exits", "raises", "interrupted", "waits"]
    start_processes([spec(name) for name in programs], run, DOMAIN, processes)
    assert list(processes) == programs
    assert wait(processes["exits"]) == 3
    assert wait(processes["raises"]) == 1
    assert processes["raises"].last_line() == "ValueError: no such thing"
    # an interrupt while a node still loads its modules
    assert wait(processes["interrupted"]) == 0
    assert processes["interrupted"].last_line() == ""
    waiting = processes["waits"]
    assert waiting.status is None
    assert not waiting.wait(time.monotonic() + 0.05)
    waiting.send(signal.SIGKILL)
    assert wait(waiting) == -signal.SIGKILL
    # one that has ended can be asked again, waited for and sent signals
    waiting.send(signal.SIGINT)
    assert wait(waiting) == -signal.SIGKILL


def test_what_nodes_of_a_process_lack_is_in_its_log(tmp_path: Path) -> None:
    log = tmp_path / "control.log"
    process = NodeProcess("control", os.getpid(), log)
    log.write_text("loading\n", encoding="utf-8")
    assert not process.has_begun and process.not_ready() == []
    log.write_text(
        "[INFO] [1.5] [blender]: waits for /reference\n"
        "[WARN] [6.5] [blender]: not ready: /reference has no publisher\n"
        "[WARN] [6.6] [state_estimator]: not ready: /imu/data has no publisher; /motor_states has no publisher\n"
        "[WARN] [7.0] [state_estimator]: not ready: /imu/data has no publisher\n"
        "[INFO] [8.0] [blender]: ready: all inputs are there, plan f8999f9ae864\n",
        encoding="utf-8",
    )
    assert process.has_begun
    assert process.not_ready() == ["state_estimator: /imu/data has no publisher"]


@pytest.mark.extra
def test_a_node_whose_middleware_does_not_end_has_done_its_work(
    run: RunDirectory, processes: dict[str, NodeProcess]
) -> None:
    start_processes([spec("never_taken_apart")], run, DOMAIN, processes)
    wait_for_line(run, "never_taken_apart", "made")
    assert stop_all(processes, run.bag) == []
    assert processes["never_taken_apart"].status == 0
    text = (run.logs / "never_taken_apart.log").read_text(encoding="utf-8")
    assert "stopped" in text
    assert text.endswith(f": {MIDDLEWARE_LEFT}\n")


@pytest.mark.extra
@pytest.mark.parametrize("program", ["writes_on", "waits"])
def test_a_recorder_is_waited_for_as_long_as_its_bag_grows(
    run: RunDirectory, processes: dict[str, NodeProcess], monkeypatch: pytest.MonkeyPatch, program: str
) -> None:
    """It takes a second, and may take half of that between two parts; the other one ignores the signal."""
    monkeypatch.setattr(launcher, "RECORDER_STOP_TIMEOUT", 0.5)
    monkeypatch.setattr(launcher, "PROGRESS_PERIOD", 0.02)
    start_processes([spec(program)], run, DOMAIN, processes)
    wait_for_line(run, program, "begun")
    recorders = {launcher.RECORDER: processes[program]}
    # the parts are beside the file of parameters
    faults = stop_all(recorders, run.parameters)
    if program == "writes_on":
        assert faults == []
        assert len(list(run.parameters.glob("part*"))) == 10
    else:
        assert [fault.partition(":")[0] for fault in faults] == ["node_stuck"]


def test_where_the_starter_fails_nothing_runs(
    run: RunDirectory, processes: dict[str, NodeProcess], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "executable", "/bin/false")
    with pytest.raises(NodesNotStarted, match="status 1"):
        start_processes([spec("waits")], run, DOMAIN, processes)
    assert not processes


@pytest.mark.extra
def test_without_the_launcher_a_started_process_does_nothing(run: RunDirectory, tmp_path: Path) -> None:
    """The launcher, which would open the gate, has been interrupted or killed."""
    log = tmp_path / "log"
    report, reported = os.pipe()
    gate, release = os.pipe()
    request = StartRequest(os.getpid(), reported, gate, (NodeCommand("waits", f"{PACKAGE}.nodes.waits", (), str(log)),))
    command = [sys.executable, "-m", STARTER, json.dumps(request.as_dict())]
    subprocess.run(command, pass_fds=(reported, gate), check=True, timeout=DEADLINE)
    pid, name = os.read(report, 1000).decode().split()
    assert name == "waits"
    ended = os.pidfd_open(int(pid))
    os.close(release)
    assert select.select([ended], [], [], DEADLINE)[0]
    assert log.read_text(encoding="utf-8") == ""
    for descriptor in (report, reported, gate, ended):
        os.close(descriptor)


@pytest.mark.extra
def test_what_is_loaded_before_the_fork_starts_no_thread() -> None:
    """Nor is it part of ROS, whose libraries start some."""
    program = f"""
import sys
from importlib import import_module
from pathlib import Path
for module in {COMMON_MODULES}:
    import_module(module)
assert "rclpy" not in sys.modules
print(len(list(Path("/proc/self/task").iterdir())))
"""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True)
    assert (done.stdout, done.stderr) == ("1\n", "")


def test_files_that_cannot_be_written_leave_no_process_and_a_named_fault(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "gone")
    processes: dict[str, NodeProcess] = {}
    with pytest.raises(NodesNotStarted, match=r"^nodes_not_started: .*gone/parameters: No such file or directory$"):
        start_processes([], run, DOMAIN, processes)
    assert not processes


def test_a_process_is_waited_for_where_no_more_files_can_be_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(pid: int) -> int:
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr(os, "pidfd_open", refuse)
    child = subprocess.Popen(["sleep", "0.1"])
    process = NodeProcess("sleeper", child.pid, tmp_path / "log")
    assert not process.wait(time.monotonic())
    assert process.wait(time.monotonic() + DEADLINE)
    assert process.status == 0
