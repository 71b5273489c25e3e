// Densities over the azimuth of the scattered direction. Twin of `lobe/azimuthal.rs`.

// A Gaussian of standard deviation `sigma` wrapped around the circle, at `x` in [-pi, pi].
fn wrapped_gaussian(sigma: f32, x: f32) -> f32 {
    let a = abs(x);
    var sum = gaussian(sigma, a);
    // Images that can still matter at 9 standard deviations; 16 turns are enough for any width up to 10 radians.
    for (var k = 1; k <= 16; k++) {
        let turn = f32(k) * TAU;
        if turn - a >= 9.0 * sigma {
            break;
        }
        sum += gaussian(sigma, a - turn) + gaussian(sigma, a + turn);
    }
    return sum;
}

// The logistic distribution cut to [-pi, pi], at `x` in there.
fn trimmed_logistic(s: f32, x: f32) -> f32 {
    let e = exp(-abs(x) / s);
    // tanh(pi / 2s), by a form that no large argument can break.
    let rim = exp(-PI / s);
    return e * (1.0 + rim) / (s * (1.0 + e) * (1.0 + e) * (1.0 - rim));
}
