// Kajiya & Kay 1989 with the two shifted highlights of Scheuermann. Twin of `model/kajiya_kay.rs`.

const KAJIYA_KAY_THESIS: u32 = 1u;  // `mode`: the legacy look; else normalised

struct Highlight {
    color: vec3f,  // black is no highlight
    exponent: f32,
    shift: f32,    // rad, of the tangent
}

struct KajiyaKay {
    diffuse: vec3f,
    mode: u32,
    highlights: array<Highlight, 2>,
}

fn kajiya_kay_eval(m: KajiyaKay, known: Dir, h: f32, s: Dir) -> Lobes {
    // How far the shifted cone of the first highlight, and of the second, is from where it peaks.
    let sum = dir_theta(known) + dir_theta(s);
    var lobes = lobes_zero();
    lobes.r = kajiya_kay_highlight(m.highlights[0], m.mode, sum, s.cos_theta);
    lobes.trt = kajiya_kay_highlight(m.highlights[1], m.mode, sum, s.cos_theta);
    if m.mode == KAJIYA_KAY_THESIS {
        lobes.residual = m.diffuse * s.cos_theta;
    } else {
        lobes.residual = m.diffuse * (s.cos_theta / (PI * PI));
    }
    return lobes;
}

// One highlight; `sum` is theta_k + theta_s.
fn kajiya_kay_highlight(highlight: Highlight, mode: u32, sum: f32, cos_s: f32) -> vec3f {
    let delta = sum - 2.0 * clamp(highlight.shift, -0.5 * HALF_PI, 0.5 * HALF_PI);
    let c = cos(delta);
    // Shifts can carry the cone more than half a turn away, where the cosine is positive again.
    if abs(delta) >= HALF_PI || c <= 0.0 {
        return vec3f(0.0);
    }
    let exponent = highlight.exponent;
    var scale = pow(c, exponent);
    if mode != KAJIYA_KAY_THESIS {
        scale *= kajiya_kay_norm(exponent) / TAU * (exponent + 2.0) / (exponent + 1.0) * cos_s;
    }
    return highlight.color * scale;
}

// `Γ(m/2+1) / (√π Γ((m+1)/2))`, norm of the power `m` of a cosine on a half turn.
//
// Γ(x+½)/Γ(x) by its series in 1/x, after three steps of the recurrence; relative error below 3e-6.
fn kajiya_kay_norm(m: f32) -> f32 {
    let x = 0.5 * (m + 1.0);
    let down = x / (x + 0.5) * (x + 1.0) / (x + 1.5) * (x + 2.0) / (x + 2.5);
    let y = x + 3.0;
    let i = 1.0 / y;
    let series = 1.0 + i * (-0.125 + i * (0.0078125 + i * (0.0048828125 - i * 0.000640869140625)));
    return 0.564189584 * down * sqrt(y) * series;
}
