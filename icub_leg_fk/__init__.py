"""Forward kinematics of the iCub's legs, and of any Denavit-Hartenberg table."""

__version__ = '0.1.0'
