"""Pages in the browser: to look at a performance, and to pose.

What is shown and what a click means is in plain classes (`worker`, `view_data`, `pose_editor`,
`session`) that know of no browser. `view_page` and `pose_page` lay them out with viser.
"""
