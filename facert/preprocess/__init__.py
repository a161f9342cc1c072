"""From a recording to arrays to learn from: faults, head motion, gaps, noise, the actor at rest."""
