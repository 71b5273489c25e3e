// From a fragment to radiance: every lamp, its shadow, the fiber, and light that other fibers scattered.
//
// What stands in front of this text was put together for the scene: the fiber models in use, `shade_fiber` (their
// values by entry of the palette), the lamps, one shadow technique, and the constants
// `SHADE_DEFERRED`, `SHADE_MULTIPLE`, `SHADE_HARMONICS` (bool), `SHADE_STRENGTH` (of shadows),
// `SHADE_DENSITY_FORWARD`, `SHADE_DENSITY_BACKWARD` (f32).

// Rows of the curves; see `multiple/spread.rs` of the fiber library.
const SHADE_ROWS: f32 = 12.0;

// The axes of a fiber: the first one along the tangent.
fn shade_frame(tangent: vec3f, strand: u32) -> mat3x3f {
    // Elliptical fibers have their longer diameter along the second axis: another direction on every strand.
    var x = strand * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
    x = (x >> 22u) ^ x;
    let z = f32(x & 0xffffu) / 32768.0 - 1.0;
    let turn = f32(x >> 16u) * (TAU / 65536.0);
    let axis = vec3f(sqrt(max(1.0 - z * z, 0.0)) * vec2f(cos(turn), sin(turn)), z);
    var v = axis - tangent * dot(axis, tangent);
    if dot(v, v) < 1e-8 {
        v = select(vec3f(1.0, 0.0, 0.0), vec3f(0.0, 1.0, 0.0), abs(tangent.x) > 0.5);
        v -= tangent * dot(v, tangent);
    }
    v = normalize(v);
    return mat3x3f(tangent, v, cross(tangent, v));
}

fn shade_dir(frame: mat3x3f, world: vec3f) -> Dir {
    return dir_from_local(world * frame);
}

fn shade_curve(row: f32, theta: f32, layer: u32) -> vec4f {
    let at = vec2f(spread_theta_coord(theta), (row + 0.5) / SHADE_ROWS);
    return textureSampleLevel(shade_curves, shade_sampler, at, layer, 0.0);
}

fn shade_side(row: f32, theta: f32, layer: u32) -> SpreadSide {
    return SpreadSide(
        shade_curve(row, theta, layer).xyz,
        shade_curve(row + 1.0, theta, layer).xyz,
        shade_curve(row + 2.0, theta, layer).xyz,
    );
}

// What reaches a place behind `n` fibers on average, if they lie at random (Poisson) and all like this one.
fn shade_front(n: f32, side: SpreadSide) -> Front {
    let open = exp(-n);
    // Sum over k >= 1 of e^-n n^k / k! a^k.
    let scattered = max(exp(-n * (1.0 - side.attenuation)) - open, vec3f(0.0));
    // Fibers crossed by light that crosses any.
    let crossed = select(n / (1.0 - open), 1.0 + 0.5 * n, n < 1e-3);
    return Front(open, scattered, side.shift * crossed, side.variance * crossed);
}

// Radiance towards the viewer.
fn shade(f: Fragment) -> vec3f {
    let entry = shade_entries[f.entry];
    let frame = shade_frame(f.tangent, f.strand);
    let known = shade_dir(frame, view_to_eye(f.position));
    var sum = vec3f(0.0);
    var open = 0.0;
    let count = lamp_count();
    for (var i = 0u; i < count; i++) {
        let light = lamp_arriving(i, f.position);
        let solid = shadow_solid(i, f.position);
        if solid <= 0.0 || all(light.irradiance <= vec3f(0.0)) {
            continue;
        }
        let s = shade_dir(frame, light.direction);
        let direct = shade_fiber(entry, known, f.h, f.width_px, s);
        var value = vec3f(0.0);
        if SHADE_MULTIPLE {
            let theta = dir_theta(s);
            let theta_d = 0.5 * (dir_theta(known) - theta);
            let n = SHADE_STRENGTH * shadow_fibers(i, f.position);
            let front = shade_front(n, shade_side(0.0, -theta, entry.layer));
            let same = cos(s.phi - known.phi) >= 0.0;
            let around = shade_side(select(6.0, 3.0, same), theta_d, entry.layer);
            let at = spread_glow_coords(known, s, vec2f(textureDimensions(shade_glow_a)));
            let theta_k = dir_theta(known);
            value = spread_eval(
                known,
                s,
                direct,
                front,
                around,
                textureSampleLevel(shade_glow_a, shade_sampler, at, entry.layer, 0.0),
                textureSampleLevel(shade_glow_b, shade_sampler, at, entry.layer, 0.0),
                textureSampleLevel(shade_glow_c, shade_sampler, at, entry.layer, 0.0),
                shade_curve(9.0, theta_k, entry.layer),
                shade_curve(10.0, theta_k, entry.layer),
                SHADE_DENSITY_FORWARD,
                SHADE_DENSITY_BACKWARD,
            );
            open += front.direct;
        } else {
            let lit = shadow_lit(i, f.position);
            value = lobes_sum(direct) * lit;
            open += lit;
        }
        sum += light.irradiance * (solid * value);
    }
    if SHADE_HARMONICS {
        // The smooth part of the surroundings has no shadow map: as much of it gets here as of the lamps on average.
        let share = select(open / f32(count), 1.0, count == 0u);
        let albedo = shade_curve(11.0, dir_theta(known), entry.layer).xyz;
        sum += albedo * share * lamp_ambient(view_to_eye(f.position));
    }
    return sum;
}

// --- What is kept of a fragment until the picture is put together: eight bytes.

fn payload_octahedral(d: vec3f) -> vec2f {
    let flat = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
    if d.z >= 0.0 {
        return flat;
    }
    return (1.0 - abs(flat.yx)) * select(vec2f(-1.0), vec2f(1.0), flat >= vec2f(0.0));
}

fn payload_direction(p: vec2f) -> vec3f {
    var d = vec3f(p, 1.0 - abs(p.x) - abs(p.y));
    if d.z < 0.0 {
        d = vec3f((1.0 - abs(d.yx)) * select(vec2f(-1.0), vec2f(1.0), d.xy >= vec2f(0.0)), d.z);
    }
    return normalize(d);
}

fn fragment_payload(f: Fragment) -> vec2u {
    if SHADE_DEFERRED {
        let alpha = u32(round(clamp(f.alpha, 0.0, 1.0) * 2047.0));
        let h = u32(round((0.5 + 0.5 * clamp(f.h, -1.0, 1.0)) * 255.0));
        return vec2u(pack2x16snorm(payload_octahedral(f.tangent)), f.entry | (alpha << 12u) | (h << 23u));
    }
    let color = clamp(shade(f), vec3f(0.0), vec3f(60000.0));
    return vec2u(pack2x16float(color.xy), pack2x16float(vec2f(color.z, f.alpha)));
}

fn payload_alpha(payload: vec2u) -> f32 {
    if SHADE_DEFERRED {
        return f32((payload.y >> 12u) & 2047u) / 2047.0;
    }
    return unpack2x16float(payload.y).y;
}

fn payload_color(payload: vec2u, pixel: vec2f, depth: f32) -> vec4f {
    if SHADE_DEFERRED {
        var f: Fragment;
        f.position = view_position(pixel, depth);
        f.depth = depth;
        f.tangent = payload_direction(unpack2x16snorm(payload.x));
        f.alpha = payload_alpha(payload);
        f.h = f32((payload.y >> 23u) & 255u) / 127.5 - 1.0;
        f.width_px = f.alpha;
        f.entry = payload.y & 4095u;
        return vec4f(shade(f), f.alpha);
    }
    let last = unpack2x16float(payload.y);
    return vec4f(unpack2x16float(payload.x), last.x, last.y);
}
