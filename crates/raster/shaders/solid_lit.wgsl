// Diffuse solid things in the light of the lamps; stands behind `solid.wgsl` and the shading text. Colour is albedo.

const SOLID_INV_PI: f32 = 0.31830988618;

@fragment
fn solid_fragment(v: SolidVertex) -> @location(0) vec4f {
    let to_eye = view_to_eye(v.position);
    // The plane of the triangle, turned to the viewer: both sides are alike.
    var geometric = cross(dpdx(v.position), dpdy(v.position));
    let area = dot(geometric, geometric);
    geometric = select(v.normal, geometric * inverseSqrt(area), area > 0.0);
    geometric = select(-geometric, geometric, dot(geometric, to_eye) >= 0.0);
    // A smooth normal on the same side. One that faces away from the viewer would lose the whole pixel.
    let length2 = dot(v.normal, v.normal);
    var normal = select(geometric, v.normal * inverseSqrt(length2), length2 > 0.0);
    normal = select(-normal, normal, dot(normal, geometric) >= 0.0);
    normal = select(geometric, normal, dot(normal, to_eye) > 0.0);

    // Nothing shadows ambient light on meshes. Without harmonics there is none.
    var arriving = lamp_ambient_irradiance(normal);
    let count = lamp_count();
    for (var i = 0u; i < count; i++) {
        let light = lamp_arriving(i, v.position);
        let cosine = dot(light.direction, normal);
        if cosine > 0.0 && dot(light.direction, geometric) > 0.0 {
            arriving += light.irradiance * (cosine * shadow_solid(i, v.position) * shadow_lit(i, v.position));
        }
    }
    return vec4f(min(v.color * arriving * SOLID_INV_PI, vec3f(65504.0)), 1.0);
}
