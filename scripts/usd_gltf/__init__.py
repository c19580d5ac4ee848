"""USD to glTF for Candelabra, lights included.

A tour, in the order of the work:

`cli`               arguments and exit codes
`source_hash`       what was read, and is the output already up to date?
`stage`             opens the stage: payloads, variants, frames
`composition`       what USD's composition complained of
`export`            the whole job, from an opened stage to files
`prim_tree`         compiles USD prims into a plain tree (`Prim`), once for each prototype
`node_writer`       stamps that tree into glTF nodes, once for each instance
`light_attributes`  where a light's input is authored: new names, old ones, Arnold's
`light_inputs`      UsdLux's formulas: nits, lux, candela
`light_visibility`, `light_losses`, `vendors`   which rays see a light; what is lost of it
`light_networks`, `light_filters`   colours that shader networks compute; filters that multiply
`arnold_placement`, `arnold_lens`   where Arnold's own parameters put lights and cameras, and how these see
`vanishing`         visibility over time
`light_shapes`      tessellation and world-space areas of the intrinsic lights
`light_carriers`    which glTF object carries which light
`light_growth`      the radiance of normalized lights while they grow
`linking`           which lights light what, and what casts their shadows
`light_shaping`, `light_profiles`   how lights are shaped, over time too; the files of their IES profiles
`light_textures`    the pictures of rect lights and domes
`pictures`, `baking`, `asset_files`     picture files into arrays, light of any range into a PNG
`mesh`, `polygons`, `normals`, `triangulate`, `primvars`, `gprims`     geometry
`curves`, `tubes`   where BasisCurves run, and surfaces around them
`skinning`          poses of skeletons and blend shapes
`deformation`       morph targets of what changes its shape
`velocities`        points and instances that move by their velocities
`subdivision`, `subdivision_topology`, `subdivision_masks`, `subdivision_normals`, `subdivision_seams`   smooth surfaces
`materials`, `surfaces`, `look_builder`, `textures`     looks: which surface is read, and how glTF says it
`preview_surface`   UsdPreviewSurface
`network_surfaces`, `surface_models`    surfaces of MaterialX and Arnold
`shader_network`, `evaluator`, `quantities`, `network_images`   networks of shaders, and what they compute
`shader_nodes`, `arnold_nodes`, `color_spaces`  nodes
`materialx_layers`, `materialx_library`     `.mtlx` files, and MaterialX's own nodes
`instancers`, `cameras`, `shutters`, `fog`, `transforms`, `animation`
`gltf_document`     buffers, accessors, JSON, files
`report`            what had no carrier, by category
`progress`, `events`    how far it is, for people and for `candelabra`

Matrices here multiply column vectors (the transpose of Gf's). Stage units and axes are kept in all
nodes; one root node turns them into metres and +Y up.
"""

EXPORTER = "candelabra usd_to_gltf 1.2"
