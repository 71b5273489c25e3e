//! What to render: camera, lights, meshes, grooms, looks, and the scene file
