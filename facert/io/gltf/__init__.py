"""glTF 2.0 files: rigs, meshes and takes out of them, animated meshes into them."""
