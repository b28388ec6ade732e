# SPDX-License-Identifier: Apache-2.0
"""The `fivebar` command: `app` is what all subcommands share, every other module adds some of them."""

import os

# Read when numpy is loaded, so set before the subcommands are. The matrices are small: threads of the linear algebra
# compete with the processes that do the work, and cost more time than they save.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Read when matplotlib is loaded. Figures are drawn into files: what a notebook or a desktop sets for itself may not be
# installed here.
os.environ["MPLBACKEND"] = "Agg"
