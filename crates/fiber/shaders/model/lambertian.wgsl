// Lambertian fiber: an opaque cylinder whose surface is perfectly diffuse. Twin of `model/lambertian.rs`.

struct Lambertian {
    albedo: vec3f,
}

fn lambertian_eval(m: Lambertian, known: Dir, h: f32, s: Dir) -> Lobes {
    var lobes = lobes_zero();
    lobes.residual = m.albedo * lambertian_density(known, s);
    return lobes;
}

// Density of the scattered direction, per steradian: the value for an albedo of 1.
fn lambertian_density(known: Dir, s: Dir) -> f32 {
    let x = abs(azimuth(known, s));
    return max((PI - x) * cos(x) + sin(x), 0.0) * s.cos_theta / (4.0 * PI);
}
