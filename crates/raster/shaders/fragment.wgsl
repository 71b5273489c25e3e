// A piece of hair as one pixel sees it. Geometry makes it, shading reads it.

struct Fragment {
    position: vec3f,  // scene units
    depth: f32,       // along the view, scene units
    tangent: vec3f,   // unit, from root to tip
    alpha: f32,       // share of the pixel that it covers, times opacity
    h: f32,           // offset from the axis across the view, [-1, 1]
    width_px: f32,    // diameter on screen, pixels
    u: f32,           // 0 at the root, 1 at the tip
    entry: u32,       // which fiber of the palette
    strand: u32,      // which strand
}
