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

// What an opaque fragment lets through, so that its optical depth is a number.
const FRAGMENT_LEAST_THROUGH: f32 = 1e-4;

// -ln(1 - alpha): these add where opacities multiply.
fn fragment_optical_depth(alpha: f32) -> f32 {
    // Near 1 a logarithm may be off by half a millionth, which is as much as a faint fragment has. The series is short
    // of 2e-6 of the sum at most.
    if alpha < 0.02 {
        return alpha * (1.0 + alpha * (0.5 + alpha / 3.0));
    }
    return -log(max(1.0 - alpha, FRAGMENT_LEAST_THROUGH));
}
