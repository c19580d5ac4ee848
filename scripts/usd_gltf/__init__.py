"""USD to glTF for Candelabra, lights included.

A tour, in the order of the work:

`cli`               arguments and exit codes
`source_hash`       is the output already up to date?
`stage`             opens the stage: payloads, variants, frames
`export`            the whole job, from an opened stage to files
`prim_tree`         compiles USD prims into a plain tree (`Prim`), once for each prototype
`node_writer`       stamps that tree into glTF nodes, once for each instance
`light_inputs`      UsdLux's formulas: nits, lux, candela
`light_shapes`      tessellation and world-space areas of the intrinsic lights
`light_carriers`    which glTF object carries which light
`mesh`, `triangulate`, `primvars`, `gprims`     geometry
`materials`, `preview_surface`, `textures`      looks
`instancers`, `cameras`, `transforms`, `animation`
`gltf_document`     buffers, accessors, JSON, files
`report`            what had no carrier

Matrices here multiply column vectors (the transpose of Gf's). Stage units and axes are kept in all
nodes; one root node turns them into metres and +Y up.
"""

EXPORTER = "candelabra usd_to_gltf 1.0"
