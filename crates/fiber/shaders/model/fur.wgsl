// Fur with a scattering medulla, after Yan et al. 2015 and 2017. Twin of `model/fur.rs`.
//
// The table of scattered light comes along, reduced to what one medulla needs: its nodes in offset and
// inclination, the numbers in their ranges.

// The scattering core.
struct Medulla {
    absorption: vec3f,      // per fiber radius
    radius: f32,            // in fiber radii
    scattering: f32,        // per fiber radius
    tabulated_radius: f32,  // the one that the cells are for
}

struct Fur {
    sigma_a: vec3f,   // of the cortex, per radius
    eta: f32,
    beta_m: f32,      // rad, of lobe R; TT half, all others twice
    beta_n: f32,      // rad, likewise
    alpha: f32,       // rad
    layers: f32,      // of cuticle that reflect
    medulla: Medulla,
    // Offset slow, inclination fast. In a cell: the share that leaves at once; then nine numbers about that light
    // and nine about the rest; then one that means nothing.
    cells: array<array<vec4f, 5>, 20>,
}

// One part of the scattered light.
struct FurLeaving {
    mean: vec2f,     // cosine and sine of the azimuth, relative to the way straight through
    centre: f32,     // sine along the fiber, over minus that of the known inclination
    width: f32,      // rad, along the fiber
    cortex: vec2f,   // depth at the absorption 0.25, scale of the gamma law
    medulla: vec2f,
    overlap: f32,    // how much of the two depths is common
}

fn fur_eval(m: Fur, known: Dir, h: f32, s: Dir) -> Lobes {
    let path = optics_path_at(optics_new(known.cos_theta * known.cos_theta, m.eta), h);
    let layers = max(m.layers, 1.0);
    let f = layers * path.fresnel / (1.0 + (layers - 1.0) * path.fresnel);

    // The way in the medulla: a chord of the inner circle, lengthened by the inclination inside.
    let radius = clamp(m.medulla.radius, 0.0, 0.95);
    let offset = sin(path.gamma_t);
    let sin_t = known.sin_theta / m.eta;
    let cos_t = sqrt(max(1.0 - sin_t * sin_t, 1e-12));
    let inside = min(2.0 * safe_sqrt((radius - offset) * (radius + offset)) / cos_t, path.length);
    let outside = path.length - inside;
    let scattering = max(m.medulla.scattering, 0.0);
    let once = exp(-m.sigma_a * outside - (m.medulla.absorption + scattering) * inside);
    let again = fur_echoes(f, once);
    let tt = once * ((1.0 - f) * (1.0 - f));
    let trt = tt * once * f;

    let along = max(m.beta_m * vec4f(1.0, 0.5, 2.0, 2.0), vec4f(MIN_WIDTH));
    let around = max(m.beta_n * vec3f(1.0, 0.5, 2.0), vec3f(MIN_WIDTH));
    let shift = m.alpha * vec4f(2.0, -1.0, -4.0, 0.0);
    var l = vec4f(0.0);
    for (var p = 0; p < 4; p++) {
        let cone = cone_specular(known.sin_theta, known.cos_theta, shift[p]);
        l[p] = longitudinal_density(along[p] * along[p], cone, s.sin_theta, s.cos_theta);
    }
    let phi = s.phi - known.phi;
    let straight = path_exit_azimuth(path, 1.0);
    let back = path_exit_azimuth(path, 2.0);
    var lobes = Lobes(
        vec3f(f * l.x * wrapped_gaussian(around.x, wrap_angle(phi - path_exit_azimuth(path, 0.0)))),
        tt * (l.y * wrapped_gaussian(around.y, wrap_angle(phi - straight))),
        trt * (l.z * wrapped_gaussian(around.z, wrap_angle(phi - back))),
        trt * again * (l.w / TAU),
    );

    let scattered = 1.0 - exp(-scattering * inside);
    if scattered > 0.0 {
        let numbers = fur_lookup(m.cells, max(abs(h), abs(offset) / radius), abs(known.sin_theta));
        let first_share = numbers[0].x;
        let first = FurLeaving(
            numbers[0].yz,
            numbers[0].w,
            numbers[1].x,
            vec2f(numbers[1].y, fur_scale(numbers[1].z)),
            vec2f(numbers[1].w, fur_scale(numbers[2].x)),
            numbers[2].y,
        );
        let later = FurLeaving(
            numbers[2].zw,
            numbers[3].x,
            numbers[3].y,
            vec2f(numbers[3].z, fur_scale(numbers[3].w)),
            vec2f(numbers[4].x, fur_scale(numbers[4].y)),
            numbers[4].z,
        );
        let absorption = m.medulla.absorption * (radius / m.medulla.tabulated_radius);
        // What reaches the medulla on the first crossing and is scattered there.
        let source = exp(-0.5 * m.sigma_a * outside) * ((1.0 - f) * scattered);
        let at_once = source * fur_dimming(first, m.sigma_a, absorption) * first_share;
        let rest = source * fur_dimming(later, m.sigma_a, absorption) * (1.0 - first_share);
        let side = select(1.0, -1.0, h < 0.0);
        lobes.residual += at_once * fur_spread(first, known, s, along.y, around.y, straight, side)
            + at_once * again * fur_spread(first, known, s, along.z, around.z, back, side)
            + (rest + rest * again) * fur_spread(later, known, s, along.z, around.z, straight, side);
    }
    return lobes;
}

// F T + (F T)² + ...: how much all crossings after one carry, relative to that one.
fn fur_echoes(f: f32, t: vec3f) -> vec3f {
    let rest = 1.0 - f * t;
    return select(vec3f(0.0), f * t / max(rest, vec3f(1e-30)), rest > vec3f(0.0));
}

// L N of one part of the scattered light; rough scales blur it as they blur the lobe beside it.
fn fur_spread(part: FurLeaving, known: Dir, s: Dir, along: f32, around: f32, exit: f32, side: f32) -> f32 {
    let sin_c = clamp(-part.centre * known.sin_theta, -1.0, 1.0);
    let cone = Cone(sin_c, safe_sqrt((1.0 - sin_c) * (1.0 + sin_c)));
    let l = longitudinal_density(part.width * part.width + along * along, cone, s.sin_theta, s.cos_theta);
    // The wrapped Gaussian with the same mean direction.
    let mean_length = clamp(sqrt(part.mean.x * part.mean.x + part.mean.y * part.mean.y), 1e-3, 1.0);
    let width = sqrt(max(-2.0 * log(mean_length), 0.0) + around * around);
    let turn = side * atan2(part.mean.y, part.mean.x);
    return l * wrapped_gaussian(width, wrap_angle(s.phi - known.phi - exit - turn));
}

// Share that absorption leaves of this light, for an absorption of the cortex and of the medulla per radius.
fn fur_dimming(part: FurLeaving, cortex: vec3f, medulla: vec3f) -> vec3f {
    return vec3f(
        fur_dimming_of(part, cortex.x, medulla.x),
        fur_dimming_of(part, cortex.y, medulla.y),
        fur_dimming_of(part, cortex.z, medulla.z),
    );
}

fn fur_dimming_of(part: FurLeaving, cortex: f32, medulla: f32) -> f32 {
    let c = part.cortex.x * fur_log1p(part.cortex.y * cortex) / fur_log1p(part.cortex.y * 0.25);
    let d = part.medulla.x * fur_log1p(part.medulla.y * medulla) / fur_log1p(part.medulla.y * 0.25);
    let longer = max(c, d);
    // A long way is long in both.
    return exp(-max(c + d - part.overlap * c * d / (1.0 + longer), longer));
}

// ln(1 + x) for x >= 0, with the digits that small x would lose.
fn fur_log1p(x: f32) -> f32 {
    if x < 0.02 {
        return x * (1.0 + x * (-0.5 + x * (0.333333333 - 0.25 * x)));
    }
    return log(1.0 + x);
}

// exp(x) - 1 for x >= 0, at least 1e-6.
fn fur_scale(x: f32) -> f32 {
    if x < 0.02 {
        return max(x * (1.0 + x * (0.5 + x * (0.166666667 + x / 24.0))), 1e-6);
    }
    return exp(x) - 1.0;
}

const FUR_OFFSETS = array<f32, 5>(0.0, 0.25, 0.5, 0.75, 0.99);
const FUR_SINES = array<f32, 4>(0.0, 0.333333333, 0.666666667, 0.999);

// A cell's numbers at an offset and at the sine of an inclination, both without sign; the edge beyond the edge.
fn fur_lookup(cells: array<array<vec4f, 5>, 20>, offset: f32, sine: f32) -> array<vec4f, 5> {
    let i = clamp(i32(offset * 4.0), 0, 3);
    let j = clamp(i32(sine * 3.0), 0, 2);
    let t = clamp((offset - FUR_OFFSETS[i]) / (FUR_OFFSETS[i + 1] - FUR_OFFSETS[i]), 0.0, 1.0);
    let u = clamp((sine - FUR_SINES[j]) / (FUR_SINES[j + 1] - FUR_SINES[j]), 0.0, 1.0);
    let at = 4 * i + j;
    var numbers: array<vec4f, 5>;
    for (var k = 0; k < 5; k++) {
        let low = cells[at][k] * (1.0 - u) + cells[at + 1][k] * u;
        let high = cells[at + 4][k] * (1.0 - u) + cells[at + 5][k] * u;
        numbers[k] = low * (1.0 - t) + high * t;
    }
    return numbers;
}
