// What every pass knows: where it looks from, and which solid things are in the way. Twin of `view.rs`.

struct View {
    clip_from_world: mat4x4f,
    eye: vec3f,          // depth is measured from here, along `forward`
    perspective: u32,    // 1; 0: parallel
    forward: vec3f,      // unit
    near: f32,           // depths of the clipping planes
    across: vec3f,       // from a pixel to its right neighbour: at depth 1, or anywhere in a parallel view
    far: f32,
    down: vec3f,         // the same to the neighbour below
    pixel: f32,          // length of the two
    size: vec2f,         // pixels
    background: u32,     // not used by hair
    frame: u32,          // counts frames
}

@group(0) @binding(0) var<uniform> view: View;
// Depth buffer (0 near, 1 far) of what is solid; the same size as the target.
@group(0) @binding(1) var solid_depth: texture_depth_2d;

// Depth of a point: its distance along the view.
fn view_depth(p: vec3f) -> f32 {
    return dot(p - view.eye, view.forward);
}

// Size of a pixel at a depth, scene units.
fn view_pixel(depth: f32) -> f32 {
    return select(view.pixel, view.pixel * depth, view.perspective == 1u);
}

// Unit vector towards the viewer.
fn view_to_eye(p: vec3f) -> vec3f {
    if view.perspective == 1u {
        return normalize(view.eye - p);
    }
    return -view.forward;
}

// The point at a depth seen through `pixel` (centres are at halves).
fn view_position(pixel: vec2f, depth: f32) -> vec3f {
    let aside = view.across * (pixel.x - 0.5 * view.size.x) + view.down * (pixel.y - 0.5 * view.size.y);
    if view.perspective == 1u {
        return view.eye + depth * (view.forward + aside);
    }
    return view.eye + depth * view.forward + aside;
}

// Whether something solid lies in front of this fragment: passes that write storage have no other depth test.
fn view_hidden(clip: vec4f) -> bool {
    return clip.z > textureLoad(solid_depth, vec2i(clip.xy), 0);
}
