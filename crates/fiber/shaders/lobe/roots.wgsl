// Where light leaves towards one azimuth: the roots of Φ(p, γ) = φ. Twin of `lobe/roots.rs`.

const ROOTS_CUBIC: u32 = 1u;  // the cubic of Marschner et al.; else the exact exit azimuth

// Up to three per image of the azimuth; beyond two images nothing exists.
const ROOTS_CAPACITY: u32 = 6u;

struct Roots {
    count: u32,
    gamma: array<f32, 6>,
    slope: array<f32, 6>,  // dΦ/dγ
}

// Exit azimuth less p π, and its derivative; both odd lobes and even ones are odd functions of γ then.
fn roots_exit(mode: u32, p: f32, inv_bravais: f32, gamma: f32) -> vec2f {
    if mode == ROOTS_CUBIC {
        let c = safe_asin(inv_bravais);
        let linear = 6.0 * p * c / PI - 2.0;
        let cubic = 8.0 * p * c / (PI * PI * PI);
        let g2 = gamma * gamma;
        return vec2f((linear - cubic * g2) * gamma, linear - 3.0 * cubic * g2);
    }
    let sin_t = clamp(sin(gamma) * inv_bravais, -1.0, 1.0);
    let cos_t = max(safe_sqrt(1.0 - sin_t * sin_t), 1e-6);
    return vec2f(2.0 * (p * safe_asin(sin_t) - gamma), 2.0 * p * cos(gamma) * inv_bravais / cos_t - 2.0);
}

// The positive γ at which the exit azimuth turns; a right angle where it does not.
fn roots_turning_point(mode: u32, p: f32, inv_bravais: f32) -> f32 {
    if mode == ROOTS_CUBIC {
        let c = safe_asin(inv_bravais);
        let linear = 6.0 * p * c / PI - 2.0;
        if linear <= 0.0 {
            return HALF_PI;
        }
        return min(sqrt(linear / (24.0 * p * c / (PI * PI * PI))), HALF_PI);
    }
    if p < 2.0 {
        return HALF_PI;
    }
    // p² (1 - sin²γ) = η'² - sin²γ, multiplied by 1 / η'².
    let n2 = inv_bravais * inv_bravais;
    let s2 = (p * p * n2 - 1.0) / max((p * p - 1.0) * n2, 1e-30);
    if s2 <= 0.0 {
        return HALF_PI;
    }
    return safe_asin(sqrt(min(s2, 1.0)));
}

// All roots for the azimuth `phi` relative to the known direction.
fn roots_solve(mode: u32, p: f32, inv_bravais: f32, phi: f32) -> Roots {
    var found: Roots;
    found.count = 0u;
    let near = wrap_angle(phi - p * PI);
    if p == 0.0 {
        found.count = 1u;
        found.gamma[0] = -0.5 * near;
        found.slope[0] = -2.0;
        return found;
    }
    if p == 1.0 && mode != ROOTS_CUBIC {
        // 2 (γ_t - γ) is `near` and sin γ_t = sin γ / η': two equations, linear in tan γ.
        let along = cos(0.5 * near) - inv_bravais;
        if along >= 0.0 {
            let across = -sin(0.5 * near);
            let scale = 1.0 / max(sqrt(along * along + across * across), 1e-30);
            found.count = 1u;
            found.gamma[0] = dir_theta(Dir(across * scale, along * scale, 0.0));
            found.slope[0] = roots_exit(mode, p, inv_bravais, found.gamma[0]).y;
        }
        return found;
    }
    let turn = roots_turning_point(mode, p, inv_bravais);
    let ends = array<f32, 4>(-HALF_PI, -turn, turn, HALF_PI);
    for (var piece = 0; piece < 3; piece++) {
        let a = ends[piece];
        let b = ends[piece + 1];
        if b <= a {
            continue;
        }
        let at_a = roots_exit(mode, p, inv_bravais, a).x;
        let at_b = roots_exit(mode, p, inv_bravais, b).x;
        for (var k = -1; k <= 1; k++) {
            // Half-open, so that a root on a common end counts once.
            let wanted = near + f32(k) * TAU;
            if (at_a < wanted) == (at_b < wanted) || found.count >= ROOTS_CAPACITY {
                continue;
            }
            let gamma = roots_invert(mode, p, inv_bravais, wanted, a, b, at_a < wanted);
            found.gamma[found.count] = gamma;
            found.slope[found.count] = roots_exit(mode, p, inv_bravais, gamma).y;
            found.count += 1u;
        }
    }
    return found;
}

// The root in a monotone piece, by Newton's method kept within a shrinking bracket.
fn roots_invert(mode: u32, p: f32, inv_bravais: f32, wanted: f32, a: f32, b: f32, rising: bool) -> f32 {
    var lo = a;
    var hi = b;
    var x = 0.5 * (a + b);
    for (var i = 0; i < 32; i++) {
        let f = roots_exit(mode, p, inv_bravais, x);
        if (f.x < wanted) == rising {
            lo = x;
        } else {
            hi = x;
        }
        var next = 0.5 * (lo + hi);
        if abs(f.y) > 1e-6 {
            let newton = x - (f.x - wanted) / f.y;
            if newton > lo && newton < hi {
                next = newton;
            }
        }
        let step = abs(next - x);
        x = next;
        if step < 1e-7 {
            break;
        }
    }
    return x;
}
