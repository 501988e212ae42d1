"""What the subcommands share: bags, recordings, drawing, the explanation, options and text."""
