// Models from textures: coordinates, and what becomes of the texels. Twin of `table.rs` and of the files in `table/`.
//
// A shader asks for coordinates, samples its textures there (linear filter, clamped to the edge, level 0) and hands
// the texels over:
//
//     at = deon_table_coords(m, size, known, s)
//     lobes = deon_from_tables(m, known, s, r_tt(at), trt(at), residual(vec2f(0.5, at.y)))
//
// `size` is the number of texels a side of the texture that the coordinates are for.

// What the axes of Marschner's textures are.
const TABLE_WARPED: u32 = 0u;
const TABLE_PRINTED: u32 = 1u;

// Texture coordinate of `x` in [0, 1]: 0 and 1 are the centres of the first and the last texel.
fn table_coordinate(x: f32, size: f32) -> f32 {
    return (0.5 + x * (size - 1.0)) / size;
}

// --- Marschner

// In the texture along the fiber.
fn marschner_table_coords(axes: u32, size: f32, known: Dir, s: Dir) -> vec2f {
    if axes == TABLE_PRINTED {
        return vec2f(0.5 + 0.5 * known.sin_theta, 0.5 + 0.5 * s.sin_theta);
    }
    return vec2f(
        table_coordinate(0.5 + dir_theta(known) / PI, size),
        table_coordinate(0.5 + dir_theta(s) / PI, size),
    );
}

// In the two textures around it; `m` is the texel of the first one.
fn marschner_section_coords(axes: u32, size: f32, known: Dir, s: Dir, m: vec4f) -> vec2f {
    let phi = azimuth(known, s);
    if axes == TABLE_PRINTED {
        return vec2f(0.5 + 0.5 * cos(phi), 0.5 + 0.5 * m.w);
    }
    let cos2_d = cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta);
    return vec2f(table_coordinate(sqrt(abs(phi) / PI), size), table_coordinate(sqrt(cos2_d), size));
}

// `m`, `r_tt` and `trt` are the texels, `diffuse` the albedo of the diffuse part.
fn marschner_from_tables(axes: u32, diffuse: vec3f, known: Dir, s: Dir, m: vec4f, r_tt: vec4f, trt: vec4f) -> Lobes {
    var scale = s.cos_theta;
    if axes != TABLE_PRINTED {
        let cos2_d = cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta);
        scale = scale / max(cos2_d, 1e-5);
    }
    return Lobes(
        vec3f(r_tt.x * (m.x * scale)),
        r_tt.yzw * (m.y * scale),
        trt.xyz * (m.z * scale),
        diffuse * lambertian_density(known, s),
    );
}

// --- d'Eon, far field

// In all three textures; the one of the residual lobe has one column.
fn deon_table_coords(m: Deon, size: f32, known: Dir, s: Dir) -> vec2f {
    var cos_theta = known.cos_theta;
    if m.attenuation != DEON_KNOWN {
        cos_theta = sqrt(cos2_half_difference(known.sin_theta, known.cos_theta, s.sin_theta, s.cos_theta));
    }
    return section_table_coords(size, azimuth(known, s), cos_theta);
}

fn deon_from_tables(m: Deon, known: Dir, s: Dir, r_tt: vec4f, trt: vec4f, residual: vec4f) -> Lobes {
    return section_from_tables(deon_longitudinal(m, known, s), r_tt, trt, residual);
}

// --- Chiang, far field

fn chiang_table_coords(size: f32, known: Dir, s: Dir) -> vec2f {
    return section_table_coords(size, azimuth(known, s), known.cos_theta);
}

fn chiang_from_tables(m: Chiang, known: Dir, s: Dir, r_tt: vec4f, trt: vec4f, residual: vec4f) -> Lobes {
    let v = chiang_variances(m.beta_m);
    let shift = m.alpha * vec4f(2.0, -1.0, -4.0, 0.0);
    var l = vec4f(0.0);
    for (var p = 0; p < 4; p++) {
        let cone = cone_specular(known.sin_theta, known.cos_theta, shift[p]);
        l[p] = longitudinal_density(v[p], cone, s.sin_theta, s.cos_theta);
    }
    return section_from_tables(l, r_tt, trt, residual);
}

// --- What the last two share

fn section_table_coords(size: f32, phi: f32, cos_theta: f32) -> vec2f {
    return vec2f(table_coordinate(abs(phi) / PI, size), table_coordinate(cos_theta, size));
}

// `l` are the longitudinal densities.
fn section_from_tables(l: vec4f, r_tt: vec4f, trt: vec4f, residual: vec4f) -> Lobes {
    return Lobes(vec3f(r_tt.x * l.x), r_tt.yzw * l.y, trt.xyz * l.z, residual.xyz * l.w);
}
