"""How good methods are on a take: the paper's few-shot protocol, and what its figures show.

`protocol` draws the frames, `run` evaluates cells (a method on a draw) in processes, `summary`
makes a table of means, `comparison` sets methods against each other on the same draws, `advice`
puts it into words, `figures` draws it.
"""
