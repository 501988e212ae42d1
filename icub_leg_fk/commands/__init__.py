"""The subcommands of `leg_fk`, one per module, named after it."""
