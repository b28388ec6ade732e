# SPDX-License-Identifier: Apache-2.0
"""The environment of gymnasium: its interface, episodes that a seed repeats, and the benchmark's verdict on them."""

from __future__ import annotations

import sys
import warnings
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from law_policies import Unified, ctc

from fivebar_bringup.simulation.observation import Observation
from fivebar_bringup.simulation.stepped_run import observed
from fivebar_description.strict_yaml import InputError
from fivebar_studies.benchmark.crossings import ATTEMPTS, SEED, benchmark, drawn_crossing

NAME = "fivebar_gym:fivebar/Crossing-v0"
"""With the module that registers it, which `make` imports."""

OF_SPACES = ("Box action spaces", "observation space minimum", "observation space maximum")
"""Advice of the checker that is not taken: torques are in Nm, and nothing bounds where a joint turns to."""


def made(**options: Any) -> gymnasium.Env[Any, Any]:
    return gymnasium.make(NAME, **{"crossings": 8, **options})


def no_torque(observation: Any) -> tuple[float, float]:
    return 0.0, 0.0


def episode(env: gymnasium.Env[Any, Any], policy: Any, **begin: Any) -> tuple[float, int, bool, bool, dict[str, Any]]:
    """The sum of rewards, the steps, and the end of an episode."""
    observation, _ = env.reset(**begin)
    total, steps, terminated, truncated = 0.0, 0, False, False
    info: dict[str, Any] = {}
    while not (terminated or truncated):
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        total, steps = total + float(reward), steps + 1
    return total, steps, terminated, truncated, info


@pytest.mark.parametrize(
    "options",
    [{}, {"rig": "calibrated", "observation": "encoders"}, {"robot": "motkin", "rig": "encoders"}],
    ids=["ideal", "calibrated", "motkin"],
)
def test_the_checker_of_gymnasium_accepts_it(options: dict[str, Any]) -> None:
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        check_env(made(**options).unwrapped)
    assert not [one for one in found if not any(words in str(one.message) for words in OF_SPACES)]


def test_its_spaces_are_those_of_robot_and_observation() -> None:
    assert made().action_space == gymnasium.spaces.Box(-2.0, 2.0, (2,), np.float64)
    assert made(robot="motkin").action_space == gymnasium.spaces.Box(-0.186, 0.186, (2,), np.float64)
    for observation in Observation:
        space = made(observation=observation).observation_space
        assert space.shape == (len(observed(observation)),) and space.dtype == np.float64


def test_a_seed_repeats_an_episode_and_another_one_draws_another_crossing() -> None:
    env = made(rig="calibrated")
    torques = np.random.default_rng(1).uniform(-0.3, 0.3, (15, 2))

    def seen(seed: int) -> tuple[int, bytes]:
        observation, info = env.reset(seed=seed)
        rows = [observation, *(env.step(one)[0] for one in torques)]
        return info["crossing"], np.array(rows).tobytes()

    first = seen(3)
    assert seen(4) != first == seen(3)
    assert len({env.reset(seed=seed)[1]["crossing"] for seed in range(30)}) > 5


def test_crossings_are_drawn_as_those_of_the_benchmark_with_another_seed() -> None:
    """The set of the benchmark itself is not for training."""
    env = made()
    observation, info = env.reset(options={"crossing": 5})
    drawn = drawn_crossing(1, "dextar", 5)
    assert info["crossing"] == 5
    assert observation[14:16] == pytest.approx([drawn.end_x, drawn.end_y])
    assert observation[16] == pytest.approx(drawn.duration)
    assert not {one[3:7] for one in benchmark()} & {drawn_crossing(1, "dextar", number)[3:7] for number in range(8)}
    same, _ = made(crossings_seed=SEED).reset(options={"crossing": 0})
    first = drawn_crossing(SEED, "dextar", 0)
    assert same[14:16] == pytest.approx([first.end_x, first.end_y]) and ATTEMPTS > 100
    # robots of a rig are drawn by the same seed
    rigs = [made(rig="calibrated", crossings_seed=seed) for seed in (1, 2)]
    friction = [env.unwrapped._tasks.task(np.random.default_rng(0), 0).case.numbers.actual.leg1.coulomb for env in rigs]  # type: ignore[attr-defined]
    assert friction[0] != friction[1]


def test_an_episode_ends_with_the_verdict_of_the_benchmark() -> None:
    env, begin = made(), {"options": {"crossing": 4}}
    total, steps, terminated, truncated, info = episode(env, Unified(), **begin)
    assert (steps, terminated, truncated) == (round(500 * drawn_crossing(1, "dextar", 4).duration), False, True)
    assert (info["success"], info["fault"]) == (True, "") and 0.0 < info["error_peak"] < 2e-3
    # the reward of a step is 1 on the reference and 1/2 at the limit of the benchmark
    assert steps / (1.0 + info["error_peak"] / 2e-3) < total < steps
    _, before_the_end, terminated, truncated, info = episode(env, no_torque, **begin)
    assert (terminated, truncated, info["success"], info["fault"]) == (True, False, False, "tracking_lost")
    assert before_the_end < steps and info["error_peak"] > 50e-3
    # not far enough for the guard, and too far for the benchmark
    *_, terminated, truncated, info = episode(env, no_torque, options={"crossing": 2})
    assert (terminated, truncated, info["success"], info["fault"]) == (False, True, False, "")


def test_computed_torque_control_fails_where_it_asks_for_too_much() -> None:
    for number in (8, 10, 12, 15):
        *_, terminated, truncated, info = episode(made(crossings=16), ctc, options={"crossing": number})
        assert (terminated, truncated, info["success"], info["fault"]) == (True, False, False, "torque_excessive")


def test_the_reward_goes_with_the_distance_from_the_reference() -> None:
    env = made()
    env.reset(options={"crossing": 0})
    rewards = [float(env.step((0.0, 0.0))[1]) for _ in range(60)]
    assert rewards == sorted(rewards, reverse=True) and rewards[0] > 0.999 > 0.85 > rewards[-1]
    _, reward, terminated, _, _ = env.step((np.nan, 0.0))
    assert (reward, terminated) == (0.0, True)


@pytest.mark.parametrize("rig", ["ideal", "calibrated"])
def test_environments_side_by_side_are_the_same_as_each_alone(rig: str) -> None:
    """Up to the ends of episodes; the next one begins in the step after."""
    numbers, random = [0, 3, 6], np.random.default_rng(2)
    envs = gymnasium.make_vec(
        NAME, num_envs=3, vectorization_mode="vector_entry_point", rig=rig, observation="encoders", crossings=8
    )
    alone = [made(rig=rig, observation="encoders") for _ in numbers]
    rows, _ = envs.reset(seed=1, options={"crossing": numbers})
    assert rows in envs.observation_space
    assert rows.tolist() == [
        env.reset(options={"crossing": one})[0].tolist() for env, one in zip(alone, numbers, strict=True)
    ]
    ended = [False] * 3
    for _ in range(2000):
        torques = random.uniform(-1.0, 1.0, (3, 2))
        rows, rewards, terminated, truncated, info = envs.step(torques)
        for place, env in enumerate(alone):
            if ended[place]:
                continue
            single = env.step(torques[place])
            of_all = [row[place] for row in (rows, rewards, terminated, truncated)]
            assert [np.asarray(one).tolist() for one in single[:4]] == [np.asarray(one).tolist() for one in of_all]
            ended[place] = bool(single[2] or single[3])
            if ended[place]:
                assert {name: info[name][place] for name in single[4]} == single[4]
        if all(ended):
            break
    assert all(ended)


def test_an_episode_begins_in_the_step_after_the_end_of_the_one_before() -> None:
    envs = gymnasium.make_vec(NAME, num_envs=2, crossings=8)
    assert envs.metadata["autoreset_mode"] == gymnasium.vector.AutoresetMode.NEXT_STEP
    envs.reset(seed=5, options={"crossing": 4})
    torques = np.array([[np.nan, 0.0], [0.0, 0.0]])
    _, rewards, terminated, _, info = envs.step(torques)
    assert terminated.tolist() == [True, False] and rewards[0] == 0.0 < rewards[1]
    assert info["fault"].tolist() == ["torque_undefined", None]
    rows, rewards, terminated, _, info = envs.step(torques)
    assert not terminated.any() and rewards[0] == 0.0
    begun = drawn_crossing(1, "dextar", int(info["crossing"][0]))
    assert rows[0, 16] == pytest.approx(begun.duration) and rows[0, 8:10] == pytest.approx(
        [begun.start_x, begun.start_y]
    )
    assert info["crossing"][1] == 4 and rows[1, 16] == pytest.approx(drawn_crossing(1, "dextar", 4).duration - 2 / 500)


def test_a_seed_repeats_all_episodes_of_a_vector() -> None:
    envs = gymnasium.make_vec(NAME, num_envs=4, crossings=8)
    crossings = []
    for seed in (7, 7, 8):
        drawn = [envs.reset(seed=seed)[1]["crossing"].tolist()]
        drawn += [envs.step(np.full((4, 2), np.nan))[4]["crossing"].tolist() for _ in range(4)]
        crossings.append(drawn)
    assert crossings[0] == crossings[1] != crossings[2]
    assert crossings[0][0] != crossings[0][2]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"robot": "dexter"}, "robot 'dexter': "),
        ({"rig": "calibratd"}, "rig: 'calibratd': "),
        (
            {"rig": "good", "robot": "motkin"},
            "rig: 'good': has the robot dextar: expected ideal or encoders with robot",
        ),
        ({"observation": "camera"}, "observation: 'camera': expected one of all, encoders"),
        ({"crossings": 0}, "crossings: 0: expected at least 1"),
    ],
)
def test_an_environment_that_cannot_be_is_refused_in_a_line(options: dict[str, Any], words: str) -> None:
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(InputError) as error:
            make(NAME, **options)
        assert str(error.value).startswith(words)


def test_actions_and_crossings_that_cannot_be_are_refused() -> None:
    env, envs = made().unwrapped, gymnasium.make_vec(NAME, num_envs=2, crossings=8)
    for one, action in ((env, (0.0, 0.0)), (envs, np.zeros((2, 2)))):
        with pytest.raises(gymnasium.error.ResetNeeded, match="expected reset before"):
            one.step(action)
        with pytest.raises(InputError, match="crossing: 8: expected 0 to 7"):
            one.reset(options={"crossing": 8})
        one.reset()
    with pytest.raises(ValueError, match=r"action of shape \(3,\): expected \(2,\)"):
        env.step((0.0, 0.0, 0.0))
    with pytest.raises(ValueError, match=r"actions of shape \(2,\): expected \(2, 2\)"):
        envs.step(np.zeros(2))


def test_without_gymnasium_its_import_says_what_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "fivebar_gym", raising=False)
    monkeypatch.setitem(sys.modules, "gymnasium", None)
    with pytest.raises(InputError, match="gymnasium is not installed: "):
        import_module("fivebar_gym")
