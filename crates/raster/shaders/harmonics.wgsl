// Ambient light as spherical harmonics of degree 0 to 2: twin of `lights/harmonics.rs`.
//
// Nine coefficients of radiance in `rgb`, `a` unused, in the order 1; y, z, x; xy, yz, 3z² - 1, xz, x² - y².
// `d` has unit length.

const HARMONICS_Y0: f32 = 0.282094792;
const HARMONICS_Y1: f32 = 0.48860251;
const HARMONICS_Y2: f32 = 1.09254843;
const HARMONICS_Y20: f32 = 0.31539157;
const HARMONICS_Y22: f32 = 0.54627422;

// What a cosine makes of each degree: π, 2π/3, π/4.
const HARMONICS_COSINE0: f32 = 3.14159265;
const HARMONICS_COSINE1: f32 = 2.09439510;
const HARMONICS_COSINE2: f32 = 0.78539816;

fn harmonics_degree0(c: array<vec4f, 9>) -> vec3f {
    return c[0].rgb * HARMONICS_Y0;
}

fn harmonics_degree1(c: array<vec4f, 9>, d: vec3f) -> vec3f {
    return (c[1].rgb * d.y + c[2].rgb * d.z + c[3].rgb * d.x) * HARMONICS_Y1;
}

fn harmonics_degree2(c: array<vec4f, 9>, d: vec3f) -> vec3f {
    return (c[4].rgb * (d.x * d.y) + c[5].rgb * (d.y * d.z) + c[7].rgb * (d.x * d.z)) * HARMONICS_Y2
        + c[6].rgb * ((3.0 * d.z * d.z - 1.0) * HARMONICS_Y20)
        + c[8].rgb * ((d.x * d.x - d.y * d.y) * HARMONICS_Y22);
}

// Radiance that arrives from direction `d`, W/(m² sr).
fn harmonics_radiance(c: array<vec4f, 9>, d: vec3f) -> vec3f {
    return max(harmonics_degree0(c) + harmonics_degree1(c, d) + harmonics_degree2(c, d), vec3f(0.0));
}

// Irradiance on a surface with normal `d`, W/m².
fn harmonics_irradiance(c: array<vec4f, 9>, d: vec3f) -> vec3f {
    return max(
        harmonics_degree0(c) * HARMONICS_COSINE0
            + harmonics_degree1(c, d) * HARMONICS_COSINE1
            + harmonics_degree2(c, d) * HARMONICS_COSINE2,
        vec3f(0.0),
    );
}
