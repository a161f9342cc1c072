"""A procedural actor and a differently built character, with performances; nothing to download.

`build` holds the proportions of both heads, `parts`, `skin` and `head` model them, `expressions`
move them, `arkit` as phones name it, `acting` directs the actor, `character` is the other rig, and
`files` records it all.
"""

from facert.demo.files import (
    actor_rig,
    arkit_face,
    character_rig,
    performance_take,
    training_take,
    write_demo,
)

__all__ = [
    "actor_rig",
    "arkit_face",
    "character_rig",
    "performance_take",
    "training_take",
    "write_demo",
]
