// No shadow at all.

fn shadow_solid(i: u32, p: vec3f) -> f32 {
    return 1.0;
}

fn shadow_lit(i: u32, p: vec3f) -> f32 {
    return 1.0;
}

fn shadow_fibers(i: u32, p: vec3f) -> f32 {
    return 0.0;
}
