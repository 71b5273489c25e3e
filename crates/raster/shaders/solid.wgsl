// Triangles of solid things, and of lights that the camera sees.

struct SolidVertex {
    @builtin(position) @invariant clip: vec4f,
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) color: vec3f,
}

@vertex
fn solid_vertex(
    @location(0) position: vec3f,
    @location(1) normal: vec3f,
    @location(2) color: vec3f,
) -> SolidVertex {
    return SolidVertex(view.clip_from_world * vec4f(position, 1.0), position, normal, color);
}

// A light: its colour is radiance. It shines from its front alone; what shines to both sides has triangles for both.
@fragment
fn solid_glow(v: SolidVertex, @builtin(front_facing) front: bool) -> @location(0) vec4f {
    if !front {
        discard;
    }
    // The largest half-precision number: infinity would spoil what is averaged with it.
    return vec4f(min(v.color, vec3f(65504.0)), 0.0);
}
