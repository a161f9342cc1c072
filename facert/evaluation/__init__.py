"""How good methods are on a take: the paper's few-shot protocol, and what its figures show.

`protocol` draws the frames, `run` evaluates cells (a method on a draw) in `processes`, `table`
holds the means and the columns that show them, `paired` compares methods on the same draws,
`advice` puts it into words, `figures` draws it.
"""
