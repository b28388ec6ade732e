# SPDX-License-Identifier: Apache-2.0
"""The tests of a module are found by its name, or in the table here."""

from __future__ import annotations

from pathlib import Path

TESTS = Path(__file__).parents[1]
SRC = TESTS.parent / "src"
SCRIPTS = {"studies": TESTS.parent / "docs" / "studies", "bench": TESTS.parent / "bench"}
"""Folders of scripts, by the name that stands before those of their modules here."""

OPTIONAL = (
    *("fivebar_gym", "fivebar_live", "fivebar_play", "fivebar_commission", "fivebar_studies", "fivebar_mujoco"),
    *("fivebar_camera", "fivebar_camera_runs", "fivebar_optics", "fivebar_vision"),
    *("fivebar_moteus", "fivebar_odrive", "fivebar_motkin", "fivebar_motkin_emulation"),
)

ELSEWHERE = {
    "unit/test_architecture.py": ("fivebar_description.optional",),
    "unit/test_parsers_refuse.py": ("fivebar_description.strict_yaml", "fivebar_description.outside_text"),
    "unit/test_run_table_doc.py": ("fivebar_description.run_quantities",),
    "unit/test_robot_doc.py": ("fivebar_control.hardware.drive_faults",),
    "unit/test_mpc_doc.py": ("studies.mpc_study",),
    "unit/test_unified_doc.py": ("studies.unified_sweep",),
    "unit/description/test_messages.py": ("fivebar_description.joint_sample",),
    "unit/description/test_robot_description.py": ("fivebar_description.mass_split",),
    "unit/description/test_robot_file.py": ("fivebar_description.physical_bounds",),
    "ros/test_one_publisher.py": ("fivebar_description.ros.endpoints", "fivebar_description.ros.publisher_watch"),
    "unit/sim/test_effects.py": ("fivebar_description.transmission",),
    "unit/sim/test_payload_of_plants.py": ("fivebar_sim.moved_robot",),
    "system/test_practised_robot.py": ("fivebar_commission.clocked",),
    "system/test_own_drives.py": ("fivebar_control.nodes.drive_bridge",),
    "unit/description/test_watches.py": (
        "fivebar_description.ros.latency_watch",
        "fivebar_description.ros.rate_watch",
    ),
    "unit/sim/test_sensors.py": ("fivebar_sim.scalar_sensors",),
    "unit/control/estimation/test_ekf_ambiguity.py": ("fivebar_control.estimation.mirror",),
    "unit/control/estimation/test_gyro_watch.py": ("fivebar_control.estimation.fault_numbers",),
    "unit/control/estimation/test_step.py": ("fivebar_control.estimation.causes",),
    "unit/control/estimation/test_measurement_rows.py": (
        "fivebar_description.tolerances",
        "fivebar_control.estimation.passive_encoder",
    ),
    "unit/control/hardware/test_configuration.py": ("fivebar_control.hardware.drive_setup",),
    "unit/control/hardware/test_moteus.py": (
        "fivebar_control.hardware.can_pair",
        "fivebar_moteus_emulation.moteus_bus",
        "fivebar_moteus_emulation.moteus_subframes",
        "fivebar_vendor_drives.pair_files",
    ),
    "unit/control/hardware/test_odrive.py": ("fivebar_odrive_emulation.odrive_bus",),
    "unit/control/hardware/test_two_motors.py": (
        "fivebar_control.hardware.connection",
        "fivebar_control.hardware.drive_connection",
        "fivebar_control.hardware.motors_file",
        "fivebar_control.hardware.paced_file",
        "fivebar_description.motors_file",
    ),
    "unit/control/hardware/test_waiting_session.py": ("fivebar_control.hardware.drive_session",),
    "unit/control/model/test_external_force.py": ("fivebar_description.loads",),
    "unit/control/laws/test_robot_sizes.py": (
        "fivebar_description.known_drives",
        "fivebar_description.tuning",
    ),
    "unit/control/planning/test_passage.py": ("studies.passage_study",),
    "unit/control/test_known_cogging.py": ("fivebar_control.estimation.platform_motion",),
    "unit/control/vision/test_camera_calibration.py": (
        "fivebar_vision.camera_file",
        "fivebar_vision.native_output",
    ),
    "unit/control/vision/test_comparison.py": ("fivebar_control.estimation.platform_reading",),
    "unit/control/vision/test_localisation.py": (
        "fivebar_vision.detector",
        "fivebar_vision.picture_reading",
        "fivebar_optics.camera_model",
    ),
    "unit/bringup/pages/test_page_units.py": ("fivebar_description.rounding",),
    "unit/bringup/motions/test_model_file.py": ("fivebar_description.sdf",),
    "unit/bringup/test_bag.py": ("fivebar_description.topic_contents",),
    "launch/test_launch_files.py": (
        "fivebar_bringup.ros.installed_packages",
        "fivebar_bringup.ros.launch_arguments",
        "fivebar_bringup.ros.launch_scope",
        "fivebar_bringup.ros.launched_nodes",
        "fivebar_bringup.ros.launched_run",
    ),
    "system/test_camera_by_the_clock.py": ("fivebar_vision.node_settings", "fivebar_vision.nodes.vision_listener"),
    "system/test_odd_machines.py": ("fivebar_camera_runs.cli",),
    "system/test_law_from_elsewhere.py": ("fivebar_control.nodes.law_controller",),
    "unit/sim/test_motkin_emulation.py": ("fivebar_sim.emulated_hardware", "fivebar_sim.emulators.serving"),
    "unit/sim/test_motor_board.py": (
        "fivebar_control.hardware.drive_interface",
        "fivebar_motkin_description.board_motor",
    ),
    "unit/bringup/report/test_analysis.py": (
        "fivebar_bringup.recorded.outcome",
        "fivebar_bringup.recorded.summary",
    ),
    "unit/bringup/report/test_replay.py": ("fivebar_bringup.recorded.series",),
    "unit/bringup/report/test_report.py": ("fivebar_camera_runs.series",),
    "unit/bringup/studies/test_compare.py": (
        "studies.corner_study",
        "studies.lqr_study",
        "studies.optimal_study",
    ),
    "unit/bringup/runs/test_inner_loop_files.py": ("fivebar_vendor_drives.board_files",),
    "unit/bringup/runs/test_injection.py": ("fivebar_sim.emulators.hardware_kinds",),
    "unit/bringup/runs/test_rehearsal_effects.py": ("fivebar_sim.emulation_file",),
    "unit/bringup/simulation/test_compiling.py": ("fivebar_control.compiled_parts",),
    "unit/bringup/simulation/test_engine.py": (
        "fivebar_bringup.simulation.case",
        "fivebar_bringup.simulation.engine_sensors",
        "fivebar_bringup.simulation.engine_estimator",
        "fivebar_bringup.simulation.engine_robot",
        "fivebar_bringup.simulation.column_metrics",
        "fivebar_bringup.simulation.engine_table",
        "fivebar_bringup.simulation.table_rows",
    ),
    "unit/bringup/simulation/test_stepped_run.py": ("fivebar_bringup.simulation.observation",),
    "unit/bringup/simulation/test_engine_with_camera.py": ("fivebar_camera_runs.simulation",),
    "unit/bringup/commission/test_practice.py": (
        "fivebar_commission.cli",
        "fivebar_bringup.simulation.mechanism_code",
    ),
    "unit/bringup/commission/test_steps.py": (
        "fivebar_commission.drives_file",
        "fivebar_commission.limits",
        "fivebar_commission.record",
    ),
    "unit/bringup/odds/test_odds.py": ("fivebar_bringup.recorded.run_odds",),
    "unit/studies/test_calibrated_crossings.py": ("fivebar_bringup.simulation.guided",),
    "unit/bringup/studies/test_reproduce.py": (
        "fivebar_camera_runs.accuracy",
        "fivebar_bringup.simulation.run_in_memory",
    ),
    "unit/bringup/test_entry.py": ("fivebar_bringup.cli.main", "fivebar_bringup.cli.words"),
    "unit/bringup/test_scenario_settings.py": ("fivebar_description.shared_settings",),
    "ros/test_dextar_bridge.py": ("fivebar_control.ros.drive_bridge",),
    "ros/test_controlled_joints.py": (
        "fivebar_control.nodes.command_watchdog",
        "fivebar_control.ros.controller_watch",
        "fivebar_control.ros.joints_port",
    ),
    "ros/test_goals.py": (
        "fivebar_bringup.nodes.goal_client",
        "fivebar_control.ros.goal_server",
        "fivebar_control.ros.placed_frames",
        "fivebar_control.ros.shown_motions",
        "fivebar_control.ros.trajectory_requests",
        "fivebar_control.ros.transform_lookup",
    ),
    "ros/test_state_estimator.py": ("fivebar_control.ros.machine_code",),
    "ros/test_motkin_bridge.py": ("fivebar_control.ros.inner_loop_targets",),
    "ros/test_answers.py": (
        "fivebar_control.nodes.supervisor",
        "fivebar_control.nodes.ctc_controller",
        "fivebar_control.nodes.imu_listener",
        "fivebar_control.nodes.unified_controller",
        "fivebar_control.nodes.vhc_controller",
        "fivebar_control.ros.controller_node",
        "fivebar_description.ros.sampling_node",
    ),
    "ros/test_node_parameters.py": (
        "fivebar_control.ros.node_settings",
        "fivebar_control.ros.run_file",
        "fivebar_description.ros.base_node",
        "fivebar_description.ros.file_parameters",
    ),
    "ros/test_plant_node.py": ("fivebar_sim.ros.node_settings", "fivebar_sim.ros.run_progress"),
    "ros/test_run_plan.py": ("fivebar_control.nodes.trajectory_generator", "fivebar_description.ros.run_agreement"),
    "ros/test_signals.py": ("fivebar_description.ros.exit_timer",),
    "ros/test_viewer.py": (
        "fivebar_bringup.cli.viewing",
        "fivebar_live.ros.graph_states",
        "fivebar_live.ros.parameter_query",
        "fivebar_live.ros.sample_feed",
        "fivebar_live.ros.triggers",
    ),
    "ros/test_diagnostics.py": ("fivebar_bringup.ros.diagnostics_listener",),
    "unit/studies/test_result_pages.py": ("studies.make_result_pages",),
    "ros/test_foreign_statuses.py": (
        "fivebar_bringup.nodes.run_monitor",
        "fivebar_description.process_names",
        "fivebar_description.status_texts",
    ),
    "system/test_command.py": (
        "fivebar_bringup.cli.guide",
        "fivebar_bringup.cli.running",
    ),
    "unit/bringup/studies/test_sweep.py": ("fivebar_studies.cli.study_options",),
    "unit/bringup/studies/test_maps.py": ("fivebar_control.workspace.fields", "fivebar_control.workspace.loci"),
}
"""Where modules are tested that a test of another name covers."""


def modules() -> set[str]:
    """Every module of packages and scripts by its full name, but those that only name a package or run one."""
    found = {
        ".".join(path.relative_to(SRC).with_suffix("").parts[1:])
        for package in SRC.glob("*/*/__init__.py")
        for path in package.parent.rglob("*.py")
        if package.parent.name != "fivebar"
    }
    scripts = {f"{name}.{path.stem}" for name, folder in SCRIPTS.items() for path in folder.glob("*.py")}
    assert len(scripts) > 30
    return {name for name in found | scripts if not name.endswith(("__init__", "__main__"))}


def is_found(module: str, names: set[str]) -> bool:
    """Whether the name of a test begins or ends with that of the module or of its folder, be it singular or plural."""
    *_, folder, own = module.split(".")
    if folder in OPTIONAL:
        folder = folder.removeprefix("fivebar_")
    told = {own} if folder in ("ros", "nodes", "studies") else {own, folder}
    words = {one for name in told for one in (name, f"{name}s", name.removesuffix("s"))}
    starts, ends = tuple(f"{word}_" for word in words), tuple(f"_{word}" for word in words)
    return any(name in words or name.startswith(starts) or name.endswith(ends) for name in names)


def test_every_module_has_a_test_that_is_found_by_its_name() -> None:
    names = {path.stem.removeprefix("test_") for path in TESTS.rglob("test_*.py")}
    listed = {module for tested in ELSEWHERE.values() for module in tested}
    unfound = {module for module in modules() if not is_found(module, names)}
    assert not unfound - listed, "expected a test named after the module or its folder, or a line in ELSEWHERE"
    assert not listed - unfound, "expected no line in ELSEWHERE: the module is gone, or a test has its name"
    assert not {path for path in ELSEWHERE if not (TESTS / path).is_file()}
