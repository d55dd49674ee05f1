"""The subcommands of `twin`, one a file."""
