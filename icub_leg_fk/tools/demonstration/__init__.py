"""The parts of the live demonstration: node, replay and table."""
