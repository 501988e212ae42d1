"""Pictures of feet over time and of legs in space."""
