# SPDX-License-Identifier: Apache-2.0
"""Random crossings as an environment of gymnasium, `fivebar/Crossing-v0`, on the compiled engine.

For whoever trains or tests policies. Importing the package registers the environment, which
`gymnasium.make("fivebar_gym:fivebar/Crossing-v0")` does by itself. It stands on `fivebar_studies`, whose benchmark
draws and judges the crossings; nothing imports it. `gymnasium` comes with the extra `gym`.
"""

from fivebar_bringup.extras import library

library("gymnasium", "gym").register(
    id="fivebar/Crossing-v0",
    entry_point="fivebar_gym.crossing_env:CrossingEnv",
    vector_entry_point="fivebar_gym.vector_env:CrossingVectorEnv",
)
