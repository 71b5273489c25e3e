// What both kinds of opacity maps share when hair is drawn into them: blending adds the fibers that each texel is
// covered by. Twin of `Fill` in `shadow.rs`.

struct ShadowFill {
    ends: vec4f,       // where layers end behind the nearest fiber, scene units; beyond all hair for the last
    hair: vec2f,       // least and greatest depth of the hair's box
    first: u32,        // of the slices of this pass
}

@group(3) @binding(0) var<uniform> shadow_fill: ShadowFill;
@group(3) @binding(1) var shadow_nearest: texture_depth_2d;

// Depth of a value (0 near, 1 far) of the depth buffer.
fn shadow_fill_depth(value: f32) -> f32 {
    if view.perspective == 1u {
        return view.near * view.far / (view.far - value * (view.far - view.near));
    }
    return view.near + value * (view.far - view.near);
}

// A fragment in the layers: its own and all behind it.
fn shadow_fill_layers(f: Fragment, pixel: vec2i) -> vec4f {
    let behind = f.depth - shadow_fill_depth(textureLoad(shadow_nearest, pixel, 0));
    return select(vec4f(0.0), vec4f(f.alpha), vec4f(behind) <= shadow_fill.ends);
}

// A fragment in four slices, the group `group` of this pass: its own slice and all behind it.
fn shadow_fill_slices(f: Fragment, group: u32) -> vec4f {
    let hair = shadow_fill.hair;
    // What rounding pushes out of the box stays in the last slice.
    let s = clamp((f.depth - hair.x) / (hair.y - hair.x), 0.0, 1.0) * 16.0;
    let far_sides = vec4f(1.0, 2.0, 3.0, 4.0) + f32(shadow_fill.first + 4u * group);
    return select(vec4f(0.0), vec4f(f.alpha), vec4f(s) <= far_sides);
}
