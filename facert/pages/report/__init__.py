"""One self-contained page of results: tables, figures and faces, to keep and to send.

`sections` holds what a report is made of; `evaluation_section`, `performance_section` and
`comparison_section` make it from results, `folder` from all that lies in a folder; `embedding`
turns figures into text, and `page` writes HTML.
"""
