"""Measurements of icub_leg_fk beside its references; `python -m bench` runs all of them."""
