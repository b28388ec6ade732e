"""The `fivebar` command: `app` is what all subcommands share, every other module adds some of them."""

import os

# Read when numpy is loaded, so set before the subcommands are. The matrices are small: threads of the linear algebra
# compete with the processes that do the work, and cost more time than they save.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
