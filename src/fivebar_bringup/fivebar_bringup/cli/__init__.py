"""The `fivebar` command: `app` is what all subcommands share, every other module adds some of them."""
