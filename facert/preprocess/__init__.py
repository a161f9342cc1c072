"""From a recording to arrays: faults, head motion, noise, the actor at rest, training data."""
