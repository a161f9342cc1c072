"""One self-contained page of results: tables, figures and faces, to keep and to send.

`sections` holds what a report is made of, `evaluation` and `performance` make it from what `eval`
and `retarget` wrote, `pictures` draws, and `page` writes HTML.
"""
