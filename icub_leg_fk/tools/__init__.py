"""The `leg_fk` command: one module per subcommand, and what they share."""
