"""Evaluation of methods on a take by the paper's few-shot protocol, and advice from it.

`protocol` draws the frames, `run` evaluates cells (a method on a draw) in `processes`, `table`
holds the means and the columns that show them, `paired` compares methods on the same draws,
`advice` puts it into words, `figures` draws it.
"""
