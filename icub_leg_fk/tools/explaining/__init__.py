"""The six steps of the Denavit-Hartenberg method, as text, LaTeX and JSON."""
