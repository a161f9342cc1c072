"""The data that facert works on: takes, rigs, their names, units and time; plain checked arrays."""
